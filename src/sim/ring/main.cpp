// Simulates a fibre ring: nodes in RTL with their host programs, the fibres between them, and the doors
// through which CAN programs join.
#include <poll.h>

#include <chrono>
#include <csignal>
#include <cstdio>
#include <iostream>

#include "core/control.h"
#include "core/program.h"
#include "core/pcap_io.h"
#include "core/stop.h"
#include "core/user_error.h"
#include "plant/key.h"
#include "plant/plant.h"
#include "ring/bench.h"
#include "ring/levels.h"
#include "ring/master_link.h"
#include "ring/script.h"

namespace {
// Moves frames between the ring's gateway and the plant network of this computer.
class PlantLink {
 public:
  PlantLink(Ring& ring, const std::string& pcap)
      : ring_(ring),
        plant_([this](const Bytes& frame) {
          ring_.plant()->send(frame, ring_.now());
          record(ring_.now(), frame);
        }) {
    if (!pcap.empty()) record_ = std::make_unique<CaptureWriter>(pcap);
  }
  void serve() {
    for (const auto& frame : ring_.plant()->taken()) {
      record(frame.at, frame.bytes);
      plant_.fromNode(frame.bytes);
    }
    plant_.poll();
  }

 private:
  void record(Time at, const Bytes& frame) {
    if (record_) record_->write(at / kNs, frame);
  }
  Ring& ring_;
  std::unique_ptr<CaptureWriter> record_;
  Plant plant_;
};

// Until `quit`, `stop` or `endMs`.
void serve(Ring& ring, Doors& doors, PlantLink* plant, MasterLink* master, LevelRecorder* levels,
           Script& script, const std::string& controlPath, double endMs, const Stop& stop) {
  RingBench bench(ring, doors);
  bool quit = false;
  const auto command = [&](const std::vector<std::string>& words) -> std::string {
    if (words.size() == 1 && words[0] == "quit") return quit = true, "";
    return bench.command(words);
  };
  std::unique_ptr<Control> control;
  if (!controlPath.empty()) control = std::make_unique<Control>(controlPath, command);
  std::printf("ready: %zu nodes, seed %llu\n", ring.size(), static_cast<unsigned long long>(ring.seed()));
  std::fflush(stdout);
  const auto begin = std::chrono::steady_clock::now();
  constexpr Time kLook = 20 * kUs;
  const Time end = endMs > 0 ? static_cast<Time>(endMs * 1000) * kUs : kNever;
  std::vector<pollfd> fds;
  while (!quit && !stop.isWanted() && ring.now() < end) {
    ring.runUntil(std::min(ring.now() + kLook, script.next()));
    doors.serve();  // before a script ends a host, with what has happened at its port
    script.run(ring.now(), command);
    if (levels) levels->flush();
    if (plant) plant->serve();
    if (master) master->serve();
    if (!control) continue;
    fds.clear();
    control->wanted(fds);
    if (poll(fds.data(), fds.size(), 0) > 0) control->serve();
  }
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  const double ms = static_cast<double>(ring.now() / kNs) / 1e6;
  std::fprintf(stderr, "simulated %.3f ms in %.1f s, %.3f ms/s, %.2f million core cycles/s\n", ms, seconds,
               ms / seconds, static_cast<double>(ring.coreCycles()) / seconds / 1e6);
}
}  // namespace

int main(int argc, char** argv) {
  Stop stop;
  CLI::App app(
      "Simulates a fibre ring: nodes in RTL with their host programs, and the fibres between them. "
      "Presets built in: " +
      presetNames() + ".");
  app.name("flyframe-ring");
  std::string network, control, vcd, scriptPath, key, plantPcap, interface, state = "build/ring/state";
  double timeScale = 0;
  RingOptions options;
  ring_server_parameters& server = options.server;
  server.plant.udp_port = 50000;
  const std::array<uint8_t, 6> mac{0x02, 0x46, 0x41, 0, 0, 2};
  std::copy(mac.begin(), mac.end(), server.plant.mac);
  std::copy(Plant::kServerMac.begin(), Plant::kServerMac.end(), server.plant.server_mac);
  std::copy(Plant::kNodeIp.begin(), Plant::kNodeIp.end(), server.plant.ip);
  std::copy(Plant::kServerIp.begin(), Plant::kServerIp.end(), server.plant.server_ip);
  // So that nobody waits for long: simulated time is slow.
  server.reports.gateway = 1, server.reports.repeat_ms = 4, server.reports.heartbeat_ms = 4;
  server.reports.silent_after_ms = 1000;
  Doors::Options doorOptions;
  double endMs = 0;
  uint64_t seed = 0;
  bool withParent = false;
  app.add_option("--network", network, "description of the ring (JSON)")->required();
  app.add_option("--control", control, "socket that takes lines of text: cut 3, status, quit, ...");
  app.add_option("--state", state, "folder of the non-volatile memories of the nodes")->capture_default_str();
  app.add_option("--end-ms", endMs, "ends after so much simulated time; 0: never")
      ->capture_default_str()
      ->check(isNumber)
      ->check(CLI::Range(0.0, 1e6));
  app.add_option("--processors", options.processors, "how many may be used at once")
      ->capture_default_str()
      ->check(CLI::Range(1, 64));
  const auto door = [&](const char* name, std::vector<std::string>& to, const char* meaning) {
    app.add_option(name, to, meaning);
  };
  door("--slcan", doorOptions.slcan, "NODE=PATH: a pseudo-terminal with slcan, PATH becomes a link to it");
  door("--socketcand", doorOptions.socketcand, "NODE=PORT: socketcand on 127.0.0.1, bus can0");
  door("--cannelloni", doorOptions.cannelloni,
       "NODE=PORT[:PEER]: cannelloni on 127.0.0.1, over TCP; 2 over UDP, to port PEER, else to who has sent "
       "last");
  door("--socketcan", doorOptions.socketcan, "NODE=INTERFACE: a CAN interface of this computer");
  door("--record", doorOptions.pcap, "NODE=FILE: frames and errors as a capture (SocketCAN)");
  door("--candump", doorOptions.candump, "NODE=FILE: the same as a log of candump");
  app.add_option("--script", scriptPath, "lines of the control socket, each behind its time in us");
  app.add_option("--server-port", server.plant.server_port,
                 "UDP port of the server on 127.0.0.1, for the node with host 'server'")
      ->check(CLI::Range(1, 65535));
  app.add_option("--key", key, "file with the key that server and gateway share: 32 hex digits");
  app.add_option("--gateway-id", server.reports.gateway, "ID of the gateway")
      ->capture_default_str()
      ->check(CLI::Range(1, 65535));
  app.add_option("--report-repeat-ms", server.reports.repeat_ms,
                 "repetition of reports that are not acknowledged")
      ->capture_default_str()
      ->check(CLI::Range(1, 10000));
  app.add_option("--heartbeat-ms", server.reports.heartbeat_ms, "reports without news")
      ->capture_default_str()
      ->check(CLI::Range(1, 10000));
  app.add_option("--plant-pcap", plantPcap, "record the plant network");
  app.add_option("--interface", interface,
                 "interface with the EtherCAT master, for the node with host 'gateway'");
  app.add_option(
         "--time-scale", timeScale,
         "with a master simulated time runs at most at so much of the wall clock; 0: as fast as it can")
      ->capture_default_str()
      ->check(isNumber)
      ->check(CLI::Range(0.0, 1.0));
  app.add_option("--vcd", vcd, "the levels bus, drive, R1, R2, T1 and T2 of each node");
  app.add_flag("--with-parent", withParent, "ends when the program that has started it has ended");
  const auto* seeded = app.add_option("--seed", seed, "instead of the network's")->check(wholeNumber());
  std::signal(SIGPIPE, SIG_IGN);  // a reader that leaves is an error of writing
  return runProgram(app, argc, argv, [&]() -> int {
    RingSpec spec = readRing(network);
    if (!seeded->empty()) spec.seed = seed;
    options.state = state;
    std::error_code failed;
    std::filesystem::create_directories(options.state, failed);
    if (failed) throw UserError("cannot make the folder '" + state + "'.");
    Script script(scriptPath);
    if (!key.empty()) readKey(key, server.reports.key);
    Ring ring(spec, options);
    Doors doors(ring, doorOptions);
    std::unique_ptr<PlantLink> plant;
    if (ring.plant()) {
      if (key.empty() || server.plant.server_port == 0)
        throw UserError("a ring with a node for the server needs --server-port and --key.");
      plant = std::make_unique<PlantLink>(ring, plantPcap);
    }
    std::unique_ptr<MasterLink> master;
    if (!interface.empty() && !ring.master())
      throw UserError("--interface is given, but the ring has no node with host 'gateway'.");
    if (!interface.empty()) master = std::make_unique<MasterLink>(ring, interface, timeScale);
    std::unique_ptr<LevelRecorder> levels;
    if (!vcd.empty()) levels = std::make_unique<LevelRecorder>(ring, vcd);
    stop.listen(withParent);
    serve(ring, doors, plant.get(), master.get(), levels.get(), script, control, endMs, stop);
    return 0;
  });
}

// Simulates the smoke-alarm system: a master, its slaves with their detectors and host programs, and the
// plant network to a server on this computer.
#include <poll.h>

#include <chrono>
#include <cstdio>
#include <iostream>

#include "alarm/flood.h"
#include "alarm/measure.h"
#include "alarm/network.h"
#include "core/control.h"
#include "core/program.h"
#include "core/stop.h"
#include "core/user_error.h"
#include "plant/key.h"
#include "plant/plant.h"

namespace {
template <class Array>
void copyTo(uint8_t* to, const Array& from) {
  std::copy(from.begin(), from.end(), to);
}

// Until `quit` or `stop`.
void serve(AlarmNetwork& network, const std::string& controlPath, const Stop& stop) {
  Plant plant([&](const Bytes& frame) {
    // As much as a station takes in that is far too slow.
    if (network.line().plantBacklog() < 100'000) network.toMaster(frame);
  });
  network.onFromMaster = [&](const NibbleFrame&, const Bytes& frame) { plant.fromNode(frame); };
  bool quit = false;
  std::unique_ptr<Control> control;
  if (!controlPath.empty())
    control =
        std::make_unique<Control>(controlPath, [&](const std::vector<std::string>& words) -> std::string {
          if (words.size() == 1 && words[0] == "quit") return quit = true, "";
          return network.command(words);
        });
  std::printf("ready: %zu slaves\n", network.line().slaves());
  std::fflush(stdout);
  const auto begin = std::chrono::steady_clock::now();
  std::vector<pollfd> fds;
  while (!quit && !stop.isWanted()) {
    network.line().advance();
    plant.poll();
    if (!control) continue;
    fds.clear();
    control->wanted(fds);
    if (poll(fds.data(), fds.size(), 0) > 0) control->serve();
  }
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  const double ms = static_cast<double>(network.line().ns()) / 1e6;
  std::fprintf(stderr, "simulated %.3f ms in %.1f s, %.2f ms/s\n", ms, seconds, ms / seconds);
}
}  // namespace

int main(int argc, char** argv) {
  Stop stop;
  CLI::App app(
      "Simulates the smoke-alarm system: an alarm master and its slaves (RTL) with their host programs. The "
      "master's datagrams to the\n"
      "server go to 127.0.0.1. Slaves are numbered from 1 on.",
      "flyframe-alarm");
  AlarmOptions options;
  alarm_master_parameters& master = options.master;
  std::string key, control, state = "alarm-state";
  size_t measure = 0, flood = 0;
  bool withParent = false;
  master.master_id = 1, master.master_port = 50000, master.answer_timeout_us = 100, master.retries = 2;
  master.bus_cycle_us = 1000, master.report_repeat_ms = 2, master.report_heartbeat_ms = 4;
  const std::array<uint8_t, 6> mac{0x02, 0x46, 0x41, 0, 0, 1};
  master.server_timeout_s = 30, master.alive_ms = 20;
  // So that nobody waits for long: simulated time is slow.
  master.panel = {4, 40, 1, 40, nullptr, 0};
  copyTo(master.master_mac, mac), copyTo(master.server_mac, Plant::kServerMac);
  copyTo(master.master_ip, Plant::kNodeIp), copyTo(master.server_ip, Plant::kServerIp);
  options.slave = {1, 100, 2, 20};
  app.add_option("--slaves", options.line.slaves, "slaves on the line")
      ->capture_default_str()
      ->check(CLI::Range(1, 64));
  app.add_flag("--ring", options.line.ring, "a cable leads from the last slave back to the master");
  app.add_flag("!--unlisted", options.listed, "the master expects no slaves");
  app.add_option("--server-port", master.server_port, "UDP port of the server on 127.0.0.1")
      ->check(CLI::Range(1, 65535));
  app.add_option("--key", key, "file with the key that server and master share: 32 hex digits");
  app.add_option("--state", state, "folder for the non-volatile memories of the hosts")
      ->capture_default_str();
  app.add_option("--control", control, "Unix socket that takes commands");
  // What host programs are given may be nonsense: it shows what they say of it (HOST-02).
  app.add_option("--master-id", master.master_id, "ID of the master")->capture_default_str();
  app.add_option("--node-id", options.slave.node_id, "node ID of the first slave; the others follow")
      ->capture_default_str();
  app.add_option("--bus-cycle-us", master.bus_cycle_us, "bus cycle")->capture_default_str();
  app.add_option("--answer-timeout-us", master.answer_timeout_us, "how long the master waits for a frame")
      ->capture_default_str();
  app.add_option("--retries", master.retries, "how often it sends a frame again")->capture_default_str();
  app.add_option("--report-repeat-ms", master.report_repeat_ms,
                 "repetition of reports that are not acknowledged")
      ->capture_default_str();
  app.add_option("--heartbeat-ms", master.report_heartbeat_ms, "reports without events")
      ->capture_default_str();
  app.add_option("--server-timeout-s", master.server_timeout_s,
                 "without an answer for so long the server is silent")
      ->capture_default_str();
  app.add_option("--alive-ms", master.alive_ms, "hosts that say nothing for so long are dead")
      ->capture_default_str();
  app.add_option("--bounce-ms", master.panel.bounce_ms, "how long buttons must be pressed")
      ->capture_default_str();
  app.add_option("--page-ms", master.panel.page_ms, "how long a page of the display stands")
      ->capture_default_str();
  app.add_option("--display-lines", master.panel.lines, "lines of the display")
      ->capture_default_str()
      ->check(CLI::Range(2, 4));
  app.add_option("--display-columns", master.panel.columns, "columns of the display")
      ->capture_default_str()
      ->check(CLI::Range(20, 40));
  app.add_option("--debounce-us", options.slave.debounce_us, "how long a detector's state must last")
      ->capture_default_str();
  app.add_option("--off-time-ms", options.slave.off_time_ms,
                 "how long a detector's supply stays off to reset it")
      ->capture_default_str();
  app.add_option("--bit-errors", options.line.bitErrors,
                 "flip one bit of so many on each line cable; 0: none")
      ->capture_default_str()
      ->check(wholeNumber());
  app.add_option("--seed", options.line.seed, "seed of clock phases and bit errors")
      ->capture_default_str()
      ->check(wholeNumber());
  app.add_option("--line-pcap", options.linePcap, "record the cable before the first slave");
  app.add_option("--plant-pcap", options.plantPcap, "record the plant network");
  app.add_option("--measure", measure,
                 "measure the time from detector to report over so many events instead, without a server")
      ->check(wholeNumber());
  app.add_option(
         "--flood", flood,
         "send so many hostile datagrams of each kind to the master instead, at the speed of the wire")
      ->check(wholeNumber());
  app.add_flag("--with-parent", withParent, "ends when the program that has started it has ended");
  return runProgram(app, argc, argv, [&]() -> int {
    if (measure > 0 || flood > 0) {
      std::fill(std::begin(master.key), std::end(master.key), 1);
      if (master.server_port == 0) master.server_port = 50001;
      options.slave.debounce_us = 0;
    } else {
      if (key.empty() || master.server_port == 0) throw UserError("--server-port and --key are needed.");
      readKey(key, master.key);
    }
    options.slave.alive_ms = master.alive_ms;
    options.state = state;
    std::error_code failed;
    std::filesystem::create_directories(options.state, failed);
    if (failed) throw UserError("cannot make the folder '" + state + "'.");
    AlarmNetwork network(options);
    if (measure > 0) std::cout << measureReports(network, options, measure).dump(2) << "\n";
    else if (flood > 0) std::cout << floodMaster(network, options, flood).dump(2) << "\n";
    else stop.listen(withParent), serve(network, control, stop);
    return 0;
  });
}

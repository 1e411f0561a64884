// Simulates a line of slaves and replays a recording through it.
#include <chrono>
#include <cstdio>
#include <iostream>

#include "model.h"
#include "program.h"
#include "replay.h"
#include "user_error.h"

int main(int argc, char** argv) {
  CLI::App app("Simulates a line of slaves and replays recorded frames of a master through it.", "flyframe-cosim");
  std::string network;
  NetworkOptions net;
  ReplayOptions opt;
  bool stats = false, noSkip = false, list = false;
  app.add_option("--network", network, "network file (JSON)");
  app.add_option("--replay", opt.in, "capture whose frames the master sends (pcap or pcapng)");
  app.add_option("--out", opt.out, "capture to write: what comes back (pcap, nanoseconds)");
  app.add_flag("--both", opt.both, "record the sent frames too");
  app.add_option("--trace", net.traceFile, "write a waveform of all slaves (FST)");
  app.add_option("--timeout-us", opt.timeoutUs, "a frame is lost if it has not come back after this time")->capture_default_str()->check(CLI::PositiveNumber);
  app.add_option("--settle-us", net.settleUs, "quiet time after which the network counts as idle")->capture_default_str()->check(CLI::NonNegativeNumber);
  app.add_option("--seed", net.seed, "seed of the clocks' start phases")->capture_default_str();
  app.add_flag("--no-skip", noSkip, "simulate idle time in full");
  app.add_flag("--stats", stats, "print the speed of the simulation");
  app.add_flag("--list", list, "print the presets built in");
  return runProgram(app, argc, argv, [&]() -> int {
    if (list) return std::cout << presetNames() << "\n", 0;
    if (network.empty() || opt.in.empty() || opt.out.empty()) throw UserError("--network, --replay and --out are needed.");
    net.skipIdle = !noSkip;
    const std::vector<SlaveSpec> specs = readNetwork(network);
    const auto start = std::chrono::steady_clock::now();
    const ReplayResult r = replay(specs, net, opt);
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    std::fprintf(stderr, "sent %zu, returned %zu, lost %zu, bad FCS %zu, runts %zu\n", size_t(r.sent), size_t(r.returned),
                 size_t(r.lost), size_t(r.badFcs), size_t(r.runts));
    if (stats)
      std::fprintf(stderr, "simulated %.6f s, of it skipped %.6f s, %zu core cycles in each of %zu slaves, %.2f s, %.0f core cycles/s\n",
                   r.simulatedNs * 1e-9, r.skippedNs * 1e-9, size_t(r.coreCycles / specs.size()), specs.size(), seconds,
                   r.coreCycles / specs.size() / seconds);
    return 0;
  });
}

// Simulates a network of slaves for a master: one on a network interface, or the recording of one.
#include <chrono>
#include <cstdio>
#include <iostream>
#include <optional>

#include "live/live.h"
#include "core/model.h"
#include "core/program.h"
#include "network/replay.h"
#include "core/user_error.h"

namespace {
int runLive(const NetworkSpec& spec, const NetworkOptions& net, const LiveOptions& opt) {
  const LiveResult r = live(spec, net, opt);
  std::fprintf(stderr, "received %zu, returned %zu, lost %zu, stale %zu, bad FCS %zu, runts %zu\n",
               size_t(r.received), size_t(r.returned), size_t(r.lost), size_t(r.stale), size_t(r.badFcs),
               size_t(r.runts));
  const double cycles = static_cast<double>(r.coreCycles) / static_cast<double>(spec.slaves.size());
  std::fprintf(stderr,
               "simulated %.6f s, %.0f core cycles in each of %zu slaves, %.2f s, %.0f core cycles/s, frames "
               "took %.0f us, worst %.0f us\n",
               r.simulatedNs * 1e-9, cycles, spec.slaves.size(), r.busySeconds,
               r.busySeconds > 0 ? cycles / r.busySeconds : 0, r.meanRoundUs, r.worstRoundUs);
  return 0;
}

int runReplay(const NetworkSpec& spec, const NetworkOptions& net, const ReplayOptions& opt, bool stats) {
  const auto start = std::chrono::steady_clock::now();
  const ReplayResult r = replay(spec, net, opt);
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  std::fprintf(stderr, "sent %zu, returned %zu, lost %zu, bad FCS %zu, runts %zu\n", size_t(r.sent),
               size_t(r.returned), size_t(r.lost), size_t(r.badFcs), size_t(r.runts));
  if (stats)
    std::fprintf(stderr,
                 "simulated %.6f s, of it skipped %.6f s, %zu core cycles in each of %zu slaves, %.2f s, "
                 "%.0f core cycles/s\n",
                 r.simulatedNs * 1e-9, r.skippedNs * 1e-9, size_t(r.coreCycles / spec.slaves.size()),
                 spec.slaves.size(), seconds, r.coreCycles / spec.slaves.size() / seconds);
  return 0;
}
}  // namespace

int main(int argc, char** argv) {
  CLI::App app(
      "Simulates a network of slaves: joins a network interface, for a real master, or replays the recorded "
      "frames of one.",
      "flyframe-cosim");
  std::string network;
  std::optional<uint64_t> seed;
  NetworkOptions net;
  ReplayOptions replayOptions;
  LiveOptions liveOptions;
  bool stats = false, noSkip = false, list = false;
  app.add_option("--network", network, "network file (JSON)");
  app.add_option("--interface", liveOptions.interface, "Linux network interface to join");
  app.add_option("--ring-interface", liveOptions.ringInterface, "live: that of the master's second card");
  app.add_option("--stale-ms", liveOptions.staleMs,
                 "live: a frame that has waited so long is lost, as its master has given it up (0: never)")
      ->capture_default_str()
      ->check(CLI::NonNegativeNumber);
  app.add_option("--time-scale", liveOptions.timeScale,
                 "live: simulated time per wall time while idle, as far as the machine keeps up")
      ->capture_default_str()
      ->check(CLI::Range(0.0, 1000.0));
  app.add_option("--control", liveOptions.control, "live: Unix socket that takes commands");
  app.add_option("--sync", liveOptions.sync,
                 "live: file to write: the edges of SYNC signals, a line each: slave, signal, level, ns");
  app.add_option("--replay", replayOptions.in, "capture whose frames the master sends (pcap or pcapng)");
  app.add_option("--out", replayOptions.out, "replay: capture to write: what comes back (pcap, nanoseconds)");
  app.add_flag("--both", replayOptions.both, "replay: record the sent frames too");
  app.add_option("--trace", net.traceFile, "write a waveform of all slaves (FST)");
  app.add_option("--timeout-us", replayOptions.timeoutUs,
                 "replay: a frame is lost if it has not come back after this time")
      ->capture_default_str()
      ->check(CLI::PositiveNumber);
  app.add_option("--settle-us", net.settleUs, "quiet time after which the network counts as idle")
      ->capture_default_str()
      ->check(CLI::NonNegativeNumber);
  app.add_option("--seed", seed, "seed of all that is random, instead of that of the network file");
  app.add_flag("--no-skip", noSkip, "replay: simulate idle time in full");
  app.add_flag("--stats", stats, "replay: print the speed of the simulation");
  app.add_flag("--list", list, "print the presets built in");
  return runProgram(app, argc, argv, [&]() -> int {
    if (list) return std::cout << presetNames() << "\n", 0;
    const bool isLive = !liveOptions.interface.empty();
    if (network.empty() || (!isLive && (replayOptions.in.empty() || replayOptions.out.empty())))
      throw UserError("--network and either --interface or --replay and --out are needed.");
    if (isLive && !replayOptions.in.empty()) throw UserError("--interface and --replay exclude each other.");
    if (!isLive && !liveOptions.ringInterface.empty())
      throw UserError("--ring-interface is for --interface only.");
    if (!isLive && !liveOptions.sync.empty()) throw UserError("--sync is for --interface only.");
    net.skipIdle = !noSkip;
    NetworkSpec spec = readNetwork(network);
    if (seed) spec.seed = *seed;
    return isLive ? runLive(spec, net, liveOptions) : runReplay(spec, net, replayOptions, stats);
  });
}

// Measures the delay from the SFD on RXD to the SFD on TXD over all phases of the receive clock against the
// core clock.
#include <algorithm>
#include <iostream>
#include <nlohmann/json.hpp>

#include "core/bench.h"
#include "core/ethernet.h"
#include "core/program.h"
#include "core/esc.h"
#include "core/user_error.h"

namespace {
using nlohmann::ordered_json;

struct Range {
  Time best = kNever, worst = 0;
  void add(Time t) { best = std::min(best, t), worst = std::max(worst, t); }
};

// A frame of one NOP datagram, which passes every slave unchanged.
Bytes nopFrame() {
  Bytes f = {
      0xff,    0xff, 0xff, 0xff, 0xff, 0xff, 0, 0, 0, 0, 0, 1, esc::kEtherCat >> 8, esc::kEtherCat & 0xff,
      12 + 20, 0x10};
  const Bytes datagram = {0, 0, 0, 0, 0, 0, 20, 0, 0, 0};
  f.insert(f.end(), datagram.begin(), datagram.end());
  f.resize(60);
  return f;
}

ordered_json inNs(Time t) { return static_cast<double>(t / 1000) / 1000; }

class LatencyMeter {
 public:
  LatencyMeter(const Preset& preset, uint64_t seed)
      : bench_(preset, seed, [this](int y, NibbleFrame& f) { sent(y, f); }) {
    // Only ports 0 and 1 have a cable, so that what comes in at one of them leaves at the other.
    for (int y = 2; y < bench_.ports(); ++y) bench_.slave().setLink(y, false);
    bench_.runCycles(1000);
    bench_.slave().onSample = [this](int y, Time t, Symbol s) {
      if (y == from_ && s.dv && s.data == 0xd && sampledAt_ < 0) sampledAt_ = t;
    };
  }

  // One frame per phase; the phases are spread evenly over a nibble time.
  Range measure(int from, int phases) {
    Range range;
    from_ = from;
    // The first phase lets receive and core clock rise at the same moment: the sample just misses that edge,
    // the worst case.
    const Time period = corePeriod(),
               offset = bench_.sender(from).nextSlot() + kNibble / 2 - bench_.slave().nextRise();
    bench_.sender(from).shift(2 * kNibble - ((offset % period) + period) % period);
    for (int i = 0; i < phases; ++i) {
      sampledAt_ = sfdSentAt_ = -1;
      Sender& sender = bench_.sender(from);
      if (i > 0) sender.shift(kNibble * i / phases - kNibble * (i - 1) / phases);
      sender.pushIdle(24);
      for (uint8_t n : toNibbles(nopFrame())) sender.push({true, false, n});
      const Time limit = bench_.sim().now() + 1000 * kUs;
      while (sfdSentAt_ < 0) {
        if (bench_.sim().now() > limit)
          throw UserError("the frame sent to port " + std::to_string(from) + " did not come out of port " +
                          std::to_string(1 - from) + ".");
        bench_.sim().step();
      }
      bench_.runCycles(96 *
                       bench_.slave().info().cyclesPerNibble);  // until all effects of the frame are over
      range.add(sfdSentAt_ - sampledAt_);
    }
    return range;
  }

  Time corePeriod() { return bench_.slave().corePeriod(); }

 private:
  void sent(int port, NibbleFrame& f) {
    const Payload p = payloadOf(f.nibbles);
    if (port != 1 - from_ || !p.sfd) return;
    sfdSentAt_ = f.start + p.preamble * kNibble;
  }

  int from_ = 0;
  Time sampledAt_ = -1, sfdSentAt_ = -1;
  Bench bench_;
};

ordered_json report(const Range& r, Time period) {
  return {{"worst_ns", inNs(r.worst)},
          {"best_ns", inNs(r.best)},
          {"worst_cycles", static_cast<double>((r.worst * 100 + period / 2) / period) / 100},
          {"pin_to_pin_worst_ns", inNs(r.worst + kNibble / 2)}};
}
}  // namespace

int main(int argc, char** argv) {
  CLI::App app(
      "Measures the latency of a preset, from the receive clock edge that samples the second half of the "
      "SFD\n"
      "to the core clock edge after which it is on TXD, and prints it as JSON.",
      "flyframe-latency");
  std::string preset;
  int phases = 400;
  app.add_option("--preset", preset, "preset to measure")->required();
  app.add_option("--phases", phases, "receive clock phases over one nibble time")
      ->capture_default_str()
      ->check(CLI::Range(200, 100000));
  return runProgram(app, argc, argv, [&]() -> int {
    const Preset& p = findPreset(preset);
    if (p.info.ports < 2) throw UserError("preset '" + preset + "' has one port: nothing is forwarded.");
    LatencyMeter meter(p, 0);
    const Range processing = meter.measure(0, phases), forwarding = meter.measure(1, phases);
    ordered_json out = {{"preset", preset},
                        {"core_clock_mhz", p.info.coreClockMhz},
                        {"phases", phases},
                        {"processing", report(processing, meter.corePeriod())},
                        {"forwarding", report(forwarding, meter.corePeriod())}};
    std::cout << out.dump(2) << "\n";
    return 0;
  });
}

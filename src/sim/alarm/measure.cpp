#include "alarm/measure.h"

#include <algorithm>
#include <chrono>
#include <random>
#include <stdexcept>

#include "alarm/server.h"
#include "core/esc.h"
#include "protocol.h"

namespace {
using nlohmann::ordered_json;
using namespace esc;

// Knows when a wanted event has come.
class Meter {
 public:
  Meter(AlarmNetwork& network, const AlarmOptions& options)
      : network_(network),
        line_(network.line()),
        server_(network, options),
        options_(options),
        cycleNs_(options.master.bus_cycle_us * 1000),
        random_(options.line.seed) {
    server_.onEvent = [this](const NibbleFrame& f, const ReportedEvent& e) { take(f, e); };
  }

  ordered_json run(size_t events) {
    const auto begin = std::chrono::steady_clock::now();
    waitFor(500, [this] { return isComplete(server_, line_.slaves()); });
    for (size_t i = 1; i <= line_.slaves(); ++i) line_.node(i).setAlarmCurrent(kWholeLine);
    pass(50 * cycleNs_);
    std::vector<double> first, last;
    std::vector<unsigned> state(line_.slaves() + 1, PROTOCOL_STATE_NORMAL);
    for (size_t n = 0; n < events; ++n) {
      // Longer than what follows from the event before is told: reports are one per millisecond then.
      pass(45 * cycleNs_ + static_cast<int64_t>(random_() % static_cast<uint64_t>(10 * cycleNs_)));
      const size_t slave = 1 + random_() % line_.slaves();
      state[slave] = PROTOCOL_STATE_NORMAL + PROTOCOL_STATE_ALARM - state[slave];
      wantedPosition_ = slave - 1, wantedState_ = state[slave], found_ = false;
      const double pin = static_cast<double>(line_.now()) / kUs;
      line_.node(slave).setAlarmCurrent(state[slave] == PROTOCOL_STATE_ALARM ? kAlarmCurrent : kWholeLine);
      waitFor(100, [this] { return found_; });
      first.push_back(static_cast<double>(firstNibble_) / kUs - pin);
      last.push_back(static_cast<double>(lastNibble_) / kUs - pin);
      ++measured_;
    }
    const std::chrono::duration<double> wall = std::chrono::steady_clock::now() - begin;
    return {{"slaves", line_.slaves()},
            {"bus_cycle_us", options_.master.bus_cycle_us},
            {"events", events},
            {"goal_us", 2 * options_.master.bus_cycle_us + 10},
            {"to_first_nibble_us", spread(first)},
            {"to_last_nibble_us", spread(last)},
            {"simulated_ms", static_cast<double>(line_.ns()) / 1e6},
            {"wall_s", wall.count()}};
  }

 private:
  static ordered_json spread(std::vector<double> v) {
    std::sort(v.begin(), v.end());
    auto rounded = [](double x) { return std::round(x * 100) / 100; };
    return {{"best", rounded(v.front())}, {"median", rounded(v[v.size() / 2])}, {"worst", rounded(v.back())}};
  }

  void pass(int64_t ns) {
    const int64_t end = line_.ns() + ns;
    while (line_.ns() < end) line_.advance(std::min(AlarmLine::kIdleSliceNs, end - line_.ns()));
  }
  template <class Condition>
  void waitFor(int cycles, Condition there) {
    const int64_t end = line_.ns() + cycles * cycleNs_ + 5'000'000;
    while (!there()) {
      if (line_.ns() > end)
        throw std::runtime_error("event " + std::to_string(measured_ + 1) + ", of slave " +
                                 std::to_string(wantedPosition_ + 1) + ", was not reported in " +
                                 std::to_string(cycles) + " bus cycles; " + network_.command({"status"}));
      line_.advance();
    }
  }

  void take(const NibbleFrame& f, const ReportedEvent& e) {
    if (e.kind == PROTOCOL_EVENT_DETECTOR && e.position == wantedPosition_ && e.state == wantedState_ &&
        !found_) {
      found_ = true;
      firstNibble_ = f.start, lastNibble_ = f.end;
    }
  }

  AlarmNetwork& network_;
  AlarmLine& line_;
  ReportServer server_;
  const AlarmOptions& options_;
  int64_t cycleNs_;
  std::mt19937_64 random_;
  bool found_ = false;
  size_t measured_ = 0, wantedPosition_ = 0;
  unsigned wantedState_ = 0;
  Time firstNibble_ = 0, lastNibble_ = 0;
};
}  // namespace

ordered_json measureReports(AlarmNetwork& network, const AlarmOptions& options, size_t events) {
  return Meter(network, options).run(events);
}

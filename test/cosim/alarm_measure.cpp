#include "alarm_measure.h"

#include <algorithm>
#include <chrono>
#include <random>
#include <stdexcept>

namespace {
using nlohmann::ordered_json;

constexpr size_t kUdp = 34, kPayload = 42, kReportHeader = 24, kEventBytes = 16;
constexpr int kDetectorEvent = 1, kScannedEvent = 2;

uint32_t big(const Bytes& b, size_t at, int bytes) {
  uint32_t v = 0;
  for (int i = 0; i < bytes; ++i) v = v << 8 | b[at + static_cast<size_t>(i)];
  return v;
}
void put(Bytes& b, uint32_t v, int bytes) {
  while (bytes-- > 0) b.push_back(static_cast<uint8_t>(v >> (8 * bytes)));
}

// The server as far as a measurement needs it: acknowledges each report as soon as it has come, and knows when a wanted event did.
class Meter {
 public:
  Meter(AlarmNetwork& network, const AlarmOptions& options)
      : network_(network), line_(network.line()), options_(options), cycleNs_(options.master.bus_cycle_us * 1000), random_(options.line.seed) {
    network.onFromMaster = [this](const NibbleFrame& f, const Bytes& b) { take(f, b); };
  }

  ordered_json run(size_t events) {
    const auto begin = std::chrono::steady_clock::now();
    waitFor(500, [this] { return scanned_; });
    for (size_t i = 1; i <= line_.slaves(); ++i) line_.node(i).setAlarmCurrent(1);
    pass(50 * cycleNs_);
    std::vector<double> first, last;
    std::vector<unsigned> state(line_.slaves() + 1, 1);
    for (size_t n = 0; n < events; ++n) {
      pass(3 * cycleNs_ + static_cast<int64_t>(random_() % static_cast<uint64_t>(3 * cycleNs_)));
      const size_t slave = 1 + random_() % line_.slaves();
      state[slave] = 3 - state[slave];  // normal 1, alarm 2
      wantedPosition_ = slave - 1, wantedState_ = state[slave], found_ = false;
      const double pin = static_cast<double>(line_.now()) / kUs;
      line_.node(slave).setAlarmCurrent(state[slave] == 2 ? 3 : 1);
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
        throw std::runtime_error("event " + std::to_string(measured_ + 1) + ", of slave " + std::to_string(wantedPosition_ + 1) +
                                 ", was not reported in " + std::to_string(cycles) + " bus cycles; " + network_.command({"status"}));
      line_.advance();
    }
  }

  void take(const NibbleFrame& f, const Bytes& b) {
    if (b.size() < kPayload + kReportHeader || big(b, 12, 2) != 0x0800 || b[23] != 17) return;
    if (big(b, kPayload, 2) != 0x4641 || b[kPayload + 3] != 1) return;
    const uint32_t number = big(b, kPayload + 8, 4);
    const size_t count = b[kPayload + 12];
    for (size_t i = 0; i < count; ++i) {
      if (number + i < next_) continue;
      const size_t at = kPayload + kReportHeader + i * kEventBytes;
      if (b[at] == kScannedEvent && b[at + 1] == line_.slaves()) scanned_ = true;
      if (b[at] == kDetectorEvent && b[at + 1] == wantedPosition_ && b[at + 6] == wantedState_ && !found_) {
        found_ = true;
        firstNibble_ = f.start, lastNibble_ = f.end;
      }
    }
    next_ = std::max<uint32_t>(next_, number + static_cast<uint32_t>(count));
    if (count > 0) acknowledge(b);
  }

  // To where the report came from.
  void acknowledge(const Bytes& report) {
    Bytes f(report.begin() + 6, report.begin() + 12);
    f.insert(f.end(), report.begin(), report.begin() + 6);
    put(f, 0x0800, 2);
    put(f, 0x4500, 2), put(f, 20 + 8 + 12, 2), put(f, 0, 4), put(f, 0x4011, 2), put(f, 0, 2);
    f.insert(f.end(), report.begin() + 30, report.begin() + 34);
    f.insert(f.end(), report.begin() + 26, report.begin() + 30);
    uint32_t sum = 0;
    for (size_t i = 14; i < kUdp; i += 2) sum += big(f, i, 2);
    sum = (sum & 0xffff) + (sum >> 16);
    sum = ~((sum & 0xffff) + (sum >> 16));
    f[24] = static_cast<uint8_t>(sum >> 8), f[25] = static_cast<uint8_t>(sum);
    put(f, big(report, kUdp + 2, 2), 2), put(f, big(report, kUdp, 2), 2), put(f, 8 + 12, 2), put(f, 0, 2);  // without UDP checksum
    put(f, 0x46410102, 4), put(f, big(report, kPayload + 4, 4), 4), put(f, next_, 4);
    network_.toMaster(f);
  }

  AlarmNetwork& network_;
  AlarmLine& line_;
  const AlarmOptions& options_;
  int64_t cycleNs_;
  std::mt19937_64 random_;
  bool scanned_ = false, found_ = false;
  size_t measured_ = 0, wantedPosition_ = 0;
  unsigned wantedState_ = 0;
  uint32_t next_ = 0;  // number of the next event
  Time firstNibble_ = 0, lastNibble_ = 0;
};
}  // namespace

ordered_json measureReports(AlarmNetwork& network, const AlarmOptions& options, size_t events) { return Meter(network, options).run(events); }

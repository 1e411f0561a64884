// Simulated time beside that of the wall clock.
#pragma once

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <ctime>
#include <optional>

inline double secondsSince(std::chrono::steady_clock::time_point t) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - t).count();
}

// What simulated time should be: it runs `scale` times as fast as the wall clock.
class Pacer {
 public:
  Pacer(double scale, int64_t ns) : scale_(scale), ns_(static_cast<double>(ns)) {}
  // Time not yet simulated; negative if the simulation is ahead.
  int64_t lag(int64_t ns) {
    const double due = ns_ + secondsSince(start_) * 1e9 * scale_;
    const double lag = due - static_cast<double>(ns);
    if (lag > kMaxLagNs) ns_ -= lag - kMaxLagNs;
    return static_cast<int64_t>(std::min<double>(lag, kMaxLagNs));
  }
  // Wall time until the simulation lags by `ns`, a second at most; null: never.
  std::optional<timespec> sleep(int64_t lag, int64_t ns) const {
    if (scale_ == 0) return std::nullopt;
    const double wallNs = std::clamp(static_cast<double>(ns - lag) / scale_, 0.0, 1e9);
    return timespec{static_cast<time_t>(wallNs / 1e9), static_cast<long>(std::fmod(wallNs, 1e9))};
  }

 private:
  static constexpr int64_t kMaxLagNs = 1'000'000;  // a larger lag is given up
  double scale_, ns_;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

// A small fast generator (xorshift64*), the same on every machine.
#pragma once

#include <cstdint>

namespace smsoak {

class Random {
 public:
  explicit Random(uint64_t seed) : state_(seed * 0x9e3779b97f4a7c15 + 0x1234567) {
    for (int i = 0; i < 8; ++i) next();
  }
  // 0 to n - 1.
  unsigned below(unsigned n) { return static_cast<unsigned>((next() >> 32) * n >> 32); }
  // From low to high.
  int range(int low, int high) {
    return low + static_cast<int>(below(static_cast<unsigned>(high - low + 1)));
  }
  // True once in n times.
  bool once(unsigned n) { return below(n) == 0; }
  uint8_t byte() { return static_cast<uint8_t>(next() >> 40); }

 private:
  uint64_t next() {
    state_ ^= state_ >> 12, state_ ^= state_ << 25, state_ ^= state_ >> 27;
    return state_ * 0x2545f4914f6cdd1d;
  }
  uint64_t state_;
};

}  // namespace smsoak

// What happens to nibbles between two ports: they are recorded, and now and then a bit flips.
#pragma once

#include <cmath>
#include <random>

#include "core/ethernet.h"
#include "core/simulator.h"

// Passes everything on, and gathers the frames.
class Tap : public NibbleSink {
 public:
  Tap(NibbleSink& to, std::function<void(NibbleFrame&)> onFrame) : to_(to), frames_(std::move(onFrame)) {}
  void nibble(Time launch, Symbol symbol) override {
    to_.nibble(launch, symbol);
    frames_.nibble(launch, symbol);
  }

 private:
  NibbleSink& to_;
  FrameCollector frames_;
};

// Flips one bit of `bits` in the mean, at random; none if that is 0. Preamble and FCS are hit as data are.
class Noise : public NibbleSink {
 public:
  Noise(NibbleSink& to, uint64_t bits, uint64_t seed) : to_(to), bits_(bits), random_(seed) { choose(); }
  void nibble(Time launch, Symbol symbol) override {
    if (bits_ > 0 && symbol.dv)
      for (int i = 0; i < 4; ++i)
        if (left_-- == 0) {
          symbol.data ^= 1 << i;
          ++flipped_;
          choose();
        }
    to_.nibble(launch, symbol);
  }
  uint64_t flipped() const { return flipped_; }
  void setBits(uint64_t bits) {
    bits_ = bits;
    choose();
  }

 private:
  void choose() {
    if (bits_ > 0) left_ = std::geometric_distribution<uint64_t>(1.0 / static_cast<double>(bits_))(random_);
  }
  NibbleSink& to_;
  uint64_t bits_, left_ = 0, flipped_ = 0;
  std::mt19937_64 random_;
};

// The bytes of a frame without its FCS; empty if the frame is not good. A nibble more behind a right FCS does
// no harm (OP-10).
inline Bytes goodFrame(const NibbleFrame& frame) {
  Payload p = payloadOf(frame.nibbles);
  if (!p.sfd || p.bytes.size() < 64 || crc32(p.bytes.data(), p.bytes.size()) != kCrcResidue) return {};
  p.bytes.resize(p.bytes.size() - 4);
  return p.bytes;
}

// One slave with a 25 MHz sender at each port and a collector for what it sends: the bench of the fuzz runner
// and the latency meter.
#pragma once

#include <functional>
#include <memory>
#include <random>
#include <vector>

#include "core/slave.h"

class Bench {
 public:
  using OnFrame = std::function<void(int port, NibbleFrame&)>;

  // Powers the slave up: reset, then links up and process data open, then time to settle. Phases of the
  // clocks by `seed`.
  Bench(const Preset& preset, uint64_t seed, OnFrame onFrame);

  Slave& slave() { return *slave_; }
  Simulator& sim() { return sim_; }
  Sender& sender(int port) { return *senders_[port]; }
  FrameCollector& collector(int port) { return *collectors_[port]; }
  int ports() const { return slave_->info().ports; }

  void runCycles(int64_t cycles) { sim_.runUntil(sim_.now() + cycles * slave_->corePeriod()); }
  // Nothing is waiting to be sent to the slave.
  bool allFed() const;
  // Nor is the slave sending.
  bool quiet() const;
  // Last time something was sent to the slave, or by anyone.
  Time lastFed() const;
  Time lastActive() const;

  // Host accesses; false if the slave does not acknowledge within kHangCycles.
  bool writeByte(uint16_t addr, uint8_t value);
  bool readBytes(uint16_t addr, int count, uint32_t& word);  // of one word

  static constexpr int64_t kHangCycles = 10'000;

 private:
  bool finishHost();

  VerilatedContext context_;
  Simulator sim_;
  std::unique_ptr<Slave> slave_;
  std::vector<std::unique_ptr<Sender>> senders_;
  std::vector<std::unique_ptr<FrameCollector>> collectors_;
};

// A simulated line of slaves with the master's network card at its head.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "core/network_file.h"
#include "core/slave.h"

class VerilatedFstC;

struct NetworkOptions {
  bool skipIdle = true;
  double settleUs = 4;    // the network is idle when nothing has been on any wire for so long
  uint64_t seed = 1;      // start phases of the clocks
  std::string traceFile;  // empty: no trace
};

class Network {
 public:
  // Takes each frame that comes back to the master, and the simulated time of its last nibble.
  using OnFrame = std::function<void(int64_t ns, const NibbleFrame&)>;

  // Builds the line and powers it up: reset, EEPROM contents loaded by the local hosts, links up.
  Network(const std::vector<SlaveSpec>& specs, const NetworkOptions& options, OnFrame onFrame);
  ~Network();

  // Simulated time since power-up in ns, skipped idle time included.
  int64_t ns() const { return sim_.now() / kNs + skippedNs_; }
  int64_t skippedNs() const { return skippedNs_; }
  // Sends a frame from the master's card, which must have sent() all others; the minimum gap follows it.
  // Returns the simulated time of its last nibble.
  int64_t send(const Bytes& frame);
  // The card has nothing left to send.
  bool sent() const { return master_->backlog() == 0; }
  // Nothing moves on any wire, and the last thing that did has settled.
  bool quiet() const;
  // Nor does an EEPROM: idle time may be skipped.
  bool idle() const;
  // One event; if the network is idle, jumps to `wakeNs` instead.
  void step(int64_t wakeNs);
  // For a quiet network: simulates all slaves until `ns` without receive clocks and nibbles, much faster than
  // by step(). Clocks, timers, EEPROMs and hosts go on.
  void idleUntil(int64_t ns);
  // Cuts or mends the cable before a slave.
  void setCable(size_t slave, bool whole);
  size_t size() const { return slaves_.size(); }
  Slave& slave(size_t i) { return *slaves_[i]; }
  uint64_t coreCycles() const;

 private:
  Time quietFor() const;
  void powerUp(const std::vector<SlaveSpec>& specs);
  void loadEeprom(size_t slave, const SlaveSpec& spec);
  void hostWrite(size_t slave, uint16_t addr, uint8_t value);
  void trace(const std::string& path);

  NetworkOptions options_;
  VerilatedContext context_;
  Simulator sim_;
  std::vector<std::unique_ptr<Slave>> slaves_;
  std::unique_ptr<Sender> master_;
  std::unique_ptr<FrameCollector> card_;
  bool cardCut_ = false;
  std::unique_ptr<VerilatedFstC> trace_;
  Time settle_ = 0, quietAfter_ = 0;
  int64_t skippedNs_ = 0, tracedPs_ = -1;
};

// A master that brings all slaves to OP, keeps them there whatever the cables do, and knows what must come
// back.
#pragma once

#include <random>
#include <string>
#include <vector>

#include "core/esc.h"
#include "faults/bus.h"

namespace faults {

class Master {
 public:
  Master(Bus& bus, uint64_t seed);

  // One cycle: process data of all slaves, and something else at random.
  void cycle(int64_t afterNs = 0, const Bus::Within& within = nullptr);
  // The last cycle came back with all working counters, and all slaves were in OP.
  bool healthy() const { return complete_ && operational_; }
  // The last cycle reached all slaves.
  bool complete() const { return complete_; }
  // A register of each slave; nothing if one does not answer.
  std::optional<std::vector<Bytes>> readAll(unsigned ado, size_t bytes);
  // Until all slaves have taken it; false if one never does.
  bool writeAll(unsigned ado, const Bytes& data);

  uint64_t cycles() const { return cycles_; }
  uint64_t completeCycles() const { return completeCycles_; }
  uint64_t recoveries() const { return recoveries_; }
  // What is wrong; empty if nothing is.
  std::string violation() const { return bus_.violation().empty() ? violation_ : bus_.violation(); }

 private:
  struct Station {
    uint32_t outputs, inputs;             // offsets in the process data
    size_t size;                          // of both
    uint64_t shown = 0;                   // the cycle whose outputs its inputs showed last; 0: none yet
    std::vector<uint32_t> scratch = {0};  // what its scratch register may hold
    bool inOp = false;
  };
  using Answer = std::optional<std::vector<Datagram>>;

  void setUp();
  Bytes outputsOf(size_t slave, uint64_t cycle) const;
  void inputsCame(size_t slave, const Bytes& data);
  // Datagrams that bring a slave one step nearer to OP.
  void lookAt(size_t slave);
  void scratch(std::vector<Datagram>& frame, size_t slave, uint32_t written);
  void scratchCame(const Datagram& read, size_t slave, bool wrote, uint32_t written, bool lost);
  void fail(const std::string& what);

  Bus& bus_;
  std::mt19937_64 random_;
  std::vector<Station> stations_;
  Bytes types_;  // what a broadcast read of the type gives
  size_t bytes_ = 0, next_ = 0;
  uint64_t cycles_ = 0, completeCycles_ = 0, recoveries_ = 0;
  uint64_t healthyCycles_ = 0;  // one after the other
  bool complete_ = false, operational_ = false;
  std::string violation_;
};

}  // namespace faults

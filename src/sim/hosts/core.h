// The Verilated core in picoseconds: its clock, port 0, and whatever a host does at its pins, at any time.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <stdexcept>
#include <vector>

#include "core/model.h"

namespace hosts {

// The controller does not answer, or a test finds something wrong: the run ends.
struct Wrong : std::runtime_error {
  using std::runtime_error::runtime_error;
};

using Time = uint64_t;  // ps

class Core {
 public:
  explicit Core(const Preset& preset);

  const PresetInfo& info() const { return preset_.info; }
  int parameter(const std::string& name) const { return preset_.info.parameters.at(name); }
  Pins& pins() { return pins_; }
  WidePin& pin(const std::string& name);
  Time now() const { return now_; }
  Time period() const { return period_; }
  uint64_t cycles() const { return cycles_; }

  // Pins have changed: what follows them without a clock follows.
  void settle() { model_->eval(); }
  // Time passes; pins that have changed do so before that. Not across an edge of both clocks at once.
  void wait(Time time);
  // To the next rising edge: what is at the pins before it can be read; and the edge itself.
  void toEdge();
  void edge();
  void cycle(int count = 1);

  // Symbols to port 0, from the preamble on; what has come back between SFD and the end.
  void send(std::vector<uint8_t> nibbles);
  bool sending() const { return at_ < symbols_.size(); }
  bool returned() const { return ended_; }
  const std::vector<uint8_t>& nibbles() const { return received_; }
  // Called behind each rising edge: the master of the bus.
  std::function<void()> atCycle;

 private:
  void receive();
  void transmit();

  const Preset& preset_;
  VerilatedContext context_;
  std::unique_ptr<Model> model_;
  Pins& pins_;
  const Time period_;
  Time now_ = 0, next_;
  uint64_t cycles_ = 0;
  bool low_ = true;
  std::vector<uint8_t> symbols_, received_;
  size_t at_ = 0;
  int phase_ = 0;
  bool sfd_ = false, ended_ = false;
};

}  // namespace hosts

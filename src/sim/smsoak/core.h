// The Verilated core, core cycle by core cycle: port 0 and the host port, both at work at the same time.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "core/model.h"

namespace smsoak {

struct Nibble {
  uint8_t data;
  bool error;
};

struct Returned {
  std::vector<uint8_t> nibbles;  // behind the SFD
  std::vector<uint64_t> times;   // the core cycle in which each came
  bool sfd = false, ended = false;
};

class Core {
 public:
  explicit Core(const Preset& preset);

  void cycle();
  uint64_t now() const { return now_; }
  int lanes() const { return preset_.info.lanes(); }
  int perNibble() const { return perNibble_; }

  // A frame from the SFD's preamble on. What comes back replaces `returned`.
  void send(std::vector<Nibble> symbols);
  bool sending() const { return at_ < symbols_.size(); }
  const Returned& returned() const { return returned_; }
  // The receive clock stops for some core cycles: another phase between the clocks.
  void slip(int cycles) { slip_ += cycles; }

  // The host port; `be` and data in their lanes.
  void access(bool write, unsigned address, uint32_t data, unsigned be);
  bool free() const { return state_ == Port::idle; }
  bool done() const { return done_; }  // the access ended in this cycle
  uint32_t data() const { return data_; }
  bool irq() const { return *pins_.irq; }

 private:
  enum class Port { idle, requested, recover };
  void receive();
  void transmit();

  const Preset& preset_;
  VerilatedContext context_;
  std::unique_ptr<Model> model_;
  Pins& pins_;
  uint64_t now_ = 0;
  std::vector<Nibble> symbols_;
  size_t at_ = 0;
  int phase_ = 0, slip_ = 0, perNibble_;
  Returned returned_;
  Port state_ = Port::idle;
  bool done_ = false;
  uint32_t data_ = 0;
};

}  // namespace smsoak

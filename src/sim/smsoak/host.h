// The local processor: accesses to the areas and registers of SyncManagers at random moments.
#pragma once

#include <array>
#include <deque>

#include "smsoak/core.h"
#include "smsoak/history.h"
#include "smsoak/slots.h"

namespace smsoak {

class Host {
 public:
  Host(Core& core, Slots& slots, Random& random) : core_(core), slots_(slots), random_(random) {}

  // Called after each core cycle. `frameEnd`: when the frame on its way will end, 0 if there is none.
  void cycle(uint64_t frameEnd);
  // No access is under way that began up to that cycle.
  bool settled(uint64_t cycle) const { return !busy_ || from_ > cycle; }
  // What it has begun with a SyncManager is forgotten.
  void drop(unsigned slot) { todo_[slot].clear(); }
  // What it has done since this was asked last.
  History takeHistory() { return std::exchange(history_, {}); }
  uint64_t steps() const { return steps_; }
  const std::string& violation() const { return violation_; }

 private:
  struct Byte {
    bool write;
    unsigned address;
    uint8_t value;
    bool session;  // belongs to an orderly use of the buffer
  };
  void plan(unsigned n);
  void planOrderly(unsigned n);
  void planSession(unsigned n);
  void planWild(unsigned n);
  void begin();
  void end();
  void result(const Byte& byte, uint8_t value);
  void add(unsigned n, bool write, unsigned address, bool session = false) {
    todo_[n].push_back({write, address, random_.byte(), session});
  }

  Core& core_;
  Slots& slots_;
  Random& random_;
  std::array<std::deque<Byte>, kSms> todo_;
  unsigned slot_ = 0;                // the one it is busy with
  std::vector<Byte> access_;         // the bytes of the access under way
  std::array<bool, kSms> denied_{};  // the session there
  bool busy_ = false;
  uint64_t from_ = 0, wakeAt_ = 0, steps_ = 0;
  History history_;
  std::string violation_;
};

}  // namespace smsoak

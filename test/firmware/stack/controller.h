// A slave controller for the stack's tests, written from the rules of the controller (AL, SM, IRQ, WD), and a
// master at its other side. It shares nothing with the stack but addresses.
#pragma once

#include <vector>

#include "../fake.h"

using Bytes = std::vector<uint8_t>;

class Controller : public board {
 public:
  static constexpr int kSyncManagers = 8;
  // Whether those that are made from now on are acknowledged by write (SM-36).
  static inline bool newByWrite = false;
  Controller() { memory[0x014e] = byWrite_; }

  // ---- the host's side ----
  uint8_t readByte(uint16_t a) override;
  void writeByte(uint16_t a, uint8_t value) override;

  // ---- the master's side: one good frame each; the working counter ----
  void control(uint16_t value);               // AL control
  unsigned status() { return word(0x0130); }  // AL status
  unsigned code() { return word(0x0134); }    // AL status code
  void setSyncManager(int n, uint16_t start, uint16_t length, uint8_t control, bool on = true);
  void setActivate(int n, uint8_t value);
  bool full(int n) const { return sm_[n].full; }
  bool write(int n, const Bytes& data);  // a whole buffer, or mailbox
  bool read(int n, Bytes& data);         // the same
  bool repeatAcknowledged(int n);
  void expireWatchdog() { watchdogRuns_ = false, events_ |= 0x40; }
  void setSync0(bool active, uint32_t cycleNs);
  void sync0() { events_ |= 0x04; }

  uint32_t events() const { return events_; }
  bool interrupts() { return events_ & (word(0x0204) | word(0x0206) << 16); }
  // A frame is in the processing unit for so many of the host's next accesses (B-59).
  unsigned frame = 0;
  unsigned accesses = 0;  // of the host
  // Happens once, before the host's next access but so many.
  void before(unsigned more, std::function<void()> act) { at_ = accesses + more + 1, act_ = std::move(act); }
  bool hasHappened() const { return !act_; }
  bool out = false;  // the host has accessed what is no register and no buffer of a SyncManager

 private:
  struct Manager {
    bool full = false, open = false, written = false;
    Bytes work, next;
  };
  uint16_t start(int n) { return static_cast<uint16_t>(word(0x0800 + 8 * n)); }
  uint16_t length(int n) { return static_cast<uint16_t>(word(0x0802 + 8 * n)); }
  bool mailbox(int n) { return (memory[0x0804 + 8 * n] & 3) == 2; }
  bool masterWrites(int n) { return (memory[0x0804 + 8 * n] >> 2 & 3) == 1; }
  bool active(int n) { return memory[0x0806 + 8 * n] & 1 && !isOff_[n] && length(n) > 0; }
  void settle();
  void act();
  void reset(int n);
  int managerAt(uint16_t a);
  uint8_t readBuffer(int n, uint16_t at);
  void writeBuffer(int n, uint16_t at, uint8_t value);

  void acknowledge(uint16_t a);
  const bool byWrite_ = newByWrite;
  unsigned at_ = 0;
  std::function<void()> act_;
  uint32_t events_ = 0;
  uint16_t changed_ = 0;  // SyncManagers whose activation was written
  bool watchdogRuns_ = false;
  bool isOff_[kSyncManagers] = {};  // the host's switch, as it acts and reads back
  Manager sm_[kSyncManagers];
};

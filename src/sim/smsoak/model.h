// What SyncManagers do, written from docs/rules (SM-01 to SM-28, B-50 to B-60), rule by rule; a plain value
// that can be copied and compared. It knows nothing of time: accesses come one after the other.
#pragma once

#include <cstdint>
#include <string>

#include "core/esc.h"

namespace smsoak {

constexpr int kSms = 8;
constexpr unsigned kRamStart = esc::reg::kRam, kRamSize = 0x400;  // the memory the areas lie in
constexpr unsigned kSmRegisters = esc::reg::kSyncManagers, kAlEvents = esc::reg::kAlEvents;

enum class Side : uint8_t { ecat, pdi };

struct SyncManager {
  // Registers.
  uint16_t start, length;
  uint8_t control;
  bool enable, repeatRequest, repeatAcknowledge, deactivate, deactivated;
  bool changed;        // +6 since the host read it (B-60)
  bool enabledBefore;  // as it was when the frame began (B-40)
  // State (SM-12, SM-19): numbers of the three buffers.
  uint8_t writer, next, reader, last;
  bool newer, full, ecatOpen, pdiOpen, writeEvent, readEvent;
  // What the frame has done so far (B-57).
  bool touched, begun, closed;

  bool mailbox() const { return control & 2; }
  Side writingSide() const { return control & 4 ? Side::ecat : Side::pdi; }
  bool works() const { return enable && !deactivated && length > 0; }
  bool locked() const { return enable && deactivated && length > 0; }
  bool covers(unsigned a) const {
    const unsigned n = locked() && !mailbox() ? 3 : 1;
    return (works() || locked()) && a >= start && a < start + n * length;
  }
  bool ecatEvent() const {
    return (control & 0x10) && (writingSide() == Side::ecat ? readEvent : writeEvent);
  }
  bool alEvent() const { return (control & 0x20) && (writingSide() == Side::ecat ? writeEvent : readEvent); }
  uint8_t status() const;

  void reset();  // of the state, not the registers
  void begin(bool write);
  void complete(bool write);
};

struct World {
  SyncManager sm[kSms];
  uint8_t ram[kRamSize];
  bool quiet;              // no frame in the processing unit (B-59)
  bool anyRead, anyWrite;  // of this datagram

  World();
  // An access to memory: where the byte lies (index of ram), or -1 if it is denied.
  int access(Side side, bool write, unsigned address);
  uint8_t readRegister(Side side, unsigned address);
  // True if the byte may be written.
  bool mayWriteRegister(Side side, unsigned address) const;
  void writeRegister(Side side, unsigned address, uint8_t value);
  // Bit n of SyncManager n.
  unsigned ecatEvents() const;
  unsigned alEvents() const;
  bool activationEvent() const;

  void frameStarts();
  void frameEnds(bool good);
  void becomesQuiet();

  bool operator==(const World& other) const;
};

// Which SyncManager's register this is.
inline int managerOf(unsigned address) { return (address - kSmRegisters) / 8; }
inline bool isSmRegister(unsigned address) {
  return address >= kSmRegisters && address < kSmRegisters + 8 * kSms;
}

}  // namespace smsoak

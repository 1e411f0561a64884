#include "controller.h"

#include <utility>

void Controller::reset(int n) {
  sm_[n] = {};
  events_ &= ~(0x100u << n);
}

// The SyncManager that acts on an address of the process data RAM; -1: none.
int Controller::managerAt(uint16_t a) {
  for (int n = 0; n < kSyncManagers; ++n)
    if (active(n) && a >= start(n) && a < start(n) + length(n)) return n;
  return -1;
}

// SM-01 to SM-03, SM-13, SM-19: opened by the first byte, closed by the last.
uint8_t Controller::readBuffer(int n, uint16_t at) {
  Manager& m = sm_[n];
  if (!masterWrites(n)) return 0;
  if (at == 0) {
    const bool wasOpen = m.open;
    if (!byWrite_ || !wasOpen) events_ &= ~(0x100u << n);  // B-104: else it is of what is newer
    if (mailbox(n) ? m.full : m.written) {
      m.open = true;
      if (!mailbox(n) && !wasOpen) m.work = m.next;  // an open buffer takes nothing newer
    }
  }
  if (!m.open) return 0;
  const uint8_t value = m.work.at(at);
  if (at == length(n) - 1 && !byWrite_) m.open = false, m.full = false;
  return value;
}

void Controller::writeBuffer(int n, uint16_t at, uint8_t value) {
  Manager& m = sm_[n];
  if (masterWrites(n)) {
    if (byWrite_ && m.open && at == length(n) - 1) m.open = false, m.full = false;
    return;
  }
  if (at == 0) {
    events_ &= ~(0x100u << n);
    if (!mailbox(n) || !m.full) m.open = true, m.work.assign(length(n), 0);
  }
  if (!m.open) return;
  m.work.at(at) = value;
  if (at < length(n) - 1) return;
  m.open = false;
  if (mailbox(n)) m.full = true;
  else m.next = m.work, m.written = true;
}

// B-59: what the host has written to +7[0] acts when no frame is in the processing unit.
void Controller::settle() {
  if (++accesses == at_ && act_) std::exchange(act_, nullptr)();
  if (frame > 0) --frame;
  else act();
}
void Controller::act() {
  for (int n = 0; n < kSyncManagers; ++n) {
    const bool wanted = memory[0x0807 + 8 * n] & 1;
    if (wanted && !isOff_[n]) reset(n);
    isOff_[n] = wanted;
  }
}

// What an access to this register ends: a read, or a write where it is acknowledged by write, where 0x0806 is
// for all SyncManagers.
void Controller::acknowledge(uint16_t a) {
  if (a == 0x0120 || a == 0x0121) events_ &= ~1u;
  if (a == 0x098e) events_ &= ~4u;
  if (a == 0x0440 || a == 0x0441) events_ &= ~0x40u;
  if (a < 0x0800 || a >= 0x0800 + 8 * kSyncManagers || a % 8 != 6) return;
  if (byWrite_) changed_ = a == 0x0806 ? 0 : changed_;
  else changed_ &= static_cast<uint16_t>(~(1u << (a - 0x0800) / 8));
  if (!changed_) events_ &= ~0x10u;
}

uint8_t Controller::readByte(uint16_t a) {
  settle();
  if (a >= 0x1000) {
    const int n = managerAt(a);
    if (n < 0) out = true;
    return n < 0 ? 0 : readBuffer(n, static_cast<uint16_t>(a - start(n)));
  }
  if (a >= 0x0220 && a <= 0x0223) return static_cast<uint8_t>(events_ >> 8 * (a - 0x0220));
  if (!byWrite_) acknowledge(a);
  if (a == 0x0440) return watchdogRuns_;
  if (a >= 0x0800 && a < 0x0800 + 8 * kSyncManagers) {
    const int n = (a - 0x0800) / 8;
    if (a % 8 == 5)
      return static_cast<uint8_t>((sm_[n].full && mailbox(n) ? 8 : 0) | (sm_[n].written ? 0 : 0x30));
    if (a % 8 == 7) return static_cast<uint8_t>((memory.at(a) & ~1) | isOff_[n]);
  }
  return memory.at(a);
}

void Controller::writeByte(uint16_t a, uint8_t value) {
  settle();
  if (a >= 0x1000) {
    const int n = managerAt(a);
    if (n < 0) out = true;
    else writeBuffer(n, static_cast<uint16_t>(a - start(n)), value);
    return;
  }
  if (byWrite_ && (a == 0x0120 || a == 0x0440 || a == 0x098e || a == 0x0806)) {
    acknowledge(a);
    return;
  }
  const bool pdiControl = a >= 0x0800 && a < 0x0800 + 8 * kSyncManagers && a % 8 == 7;
  const bool allowed =
      pdiControl || (a >= 0x0130 && a <= 0x0135) || (a >= 0x0204 && a <= 0x0207) || a == 0x0012;
  if (!allowed) {
    out = true;
    return;
  }

  memory.at(a) = value;
  if (pdiControl && frame == 0) act();
}

void Controller::control(uint16_t value) {
  if (events_ & 1) return;  // AL-04
  setWord(0x0120, value);
  events_ |= 1;
}

void Controller::setActivate(int n, uint8_t value) {
  const auto at = static_cast<uint16_t>(0x0806 + 8 * n);
  if ((memory[at] ^ value) & 1) reset(n);
  if (!((memory[at] ^ value) & 3)) return;  // B-60
  memory[at] = value;
  changed_ |= static_cast<uint16_t>(1u << n);
  events_ |= 0x10;
}

// Settings can be written while it is off.
void Controller::setSyncManager(int n, uint16_t at, uint16_t bytes, uint8_t control, bool on) {
  setActivate(n, 0);
  setWord(static_cast<uint16_t>(0x0800 + 8 * n), at);
  setWord(static_cast<uint16_t>(0x0802 + 8 * n), bytes);
  memory[0x0804 + 8 * n] = control;
  setActivate(n, on);
}

bool Controller::write(int n, const Bytes& data) {
  Manager& m = sm_[n];
  if (!active(n) || !masterWrites(n) || data.size() != length(n) || (mailbox(n) && m.full)) return false;
  if (mailbox(n)) m.work = data, m.full = true;
  else m.next = data, m.written = true;
  if (memory[0x0804 + 8 * n] & 0x20) events_ |= 0x100u << n;
  if (memory[0x0804 + 8 * n] & 0x40) watchdogRuns_ = true;
  return true;
}

bool Controller::read(int n, Bytes& data) {
  Manager& m = sm_[n];
  if (!active(n) || masterWrites(n) || (mailbox(n) ? !m.full : !m.written)) return false;
  data = mailbox(n) ? m.work : m.next;
  m.full = false;
  if (memory[0x0804 + 8 * n] & 0x20) events_ |= 0x100u << n;
  return true;
}

bool Controller::repeatAcknowledged(int n) {
  return !((memory[0x0806 + 8 * n] ^ memory[0x0807 + 8 * n]) & 2);
}

void Controller::setSync0(bool active, uint32_t cycleNs) {
  memory[0x0981] = active ? 3 : 0, memory[0x0151] = 8;
  setWord(0x09a0, cycleNs & 0xffff), setWord(0x09a2, cycleNs >> 16);
}

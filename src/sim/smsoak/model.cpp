#include "smsoak/model.h"

#include <cstring>
#include <utility>

namespace smsoak {

uint8_t SyncManager::status() const {
  return static_cast<uint8_t>(writeEvent | readEvent << 1 | (mailbox() && full) << 3 |
                              (mailbox() ? 0 : last) << 4);
}

// B-50.
void SyncManager::reset() {
  writer = 0, next = 1, reader = 2, last = 3;
  newer = full = ecatOpen = pdiOpen = writeEvent = readEvent = touched = begun = closed = false;
}

// The first byte: ends the event of the other side.
void SyncManager::begin(bool write) { (write ? readEvent : writeEvent) = false; }

// The last byte, finally: SM-13, SM-19, SM-21; B-53 for length 1.
void SyncManager::complete(bool write) {
  (write ? writeEvent : readEvent) = true;
  if (length == 1) return;
  if (mailbox()) {
    full = write;
  } else if (write) {
    last = writer;
    std::swap(writer, next);
    newer = true;
  }
}

World::World() {
  std::memset(static_cast<void*>(this), 0, sizeof *this);
  quiet = true;
  for (SyncManager& s : sm) s.reset();
}

bool World::operator==(const World& other) const { return std::memcmp(this, &other, sizeof *this) == 0; }

int World::access(Side side, bool write, unsigned a) {
  const int index = static_cast<int>(a - kRamStart);
  SyncManager* s = nullptr;
  for (int n = kSms - 1; n >= 0; --n)
    if (sm[n].covers(a)) s = &sm[n];  // B-51: the lowest number
  if (!s) return index;
  if (!s->works()) return -1;  // SM-27
  const bool right = write == (side == s->writingSide());
  const bool single = s->length == 1;
  const bool first = a == s->start, last = a == s->start + s->length - 1u;
  int place = index;
  if (!single) {
    if (!right) return -1;                           // B-54
    if (side == Side::ecat && s->closed) return -1;  // SM-04
    bool& open = side == Side::ecat ? s->ecatOpen : s->pdiOpen;
    if (!open) {
      const bool may = s->mailbox() ? write != s->full : write || s->last != 3;  // SM-16, SM-18, SM-19
      if (!first || !may) return -1;                                             // SM-01
      open = true;
      if (!write && s->newer) std::swap(s->reader, s->next), s->newer = false;  // SM-13
    }
    if (!s->mailbox()) place += (write ? s->writer : s->reader) * s->length;
    if (side == Side::pdi && last) open = false;
  }
  if (!right) return place;
  if (side == Side::ecat) {  // final at the end of the frame
    s->touched = true;
    s->begun |= first;
    s->closed |= last;
  } else {
    if (first) s->begin(write);
    if (last) s->complete(write);
  }
  return place;
}

void World::frameStarts() {
  quiet = false;
  for (SyncManager& s : sm) s.enabledBefore = s.enable;
}

// SM-05, SM-07, SM-20, B-57.
void World::frameEnds(bool good) {
  for (SyncManager& s : sm) {
    const bool write = s.writingSide() == Side::ecat;
    if (good && s.begun) s.begin(write);
    if (good && s.closed) s.ecatOpen = false, s.complete(write);
    if (!good && s.touched) s.ecatOpen = false;
    s.touched = s.begun = s.closed = false;
  }
}

// B-59.
void World::becomesQuiet() {
  quiet = true;
  for (SyncManager& s : sm) {
    const bool worked = s.works();
    s.deactivated = s.deactivate;
    if (s.works() != worked) s.reset();
  }
}

uint8_t World::readRegister(Side side, unsigned a) {
  SyncManager& s = sm[managerOf(a)];
  switch (a % 8) {
    case 0: return static_cast<uint8_t>(s.start);
    case 1: return static_cast<uint8_t>(s.start >> 8);
    case 2: return static_cast<uint8_t>(s.length);
    case 3: return static_cast<uint8_t>(s.length >> 8);
    case 4: return s.control;
    case 5: return s.status();
    case 6:
      if (side == Side::pdi) s.changed = false;
      return static_cast<uint8_t>(s.enable | s.repeatRequest << 1);
    default: return static_cast<uint8_t>(s.deactivated | s.repeatAcknowledge << 1);
  }
}

bool World::mayWriteRegister(Side side, unsigned a) const {
  if (side == Side::pdi) return a % 8 == 7;
  return a % 8 == 6 || (a % 8 < 5 && !sm[managerOf(a)].enabledBefore);
}

void World::writeRegister(Side side, unsigned a, uint8_t v) {
  if (!mayWriteRegister(side, a)) return;
  SyncManager& s = sm[managerOf(a)];
  const bool worked = s.works();
  switch (a % 8) {
    case 0: s.start = static_cast<uint16_t>((s.start & 0xff00) | v); break;
    case 1: s.start = static_cast<uint16_t>((s.start & 0xff) | v << 8); break;
    case 2: s.length = static_cast<uint16_t>((s.length & 0xff00) | v); break;
    case 3: s.length = static_cast<uint16_t>((s.length & 0xff) | v << 8); break;
    case 4: s.control = v; break;
    case 6:
      s.changed |= s.enable != (v & 1) || s.repeatRequest != (v >> 1 & 1);
      s.enable = v & 1, s.repeatRequest = v >> 1 & 1;
      break;
    case 7:
      s.deactivate = v & 1, s.repeatAcknowledge = v >> 1 & 1;
      if (quiet) s.deactivated = s.deactivate;
      break;
  }
  if (s.works() != worked) s.reset();
}

unsigned World::ecatEvents() const {
  unsigned bits = 0;
  for (int n = 0; n < kSms; ++n) bits |= sm[n].ecatEvent() << n;
  return bits;
}
unsigned World::alEvents() const {
  unsigned bits = 0;
  for (int n = 0; n < kSms; ++n) bits |= sm[n].alEvent() << n;
  return bits;
}
bool World::activationEvent() const {
  for (const SyncManager& s : sm)
    if (s.changed) return true;
  return false;
}

}  // namespace smsoak

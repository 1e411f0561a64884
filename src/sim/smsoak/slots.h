// The SyncManagers as master and host know them, and where their areas lie.
#pragma once

#include <array>
#include <utility>

#include "smsoak/model.h"
#include "smsoak/random.h"
#include "smsoak/stamps.h"

namespace smsoak {

struct Slot {
  unsigned start = kRamStart, length = 0, room = 0;  // room: bytes from the start that belong to it
  uint8_t control = 0;
  // Both sides keep to the rules (whole buffers, no stray access to the end), and Stamps looks on.
  bool orderly = false;
  // Being switched off, and on again; the host leaves an orderly one alone meanwhile.
  enum class Change { none, off, on } change = Change::none;
  bool held() const { return change != Change::none; }
  Stamps stamps;

  bool mailbox() const { return control & 2; }
  bool ecatWrites() const { return control & 4; }
  unsigned end() const { return start + length - 1; }
};

class Slots {
 public:
  bool moving = false;  // an address may be in an old and a new room

  Slot& operator[](unsigned n) { return slots_[n]; }
  const Slot& operator[](unsigned n) const { return slots_[n]; }

  // New places for all, one behind the other with gaps of 0 to 3 bytes.
  void place(Random& random) {
    unsigned at = kRamStart + random.below(4);
    for (Slot& s : slots_) {
      static const unsigned most[] = {3, 8, 16, 40};
      const unsigned length = random.range(1, most[random.below(4)]);
      s.start = at;
      s.room = random.once(2) ? length : 3 * length;
      configure(s, random);
      at += s.room + (random.once(2) ? random.below(4) : 0);
    }
  }
  // Another mode, direction and length within its room.
  void configure(Slot& s, Random& random) {
    const bool mailbox = s.room % 3 != 0 || random.once(2);
    s.length = random.once(3) ? random.range(1, mailbox ? s.room : s.room / 3)
               : mailbox      ? s.room
                              : s.room / 3;
    if (s.length > 40) s.length = 40;
    s.control = static_cast<uint8_t>((mailbox ? 2 : 0) | random.below(2) << 2 | random.below(4) << 4 |
                                     random.byte() << 6);
    if (!random.once(4)) s.control |= 0x30;
    s.orderly = s.length > 1 && random.once(2);
  }
  // Whose room an address lies in, a bit each; bit 8: nobody's.
  unsigned managersAt(unsigned address) const {
    if (moving) return 0x1ff;
    for (unsigned n = 0; n < kSms; ++n)
      if (address >= slots_[n].start && address < slots_[n].start + slots_[n].room) return 1u << n;
    return 0x100;
  }

 private:
  std::array<Slot, kSms> slots_;
};

}  // namespace smsoak

#include "smsoak/host.h"

namespace smsoak {

namespace {}

void Host::cycle(uint64_t frameEnd) {
  if (busy_ && core_.done()) end();
  if (busy_ || !core_.free() || core_.now() < wakeAt_) return;
  // Now and then exactly around the end of the frame.
  if (frameEnd > core_.now() && frameEnd < core_.now() + 400 && random_.once(40)) {
    const uint64_t at = frameEnd + random_.range(-40, 20);
    if (at > core_.now()) {
      wakeAt_ = at;
      return;
    }
  }
  begin();
}

void Host::begin() {
  if (random_.once(6)) slot_ = random_.below(kSms);
  while (todo_[slot_].empty()) plan(slot_);
  std::deque<Byte>& todo = todo_[slot_];
  // As many bytes as stand in one word, in ascending order.
  access_.clear();
  const unsigned width = core_.lanes(), word = todo.front().address / width;
  uint32_t data = 0;
  unsigned be = 0;
  do {
    const Byte& b = todo.front();
    be |= 1u << b.address % width;
    data |= uint32_t{b.value} << 8 * (b.address % width);
    access_.push_back(b);
    todo.pop_front();
  } while (!todo.empty() && todo.front().address / width == word &&
           todo.front().address > access_.back().address && todo.front().write == access_[0].write &&
           !random_.once(4));
  core_.access(access_[0].write, access_[0].address, data, be);
  busy_ = true;
  from_ = core_.now();
  ++steps_;
}

void Host::end() {
  busy_ = false;
  const uint64_t to = core_.now();
  for (const Byte& b : access_) {
    const unsigned lane = b.address % core_.lanes();
    const auto value = static_cast<uint8_t>(core_.data() >> 8 * lane);
    const bool events = b.address >= kAlEvents && b.address < kAlEvents + 4;
    const unsigned managers = events                    ? 0xff
                              : isSmRegister(b.address) ? 1u << managerOf(b.address)
                                                        : slots_.managersAt(b.address);
    // The bytes of a word come one after the other; each is searched among 8 SyncManagers, one a cycle.
    const bool searched = b.address >= kRamStart;
    const uint64_t before = searched ? 8 * (&b - access_.data()) : 0,
                   behind = searched ? 8 * (access_.size() - 1) - before : 0;
    history_.push_back({b.write ? Action::Kind::hostWrite : Action::Kind::hostRead, from_ + before,
                        to - behind, static_cast<uint16_t>(b.address), b.value, b.write ? -1 : value,
                        managers, steps_});
    result(b, value);
  }
  // The pin follows the events at once, a register write only some cycles later.
  if (random_.once(4) && !(access_[0].write && isSmRegister(access_[0].address)))
    history_.push_back({Action::Kind::interrupt, to, to, 0, 0, core_.irq(), 0xff, steps_});
  // Mostly one access after the other.
  wakeAt_ = core_.now() + (random_.once(3) ? random_.below(12) : random_.once(50) ? random_.below(500) : 0);
}

// What an orderly host makes of it.
void Host::result(const Byte& b, uint8_t value) {
  const unsigned n = slot_;
  Slot& s = slots_[n];
  if (!s.orderly || s.held() || !violation_.empty()) return;
  std::string wrong;
  if (b.address == kSmRegisters + 8 * n + 5 && s.mailbox() && todo_[n].empty()) {
    // Mailbox: goes on if there is something to do; a reader sometimes does without asking.
    const bool full = value & 8;
    if (s.ecatWrites() ? full || random_.once(8) : !full) planSession(n);
  } else if (b.session && b.write) {
    if (b.address == s.end()) s.stamps.complete(core_.now());
  } else if (b.session) {
    const unsigned offset = b.address - s.start;
    if (offset == 0) denied_[n] = value == 0;
    if (denied_[n]) todo_[n].clear();  // nothing to read
    else wrong = s.stamps.read(offset, value, from_);
    if (!denied_[n] && wrong.empty() && b.address == s.end()) wrong = s.stamps.close();
  }
  if (!wrong.empty())
    violation_ = "host, SyncManager " + std::to_string(n) + ", control " + std::to_string(s.control) +
                 ", length " + std::to_string(s.length) + ": " + wrong;
}

void Host::plan(unsigned n) {
  Slot& s = slots_[n];
  // Registers of all sorts.
  if (random_.once(6)) {
    static const unsigned offsets[] = {5, 5, 6, 7, 0, 2, 4};
    if (random_.once(3)) add(n, false, kAlEvents + random_.below(2));
    else add(n, false, kSmRegisters + 8 * n + offsets[random_.below(7)]);
    return;
  }
  // While all areas move it only looks: what a write has met there would be uncertain in too many ways.
  if (slots_.moving) add(n, false, s.start + random_.below(s.room));
  else if (s.orderly) planOrderly(n);
  else planWild(n);
}

void Host::planOrderly(unsigned n) {
  Slot& s = slots_[n];
  if (s.held() || s.mailbox()) add(n, false, kSmRegisters + 8 * n + 5);
  else planSession(n);
}

// A whole buffer, some bytes twice.
void Host::planSession(unsigned n) {
  Slot& s = slots_[n];
  const bool write = !s.ecatWrites();
  const uint8_t stamp = write ? s.stamps.begin() : 0;
  if (!write) s.stamps.drop();
  for (unsigned k = 0; k < s.length; ++k) {
    todo_[n].push_back({write, s.start + k, stamp, true});
    if (k + 1 < s.length && k > 0 && random_.once(16))
      todo_[n].push_back({write, s.start + random_.range(1, k), stamp, true});
  }
}

void Host::planWild(unsigned n) {
  Slot& s = slots_[n];
  const bool write = random_.once(16) ? s.ecatWrites() : !s.ecatWrites();
  switch (random_.below(9)) {
    case 0:
    case 1:
    case 2:  // whole
      for (unsigned k = 0; k < s.length; ++k) add(n, write, s.start + k);
      break;
    case 3:  // the ends only
      add(n, write, s.start);
      if (s.length > 1) add(n, write, s.end());
      break;
    case 4: add(n, write, s.start); break;
    case 5: add(n, write, s.end()); break;
    case 6:  // some byte
      add(n, write, s.start + random_.below(s.length));
      break;
    case 7:  // any byte of its room, both directions
      add(n, random_.once(2), s.start + random_.below(s.room));
      break;
    default:  // switched off and on, repeat acknowledged
      todo_[n].push_back({true, kSmRegisters + 8 * n + 7,
                          static_cast<uint8_t>(random_.once(4) | random_.below(2) << 1), false});
  }
}

}  // namespace smsoak

#include "smsoak/master.h"
#include "protocol.h"

#include <algorithm>
#include <cstdlib>

namespace smsoak {

namespace {
namespace reg = esc::reg;

constexpr uint32_t kWindow0 = 0x10000, kWindow1 = 0x20000;  // logical: as the memory; writing shifted
constexpr unsigned kFramesPerMove = 400;
constexpr size_t kMostDatagrams = 48, kMostBytes = 1400;

// An FMMU as it stands in its registers; `type` 1 reads, 2 writes.
Bytes fmmu(uint32_t logicalStart, unsigned length, unsigned start, uint8_t type) {
  Bytes b(16, 0);
  for (int i = 0; i < 4; ++i) b[i] = static_cast<uint8_t>(logicalStart >> 8 * i);
  b[4] = static_cast<uint8_t>(length), b[5] = static_cast<uint8_t>(length >> 8), b[7] = 7;
  b[8] = static_cast<uint8_t>(start), b[9] = static_cast<uint8_t>(start >> 8);
  b[11] = type, b[12] = 1;
  return b;
}

Datagram unchecked(unsigned address, Bytes data) {
  Datagram d = physical(false, true, address, std::move(data));
  d.checked = false;
  return d;
}
}  // namespace

Frame Master::setUp() {
  std::vector<Datagram> both{unchecked(reg::kStationAddress, {kStation & 0xff, kStation >> 8}),
                             unchecked(reg::kEcatEventMask, {0xf0, 0x0f})};
  for (Datagram& d : both)
    d.command = PROTOCOL_ECAT_APWR, d.address &= 0xffff0000;  // to position 0: it has no station address yet
  for (unsigned n = 0; n < kSms; ++n) slots_[n].change = Slot::Change::off;
  return Frame(both, Fault::none, 0);
}

Bytes Master::random(unsigned length) {
  Bytes b(length);
  for (uint8_t& x : b) x = random_.byte();
  return b;
}

// By the station address, or through the FMMU that shows the memory as it is.
void Master::add(bool read, bool write, unsigned address, Bytes data) {
  if (address >= kRamStart && random_.once(3))
    datagrams_.push_back(
        logical(read, write, kWindow0 + address - kRamStart, address, address, std::move(data)));
  else datagrams_.push_back(physical(read, write, address, std::move(data)));
}

Frame Master::next() {
  datagrams_.clear();
  pieces_.clear();
  off_ = on_ = 0;
  for (Session& s : sessions_) s.closed = s.failed = false;
  ++frames_;
  if (slots_.moving || frames_ % kFramesPerMove == 1) {
    moveAll();
    return Frame(datagrams_, Fault::none, 0);
  }
  const size_t count = 1 + random_.below(1u << random_.below(7));
  size_t bytes = 16;
  for (size_t i = 0; i < count && datagrams_.size() < kMostDatagrams && bytes < kMostBytes; ++i) {
    addRandom();
    bytes = 16;
    for (const Datagram& d : datagrams_) bytes += d.data.size() + 12;
  }
  addChanges();
  if (datagrams_.empty()) addRegister(0);
  const Fault faults[] = {Fault::fcs, Fault::cut, Fault::receiveError};
  return Frame(datagrams_, random_.once(10) ? faults[random_.below(3)] : Fault::none,
               random_.below(1u << 30));
}

// New places for all: off with all of them in one frame, on with all in the next.
void Master::moveAll() {
  if (!slots_.moving) {
    slots_.moving = true;
    off_ = 0xff;
    for (unsigned n = 0; n < kSms; ++n) {
      slots_[n].change = Slot::Change::off;
      datagrams_.push_back(physical(false, true, kSmRegisters + 8 * n + 6, {0}));
    }
    return;
  }
  slots_.place(random_);
  for (unsigned n = 0; n < kSms; ++n) addConfiguration(n);
  reader_ = writer_ = 0;
  for (unsigned k = 0; k < 20; ++k) {
    const unsigned n = random_.below(kSms);
    if (slots_[n].orderly) continue;
    (slots_[n].ecatWrites() ? writer_ : reader_) = n;
  }
  shift_ = static_cast<int>(slots_[writer_].start) - static_cast<int>(slots_[reader_].start) +
           random_.range(-1, 1);
  const unsigned distance = std::abs(shift_);
  datagrams_.push_back(unchecked(reg::kFmmus, fmmu(kWindow0, kRamSize, kRamStart, 3)));
  datagrams_.push_back(unchecked(reg::kFmmus + reg::kFmmuBytes, fmmu(kWindow1, kRamSize, kRamStart, 1)));
  datagrams_.push_back(unchecked(reg::kFmmus + 2 * reg::kFmmuBytes,
                                 fmmu(shift_ < 0 ? kWindow1 + distance : kWindow1, kRamSize - distance,
                                      shift_ < 0 ? kRamStart : kRamStart + distance, 2)));
}

// Start, length, control and enable in one datagram, as masters do.
void Master::addConfiguration(unsigned n) {
  const Slot& s = slots_[n];
  datagrams_.push_back(physical(
      false, true, kSmRegisters + 8 * n,
      {static_cast<uint8_t>(s.start), static_cast<uint8_t>(s.start >> 8), static_cast<uint8_t>(s.length),
       static_cast<uint8_t>(s.length >> 8), s.control, random_.byte(), 1, random_.byte()}));
  on_ |= 1u << n;
}

void Master::addChanges() {
  for (unsigned n = 0; n < kSms; ++n) {
    Slot& s = slots_[n];
    if (!s.held() && random_.once(150)) s.change = Slot::Change::off;
    if (!s.held() || random_.once(3)) continue;
    if (s.change == Slot::Change::off) {
      datagrams_.push_back(physical(false, true, kSmRegisters + 8 * n + 6, {0}));
      off_ |= 1u << n;
    } else {
      slots_.configure(s, random_);
      addConfiguration(n);
    }
  }
}

void Master::addRandom() {
  const unsigned n = random_.below(kSms);
  const unsigned what = random_.below(12);
  if (what == 0) addRegister(n);
  else if (what == 1) addShifted();
  else if (slots_[n].orderly) addOrderly(n);
  else addWild(n);
}

void Master::addRegister(unsigned n) {
  const unsigned at = kSmRegisters + 8 * n;
  switch (random_.below(5)) {
    case 0: return add(true, false, at, random(8));
    case 1: return add(true, false, at + 5, random(1 + random_.below(3)));
    case 2: return add(true, false, kSmRegisters + random_.below(50), random(14));
    case 3: {
      // The repeat request, and for one that is not orderly sometimes off and on without more ado.
      const bool on = slots_[n].orderly || !random_.once(4);
      if (slots_[n].held()) return;
      return add(random_.once(4), true, at + 6, {static_cast<uint8_t>((random_.byte() & 0xfe) | on)});
    }
    default: {
      // Configuration as it is: refused while it is on.
      if (slots_[n].held()) return;
      addConfiguration(n);
      on_ &= ~(1u << n);
    }
  }
}

// A piece of a whole buffer, mostly all of it.
void Master::addOrderly(unsigned n) {
  Slot& s = slots_[n];
  Session& session = sessions_[n];
  if (s.held() || session.closed || off_ >> n & 1) return;
  unsigned begin = session.position, end = s.length;
  if (begin > 0 && random_.once(10)) begin = random_.below(begin);
  if (random_.once(2)) end = random_.range(session.position + 1, s.length);
  if (s.ecatWrites() && session.stamp == 0) session.stamp = s.stamps.begin();
  pieces_.push_back({datagrams_.size(), n, begin});
  add(!s.ecatWrites(), s.ecatWrites(), s.start + begin,
      s.ecatWrites() ? Bytes(end - begin, session.stamp) : random(end - begin));
  session.position = end;
  session.closed = end == s.length;
}

void Master::addWild(unsigned n) {
  const Slot& s = slots_[n];
  bool write = s.ecatWrites(), read = !write;
  if (random_.once(12)) std::swap(read, write);
  if (random_.once(12)) read = write = true;
  unsigned begin = 0, end = s.length;
  switch (random_.below(10)) {
    case 0: end = 1; break;
    case 1: begin = end - 1; break;
    case 2: begin = random_.below(end); break;
    case 3: end = random_.range(1, end); break;
    case 4:  // the ends only, in two datagrams
      add(read, write, s.start, random(1));
      begin = end - 1;
      break;
    case 5: {  // over neighbours too
      const unsigned from = s.start + random_.below(s.room),
                     to = std::min(from + random_.below(60), kRamStart + kRamSize - 1);
      if (wild(from, to)) return add(read, write, from, random(to - from + 1));
      break;
    }
    default: break;
  }
  add(read, write, s.start + begin, random(end - begin));
}

// Nothing orderly there.
bool Master::wild(unsigned first, unsigned last) const {
  for (unsigned n = 0; n < kSms; ++n)
    if (slots_[n].orderly && first < slots_[n].start + slots_[n].room && last >= slots_[n].start)
      return false;
  return true;
}

// Reads one area and writes another with the same datagram.
void Master::addShifted() {
  const Slot& s = slots_[reader_];
  const int reads = static_cast<int>(s.start) - static_cast<int>(random_.below(3)), writes = reads + shift_;
  const int last = 1 + static_cast<int>(random_.below(s.length + 2)), low = kRamStart,
            high = kRamStart + kRamSize;
  if (std::min(reads, writes) < low || std::max(reads, writes) + last >= high) return;
  if (!wild(reads, reads + last) || !wild(writes, writes + last)) return;
  datagrams_.push_back(
      logical(!random_.once(8), true, kWindow1 + reads - low, reads, writes, random(last + 1)));
}

unsigned Master::takeBack(Frame& frame, uint64_t began, uint64_t ended) {
  for (const Piece& p : pieces_) piece(frame, p, frame.datagrams()[p.datagram], began, ended);
  // A session goes on with the next frame unless it failed or was broken, or has come to its end.
  for (const Piece& p : pieces_) {
    Session& s = sessions_[p.slot];
    if (!frame.good() || s.failed || s.closed) {
      s.position = 0;
      slots_[p.slot].stamps.drop();
      // What has not been taken is sent again, in a mailbox; else something newer.
      if (!slots_[p.slot].mailbox()) s.stamp = 0;
    }
  }
  if (!frame.good()) return 0;
  for (unsigned n = 0; n < kSms; ++n) {
    Slot& s = slots_[n];
    if (off_ >> n & 1) s.change = Slot::Change::on;
    if (on_ >> n & 1) {
      s.change = Slot::Change::none;
      s.stamps.reset(s.mailbox());
      sessions_[n] = Session();
    }
  }
  if (on_ == 0xff) slots_.moving = false;
  return on_;
}

void Master::piece(const Frame& frame, const Piece& p, const Datagram& d, uint64_t began, uint64_t ended) {
  Slot& s = slots_[p.slot];
  Session& session = sessions_[p.slot];
  if (d.increment <= 0) {
    session.failed = true;
    return;
  }
  const bool last = p.offset + d.data.size() == s.length;
  std::string wrong;
  if (!s.ecatWrites()) {
    for (size_t i = 0; i < d.returned.size() && wrong.empty(); ++i)
      wrong = s.stamps.read(p.offset + i, d.returned[i], began);
    if (wrong.empty() && last && frame.good()) wrong = s.stamps.close();
  } else if (last && frame.good()) {
    s.stamps.complete(ended);
    session.stamp = 0;
  }
  if (!wrong.empty() && violation_.empty())
    violation_ = "master, SyncManager " + std::to_string(p.slot) + ", control " + std::to_string(s.control) +
                 ", length " + std::to_string(s.length) + ": " + wrong;
}

}  // namespace smsoak

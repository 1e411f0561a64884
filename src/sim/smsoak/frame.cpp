#include "smsoak/frame.h"
#include "protocol.h"

#include <algorithm>

namespace smsoak {

namespace {
using namespace esc;
constexpr size_t kHeader = 10;

// A nibble is processed some cycles before it leaves; what it causes happens a few cycles around that.
constexpr int kBefore = 12, kAfter = 4;
// From the last nibble to the end of the frame, to the first and last register write.
constexpr int kEnd = 13, kCommit = 24;
// To the end of a host access that is under way, per byte of a word.
constexpr int kHostByte = 24;
}  // namespace

Datagram physical(bool read, bool write, unsigned address, Bytes data) {
  Datagram d;
  d.command = read && write ? PROTOCOL_ECAT_FPRW : read ? PROTOCOL_ECAT_FPRD : PROTOCOL_ECAT_FPWR;
  d.address = kStation | address << 16;
  d.data = std::move(data);
  if (read) d.reads = static_cast<int>(address);
  if (write) d.writes = static_cast<int>(address);
  return d;
}

Datagram logical(bool read, bool write, uint32_t address, unsigned reads, unsigned writes, Bytes data) {
  Datagram d;
  d.command = read && write ? PROTOCOL_ECAT_LRW : read ? PROTOCOL_ECAT_LRD : PROTOCOL_ECAT_LWR;
  d.address = address;
  d.data = std::move(data);
  if (read) d.reads = static_cast<int>(reads);
  if (write) d.writes = static_cast<int>(writes);
  return d;
}

Frame::Frame(std::vector<Datagram> datagrams, Fault fault, unsigned where)
    : datagrams_(std::move(datagrams)),
      fault_(fault) {
  Bytes bytes{0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0, 1, 2, 3, 4, 5, kEtherCat >> 8, kEtherCat & 0xff, 0, 0};
  for (size_t i = 0; i < datagrams_.size(); ++i) {
    Datagram& d = datagrams_[i];
    const size_t length = d.data.size() | (i + 1 < datagrams_.size() ? 0x8000 : 0);
    d.header = bytes.size();
    bytes.push_back(d.command), bytes.push_back(0);
    for (int k = 0; k < 4; ++k) bytes.push_back(static_cast<uint8_t>(d.address >> (8 * k)));
    bytes.push_back(static_cast<uint8_t>(length)), bytes.push_back(static_cast<uint8_t>(length >> 8));
    bytes.push_back(0), bytes.push_back(0);
    bytes.insert(bytes.end(), d.data.begin(), d.data.end());
    bytes.push_back(0), bytes.push_back(0);
  }
  const size_t all = bytes.size() - 16;
  bytes[14] = static_cast<uint8_t>(all), bytes[15] = static_cast<uint8_t>(0x10 | all >> 8);
  const std::vector<uint8_t> nibbles = toNibbles(bytes);
  for (uint8_t n : nibbles) symbols_.push_back({n, false});
  const size_t behind = symbols_.size() - 16, begin = 2 * (16 + 2);
  switch (fault) {
    case Fault::none: break;
    case Fault::fcs: symbols_.back().data ^= 1u << where % 4; break;
    case Fault::cut: symbols_.resize(16 + begin + where % (behind - begin - 8)); break;
    case Fault::receiveError: symbols_[16 + begin + where % (behind - begin - 8)].error = true; break;
  }
  nibbles_ = 0;
  while (16 + nibbles_ < symbols_.size() && !symbols_[16 + nibbles_].error) ++nibbles_;
}

void Frame::finish(const Core& core, uint64_t firstStep, const std::function<unsigned(unsigned)>& managersAt,
                   History& actions) {
  using Kind = Action::Kind;
  const Returned& back = core.returned();
  const size_t first = actions.size();
  const auto time = [&](size_t nibble) { return back.times[std::min(nibble, nibbles_ - 1)]; };
  const auto value = [&](size_t byte) {
    return static_cast<uint8_t>(back.nibbles[2 * byte] | back.nibbles[2 * byte + 1] << 4);
  };
  const auto managers = [&](unsigned a) { return isSmRegister(a) ? 1u << managerOf(a) : managersAt(a); };
  unsigned touched = 0;
  History commits;

  // It is in the processing unit from its preamble on: 16 nibbles.
  const uint64_t starts = time(0) - 16 * core.perNibble();
  actions.push_back({Kind::frameStarts, starts - kBefore, starts + kAfter, 0, 0, -1, 0x1ff, firstStep});
  uint64_t step = firstStep;
  for (Datagram& d : datagrams_) {
    const size_t data = d.header + kHeader, end = data + d.data.size();
    d.increment = -1;
    for (size_t j = data; j < end && 2 * j + 1 < nibbles_; ++j) d.returned.push_back(value(j));
    if (2 * (end + 1) + 1 < nibbles_) d.increment = value(end) | value(end + 1) << 8;
    if (!d.checked) continue;
    for (size_t k = 1; k <= 2; ++k) {
      const size_t nibble = 2 * (d.header + 8) + k;
      if (nibble < nibbles_)
        actions.push_back({Kind::irqNibble, time(nibble) - kBefore, time(nibble) + kAfter,
                           static_cast<uint16_t>(k), 0, back.nibbles[nibble], k == 1 ? 0x0fu : 0xf0u, step});
    }
    // Reading looks ahead, when the last but one byte before has passed (B-55).
    const auto read = [&](size_t j) {
      const size_t before = 2 * (data + j) - 2;
      if (d.reads < 0 || j >= d.data.size() || before > nibbles_) return;
      const auto a = static_cast<uint16_t>(d.reads + j);
      const bool known = 2 * (data + j) + 1 < nibbles_;
      touched |= managers(a);
      actions.push_back({Kind::read, time(before) - kBefore, time(before + 2) + kAfter, a, d.data[j],
                         known ? value(data + j) : -1, managers(a), step});
    };
    read(0);
    for (size_t j = 0; j < d.data.size(); ++j) {
      read(j + 1);
      const size_t nibble = 2 * (data + j) + 1;
      if (d.writes < 0 || nibble >= nibbles_) continue;
      const auto a = static_cast<uint16_t>(d.writes + j);
      touched |= managers(a);
      actions.push_back({Kind::write, time(nibble - 1) - kBefore, time(nibble) + kAfter, a, d.data[j], -1,
                         managers(a), step});
      if (good() && isSmRegister(a))
        commits.push_back({Kind::commit, 0, 0, a, d.data[j], -1, managers(a), step});
    }
    const uint64_t close = time(2 * end);
    actions.push_back({Kind::counter, close, close,
                       static_cast<uint16_t>((d.reads >= 0) | (d.writes >= 0) << 1), 0, d.increment, 0,
                       step++});
  }
  const uint64_t ends = time(nibbles_ - 1);
  actions.push_back({Kind::frameEnds, ends - kBefore, ends + kEnd, good(), 0, -1, touched, step});
  last_ = ends + kCommit + commits.size();
  // The slave comes to rest (B-59) before, between or after its register writes.
  const uint64_t rests = last_ + core.lanes() * kHostByte;
  // A byte a cycle, one after the other; refused ones take no time.
  for (size_t i = 0; i < commits.size(); ++i) {
    Action& c = commits[i];
    c.from = ends, c.to = ends + kCommit + i;
    actions.push_back({Kind::perhapsQuiet, c.from, rests, 0, 0, -1, 0x1ff, step});
    actions.push_back(c);
  }
  actions.push_back({Kind::quiet, ends - kBefore, rests, 0, 0, -1, 0x1ff, step});
  last_ = rests;
  // The times of an action are no earlier than those of the one before it.
  for (size_t i = first + 1; i < actions.size(); ++i)
    actions[i].from = std::max(actions[i].from, actions[i - 1].from);
}

}  // namespace smsoak

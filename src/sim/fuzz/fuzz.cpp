#include "fuzz/fuzz.h"

#include <algorithm>
#include <istream>
#include <sstream>

#include "core/ethernet.h"
#include "core/user_error.h"

namespace {
// Longest time a slave works on after a frame: register writes are committed within 88 nibble times of its
// end.
constexpr Time kSettle = 96 * kNibble;
// Symbols queued at a port before the simulation runs on, so that long vector files need no memory.
constexpr size_t kMaxBacklog = 1 << 15;

std::string describe(const std::vector<uint8_t>& nibbles) {
  const Payload p = payloadOf(nibbles);
  if (!p.sfd) return "nibbles without SFD " + hexNibbles(nibbles);
  const size_t first = static_cast<size_t>(p.preamble) + 1;
  return "preamble " + std::to_string(p.preamble) + ", " + std::to_string(nibbles.size() - first) +
         " nibbles " + hexNibbles({nibbles.begin() + first, nibbles.end()});
}

std::string hexByte(unsigned v) {
  char s[8];
  std::snprintf(s, sizeof s, "0x%02x", v);
  return s;
}
}  // namespace

bool Fuzz::play(std::istream& vectors) {
  std::string text;
  while (!failed() && std::getline(vectors, text)) {
    VectorLine v(text, ++lineNumber_);
    if (!v.empty()) line(v);
  }
  if (!failed() && bench_) waitIdle();
  return !failed();
}

Bench& Fuzz::bench() {
  if (!bench_) throw UserError("the vectors do not begin with an H line.");
  return *bench_;
}

int Fuzz::port(VectorLine& v) const { return static_cast<int>(v.decimal(0, bench_->ports() - 1)); }

void Fuzz::line(VectorLine& v) {
  const char kind = v.kind();
  if (kind != 'H') bench();
  // Everything but frames and what they should cause happens with the wires quiet, so that its order is
  // certain.
  if (kind != 'F' && kind != 'X' && kind != 'I' && bench_ && !(kind == 'R' && reading_)) waitIdle();
  reading_ = kind == 'R';  // nothing has begun to move since the last R line
  if (failed()) return;
  switch (kind) {
    case 'H': header(v); break;
    case 'C': {
      const int y = port(v);
      bench_->sender(y).setPpm(v.decimal(-1000, 1000));
      break;
    }
    case 'L': {
      const int y = port(v);
      bench_->slave().setLink(y, v.decimal(0, 1));
      bench_->runCycles(200);
      break;
    }
    case 'P':
      bench_->slave().setPdiOperational(v.decimal(0, 1));
      bench_->runCycles(16);
      break;
    case 'D': {
      if (!bench_->slave().hasDetector()) v.bad("is for a smoke detector, which this slave has not");
      bench_->slave().setAlarmCurrent(static_cast<unsigned>(v.decimal(0, 7)));
      break;
    }
    case 'A': bench_->runCycles(v.decimal(0, 1'000'000) * bench_->slave().info().coreClockMhz); break;
    case 'W': {
      const auto addr = static_cast<uint16_t>(v.hexNumber(0xffff));
      if (!bench_->writeByte(addr, static_cast<uint8_t>(v.hexNumber(0xff))))
        differ("host write was not acknowledged", v.number(), nullptr);
      break;
    }
    case 'F': frame(v); break;
    case 'I': {
      const int y = port(v);
      for (long n = v.decimal(0, 1'000'000); n > 0; --n) bench_->sender(y).push({false, true, 0xe});
      break;
    }
    case 'X': expect(v); break;
    case 'R': read(v); break;
    case 'Q': break;
    default: v.bad(std::string("starts with '") + kind + "', which is no kind of vector");
  }
  v.done();
}

void Fuzz::header(VectorLine& v) {
  seed_ = v.text();
  const std::string name = v.text();
  if (!wantedPreset_.empty() && name != wantedPreset_)
    v.bad("is for preset '" + name + "', not '" + wantedPreset_ + "'");
  const Preset& preset = findPreset(name);
  const PresetInfo& info = preset.info;
  if (!info.hasHost) v.bad("is for preset '" + name + "', which has no host");
  const long ports = v.decimal(1, 4), cycles = v.decimal(1, 5), width = v.decimal(8, 32);
  if (ports != info.ports || cycles != info.cyclesPerNibble || width != info.dataBusWidth)
    v.bad("describes another '" + name + "' than the one built in, which has " + std::to_string(info.ports) +
          " ports, " + std::to_string(info.cyclesPerNibble) + " cycles per nibble and a data bus of " +
          std::to_string(info.dataBusWidth) + " bits");
  uint64_t phaseSeed = 0;
  for (char c : seed_) phaseSeed = phaseSeed * 131 + static_cast<uint8_t>(c);
  if (bench_) cycles_ += bench_->slave().cycles();
  current_ = nullptr;
  eventTimes_.clear();
  expected_.assign(info.ports, {});
  bench_ = std::make_unique<Bench>(preset, phaseSeed, [this](int y, NibbleFrame& f) { onFrame(y, f); });
}

// Puts other bytes into a frame, from payload byte `at` on, and corrects the FCS by what they change.
static void replace(std::vector<uint8_t>& nibbles, size_t at, const uint8_t* with, size_t count) {
  const Payload p = payloadOf(nibbles);
  const auto right = [&](size_t size) { return crc32(p.bytes.data(), size) == kCrcResidue; };
  // The mark of a bad frame has a whole byte if the FCS before it is right.
  const size_t last = p.bytes.size(), marked = p.odd && last > 0 && !right(last) && right(last - 1);
  if (!p.sfd || last < at + count + 4 + marked) return;
  const size_t fcs = last - 4 - marked;
  Bytes change(fcs), none(fcs);
  for (size_t i = 0; i < count; ++i) change[at + i] = with[i] ^ p.bytes[at + i];
  const uint32_t fcsChange = crc32(change.data(), fcs) ^ crc32(none.data(), fcs);
  auto put = [&](size_t byte, uint8_t x) {
    const size_t nibble = p.preamble + 1 + 2 * byte;
    nibbles[nibble] ^= x & 0xf;
    nibbles[nibble + 1] ^= x >> 4;
  };
  for (size_t i = 0; i < count; ++i) put(at + i, change[at + i]);
  for (size_t i = 0; i < 4; ++i) put(fcs + i, fcsChange >> (8 * i) & 0xff);
}

static void replaceGuard(std::vector<uint8_t>& nibbles, int at, uint16_t guard) {
  const uint8_t bytes[] = {static_cast<uint8_t>(guard & 0xff), static_cast<uint8_t>(guard >> 8)};
  replace(nibbles, at, bytes, 2);
}

void Fuzz::frame(VectorLine& v) {
  auto sent = std::make_shared<Sent>();
  sent->line = v.number();
  sent->id = v.text();
  sent->port = port(v);
  Sender& sender = bench_->sender(sent->port);
  while (!failed() && sender.backlog() > kMaxBacklog) bench_->sim().step();
  const int gap = static_cast<int>(v.decimal(0, 1'000'000'000));
  sent->nibbles = v.nibbles();
  std::vector<bool> errors(sent->nibbles.size());
  while (v.more()) {
    const std::string field = v.text();
    std::istringstream list(field.substr(1));
    if (field[0] == 'E') {
      sent->errors = field;
      for (std::string item; std::getline(list, item, ',');) {
        VectorLine index("E " + item, v.number());
        errors[index.decimal(0, static_cast<long>(errors.size()) - 1)] = true;
      }
    } else if (field[0] == 'G') {
      std::string at, event;
      std::getline(list, at, ':'), std::getline(list, event);
      sent->guard = static_cast<int>(VectorLine("G " + at, v.number()).decimal(0, 2000));
      const auto known =
          eventTimes_.find(static_cast<unsigned>(VectorLine("G " + event, v.number()).decimal(0, 0xffff)));
      if (known == eventTimes_.end()) v.bad("has G and an event of which no frame has told the time");
      sent->guardIs = static_cast<uint16_t>(known->second);
      replaceGuard(sent->nibbles, sent->guard, sent->guardIs);
    } else {
      v.bad("has '" + field + "' where E and the symbols with RX_ER, or G, a byte and an event belong");
    }
  }
  sender.pushIdle(gap);
  for (size_t i = 0; i < sent->nibbles.size(); ++i) sender.push({true, errors[i], sent->nibbles[i]});
  current_ = sent;
  ++frames_;
}

void Fuzz::expect(VectorLine& v) {
  if (!current_) v.bad("expects a frame before there was an F line");
  const std::string first = v.text();
  if (first == "-") return;
  VectorLine fields("X " + first, v.number());
  const int y = port(fields);
  Expected e{v.number(), current_, std::vector<uint8_t>(v.decimal(0, 100'000), 0x5)};
  e.nibbles.push_back(0xd);
  if (v.more()) {
    const auto payload = v.nibbles();
    e.nibbles.insert(e.nibbles.end(), payload.begin(), payload.end());
    if (v.more()) {
      const std::string open = v.text();
      if (open == "?") {
        e.free = true;
      } else {
        if (open[0] != 'T') v.bad("has '" + open + "' where T and a nibble or ? belongs");
        e.time = static_cast<int>(
            VectorLine("T " + open.substr(1), v.number()).decimal(8, static_cast<long>(payload.size()) - 24));
      }
    }
  }
  if (current_->guard >= 0) replaceGuard(e.nibbles, current_->guard, current_->guardIs);
  expected_[y].push_back(std::move(e));
}

void Fuzz::onFrame(int port, NibbleFrame& frame) {
  if (failed()) return;
  const std::string at = "port " + std::to_string(port) + " sent ";
  if (expected_[port].empty())
    return differ(at + describe(frame.nibbles) + "\nexpected: nothing",
                  current_ ? current_->line : lineNumber_, current_.get());
  Expected e = std::move(expected_[port].front());
  expected_[port].pop_front();
  bytes_ += frame.nibbles.size() / 2;
  if (e.time >= 0 && !takeTime(e, frame)) return;
  if (e.free && frame.nibbles.size() == e.nibbles.size())
    std::copy(frame.nibbles.begin() + payloadOf(e.nibbles).preamble + 1, frame.nibbles.end(),
              e.nibbles.begin() + payloadOf(e.nibbles).preamble + 1);
  if (frame.nibbles == e.nibbles) return;
  const Payload got = payloadOf(frame.nibbles), wanted = payloadOf(e.nibbles);
  std::string where = "preamble length differs";
  if (!got.sfd) where = "there is no SFD";
  else if (got.preamble == wanted.preamble) {
    const auto bad =
        std::mismatch(frame.nibbles.begin(), frame.nibbles.end(), e.nibbles.begin(), e.nibbles.end()).first;
    const auto nibble = bad - frame.nibbles.begin() - got.preamble - 1;
    where = "first difference at payload nibble " + std::to_string(nibble) + " (byte " +
            std::to_string(nibble / 2) + ")";
  }
  differ("port " + std::to_string(port) + ", " + where + "\nexpected: " + describe(e.nibbles) +
             "\nactual:   " + describe(frame.nibbles),
         e.line, e.cause.get());
}

// The vectors do not know when an event was. Its time is taken from the frame, into the FCS too; what it may
// be is checked.
bool Fuzz::takeTime(Expected& e, const NibbleFrame& frame) {
  if (frame.nibbles.size() != e.nibbles.size()) return true;
  const Payload wanted = payloadOf(e.nibbles), got = payloadOf(frame.nibbles);
  if (!got.sfd || got.preamble != wanted.preamble) return true;
  const size_t at = e.time / 2;
  if (got.bytes.size() < at + 8 + 4) return true;
  uint64_t time = 0;
  for (size_t i = 0; i < 8; ++i) time |= uint64_t{got.bytes[at + i]} << (8 * i);
  replace(e.nibbles, at, &got.bytes[at], 8);

  const unsigned number = got.bytes[at - 4] | got.bytes[at - 3] << 8;
  const auto [event, isNew] = eventTimes_.emplace(number, time);
  const bool inOrder = (event == eventTimes_.begin() || std::prev(event)->second <= time) &&
                       (std::next(event) == eventTimes_.end() || std::next(event)->second >= time);
  const bool isAhead = static_cast<Time>(time) > bench_->sim().now() / (1000 * kNs);
  if (event->second != time || !inOrder || (isNew && isAhead))
    differ("the time of event " + std::to_string(number) + " is " + std::to_string(time) +
               " us, which is not what it was, or not between those of its neighbours",
           e.line, e.cause.get());
  return !failed();
}

void Fuzz::waitIdle() {
  const Time hang = Bench::kHangCycles * bench_->slave().corePeriod();
  while (!failed()) {
    const bool awaited = std::any_of(expected_.begin(), expected_.end(), [](auto& q) { return !q.empty(); });
    const Time now = bench_->sim().now();
    if (bench_->quiet() && !awaited && now - bench_->lastActive() > kSettle) return;
    if (bench_->allFed() && now - bench_->lastFed() > hang) break;
    bench_->sim().step();
  }
  if (failed()) return;
  for (size_t y = 0; y < expected_.size(); ++y)
    if (!expected_[y].empty()) {
      const Expected& e = expected_[y].front();
      const auto& partial = bench_->collector(static_cast<int>(y)).partial().nibbles;
      return differ("port " + std::to_string(y) + ", frame not seen complete within " +
                        std::to_string(Bench::kHangCycles) +
                        " core cycles\nexpected: " + describe(e.nibbles) +
                        "\nactual:   " + (partial.empty() ? "nothing" : "so far " + describe(partial)),
                    e.line, e.cause.get());
    }
  differ("the slave does not stop sending", lineNumber_, current_.get());
}

// One access: only the bytes named are enabled, as reading may have effects.
void Fuzz::read(VectorLine& v) {
  const auto addr = static_cast<uint16_t>(v.hexNumber(0xffff));
  const int lanes = bench_->slave().info().lanes(), first = addr & (lanes - 1);
  std::vector<unsigned> wanted;
  do wanted.push_back(static_cast<unsigned>(v.hexNumber(0xff)));
  while (v.more());
  if (first + wanted.size() > static_cast<size_t>(lanes)) v.bad("reads beyond one word of the data bus");
  uint32_t word = 0;
  if (!bench_->readBytes(addr, static_cast<int>(wanted.size()), word))
    return differ("host read was not acknowledged", v.number(), current_.get());
  bytes_ += wanted.size();
  for (size_t i = 0; i < wanted.size(); ++i) {
    const unsigned got = word >> (8 * (first + i)) & 0xff;
    if (got == wanted[i]) continue;
    char where[64];
    std::snprintf(where, sizeof where, "host read of 0x%04x", static_cast<unsigned>(addr + i));
    return differ(std::string(where) + "\nexpected: " + hexByte(wanted[i]) + "\nactual:   " + hexByte(got),
                  v.number(), current_.get());
  }
}

void Fuzz::differ(const std::string& what, uint64_t line, const Sent* cause) {
  if (failed()) return;
  std::ostringstream s;
  s << "difference at vector line " << line << ", seed " << seed_;
  if (cause) s << ", frame " << cause->id;
  s << ": " << what;
  if (cause) {
    const Payload p = payloadOf(cause->nibbles);
    s << "\nreceived: frame " << cause->id << " at port " << cause->port << " (line " << cause->line << "), ";
    if (p.sfd)
      s << "preamble " << p.preamble << ", " << p.bytes.size() << (p.odd ? ".5" : "") << " bytes "
        << hex(p.bytes);
    else s << "nibbles " << hexNibbles(cause->nibbles);
    if (p.odd && p.sfd) s << ' ' << hexNibbles({cause->nibbles.back()});
    if (!cause->errors.empty()) s << " RX_ER " << cause->errors;
  }
  difference_ = s.str();
}

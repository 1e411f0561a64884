#include "faults/master.h"

#include <algorithm>

#include "core/user_error.h"

namespace faults {

namespace {
using namespace esc;

constexpr uint32_t kOutputs = 0x10000, kInputs = 0x20000;         // logical addresses
constexpr uint16_t kOutputArea = 0x1000, kInputArea = 0x1100;     // of three buffers each
constexpr uint8_t kWrittenByMaster = 0x64, kReadByMaster = 0x20;  // control of SyncManagers, with watchdog
constexpr unsigned kScratch = 7;                                  // a FMMU that is never activated
constexpr size_t kSizes[] = {8, 3, 4, 1, 16};                     // of process data, slave by slave
constexpr uint64_t kLag = 32;                                     // cycles until inputs show outputs, at most
constexpr int kPatience = 200;                                    // frames until a slave has taken something

uint8_t low(unsigned v) { return static_cast<uint8_t>(v); }
uint8_t high(unsigned v) { return static_cast<uint8_t>(v >> 8); }

Bytes little(uint32_t v) { return {low(v), high(v), low(v >> 16), low(v >> 24)}; }
uint32_t number(const Bytes& b) {
  uint32_t v = 0;
  for (size_t i = b.size(); i-- > 0;) v = v << 8 | b[i];
  return v;
}
Bytes fmmu(uint32_t logical, size_t size, uint16_t area, bool written) {
  const uint8_t type = written ? 2 : 1;
  return {low(logical),
          high(logical),
          low(logical >> 16),
          low(logical >> 24),
          low(size),
          0,
          0,
          7,
          low(area),
          high(area),
          0,
          type,
          1,
          0,
          0,
          0};
}
Bytes syncManager(uint16_t area, size_t size, uint8_t control) {
  return {low(area), high(area), low(size), 0, control, 0, 1, 0};
}
uint16_t fmmuAt(unsigned n) { return static_cast<uint16_t>(reg::kFmmus + n * reg::kFmmuBytes); }
uint16_t syncManagerAt(unsigned n) {
  return static_cast<uint16_t>(reg::kSyncManagers + n * reg::kSyncManagerBytes);
}
}  // namespace

Master::Master(Bus& bus, uint64_t seed) : bus_(bus), random_(seed) {
  for (size_t i = 0; i < bus.slaves(); ++i) {
    const size_t size = kSizes[i % std::size(kSizes)];
    stations_.push_back({static_cast<uint32_t>(bytes_), static_cast<uint32_t>(bytes_), size});
    bytes_ += size;
  }
  setUp();
}

void Master::fail(const std::string& what) {
  if (violation_.empty()) violation_ = "cycle " + std::to_string(cycles_) + ": " + what;
}

// The network is whole meanwhile.
void Master::setUp() {
  for (size_t i = 0; i < stations_.size(); ++i) {
    const auto position = static_cast<uint16_t>(-static_cast<int>(i));
    const unsigned address = addressOf(i);
    const auto set = bus_.exchange({{PROTOCOL_ECAT_APWR,
                                     position | uint32_t{reg::kStationAddress} << 16,
                                     {low(address), high(address)}}});
    if (!set || set->front().wkc != 1)
      throw UserError("slave " + std::to_string(i) + " does not answer: it cannot be set up.");
  }
  for (size_t i = 0; i < stations_.size(); ++i) {
    const Station& s = stations_[i];
    const auto write = [&](unsigned ado, const Bytes& data) {
      const auto answer = bus_.exchange({station(PROTOCOL_ECAT_FPWR, i, ado, data)});
      if (!answer || answer->front().wkc != 1)
        throw UserError("slave " + std::to_string(i) + " does not take its settings.");
    };
    write(reg::kWatchdogTime, {50, 0});  // 5 ms
    write(syncManagerAt(0), syncManager(kOutputArea, s.size, kWrittenByMaster));
    write(syncManagerAt(1), syncManager(kInputArea, s.size, kReadByMaster));
    write(fmmuAt(0), fmmu(kOutputs + s.outputs, s.size, kOutputArea, true));
    write(fmmuAt(1), fmmu(kInputs + s.inputs, s.size, kInputArea, false));
  }
  const auto types = bus_.exchange({broadcast(PROTOCOL_ECAT_BRD, 0, Bytes(4))});
  if (!types || types->front().wkc != stations_.size()) throw UserError("the slaves cannot be counted.");
  types_ = types->front().data;
  for (int i = 0; i < kPatience && !healthy(); ++i) {
    cycle();
    bus_.idle(5000);
  }
  if (!healthy()) throw UserError("the slaves do not reach OP.");
}

// The first byte tells which cycle, the others depend on all.
Bytes Master::outputsOf(size_t slave, uint64_t cycle) const {
  Bytes b(stations_[slave].size);
  for (size_t i = 0; i < b.size(); ++i)
    b[i] = low(static_cast<unsigned>(i == 0 ? cycle : cycle * 37 + slave * 11 + i * (cycle >> 3 | 1)));
  return b;
}

// They are the outputs of a cycle, none of them torn, and never of an older one than before.
void Master::inputsCame(size_t slave, const Bytes& data) {
  Station& s = stations_[slave];
  const uint64_t oldest = std::max<uint64_t>(s.shown, healthyCycles_ > kLag ? cycles_ - kLag : 1);
  for (uint64_t c = cycles_; c >= oldest; --c)
    if (data == outputsOf(slave, c)) {
      s.shown = c;
      return;
    }
  // Before OP they are what the host has made of no outputs.
  if (s.shown == 0 || !s.inOp) return;
  fail("the inputs of slave " + std::to_string(slave) + " are " + hex(data) +
       ", which are no outputs since cycle " + std::to_string(oldest));
}

void Master::scratch(std::vector<Datagram>& frame, size_t slave, uint32_t written) {
  const bool writes = written != 0;
  const auto command = static_cast<uint8_t>(writes ? PROTOCOL_ECAT_FPWR : PROTOCOL_ECAT_FPRD);
  frame.push_back(station(command, slave, fmmuAt(kScratch), writes ? little(written) : Bytes(4)));
}

// A write whose frame is lost may have had its effect or not, but wholly.
void Master::scratchCame(const Datagram& d, size_t slave, bool wrote, uint32_t written, bool lost) {
  std::vector<uint32_t>& may = stations_[slave].scratch;
  if (wrote && !lost && d.wkc == 1) {
    may = {written};
  } else if (wrote) {
    may.push_back(written);
  } else if (!lost && d.wkc == 1) {
    const uint32_t v = number(d.data);
    if (std::find(may.begin(), may.end(), v) == may.end())
      fail("slave " + std::to_string(slave) + " holds " + std::to_string(v) + ", which nobody has written");
    may = {v};
  }
}

void Master::lookAt(size_t slave) {
  const auto read = bus_.exchange({station(PROTOCOL_ECAT_FPRD, slave, reg::kAlStatus, Bytes(2))});
  if (!read || read->front().wkc != 1) return;
  const unsigned status = read->front().data[0], state = status & kAlStateMask;
  stations_[slave].inOp = status == kOp;
  if (status == kOp) return;
  if (status & kAlError) ++recoveries_;
  const unsigned onward = state == kInit ? kPreop : state == kPreop ? kSafeop : kOp;
  const unsigned wanted = status & kAlError ? state | kAlError : onward;
  bus_.exchange({station(PROTOCOL_ECAT_FPWR, slave, reg::kAlControl, {low(wanted), 0})});
}

void Master::cycle(int64_t afterNs, const Bus::Within& within) {
  ++cycles_;
  const auto all = static_cast<unsigned>(stations_.size());
  Bytes outputs;
  for (size_t i = 0; i < all; ++i) {
    const Bytes own = outputsOf(i, cycles_);
    outputs.insert(outputs.end(), own.begin(), own.end());
  }
  const size_t slave = random_() % all;
  const bool writes = random_() % 2;
  const uint32_t written = writes ? static_cast<uint32_t>(random_()) | 1 : 0;
  std::vector<Datagram> frame = {logical(PROTOCOL_ECAT_LWR, kOutputs, outputs),
                                 logical(PROTOCOL_ECAT_LRD, kInputs, Bytes(bytes_)),
                                 broadcast(PROTOCOL_ECAT_BRD, reg::kAlStatus, Bytes(2)),
                                 broadcast(PROTOCOL_ECAT_BRD, 0, Bytes(types_.size()))};
  scratch(frame, slave, written);
  const Answer answer = bus_.exchange(frame, afterNs, within);
  complete_ = answer.has_value() &&
              std::all_of(answer->begin(), answer->end() - 1, [&](auto& d) { return d.wkc == all; }) &&
              answer->back().wkc == 1;
  completeCycles_ += complete_;
  operational_ = complete_ && (*answer)[2].data[0] == kOp;
  healthyCycles_ = operational_ ? healthyCycles_ + 1 : 0;
  scratchCame(answer ? answer->back() : frame.back(), slave, writes, written, !answer);
  if (answer) {
    for (const Datagram& d : *answer)
      if (d.wkc > all) fail("a working counter is " + std::to_string(d.wkc));
    if ((*answer)[1].wkc == all)
      for (size_t i = 0; i < all; ++i) {
        const auto at = (*answer)[1].data.begin() + stations_[i].inputs;
        inputsCame(i, Bytes(at, at + static_cast<std::ptrdiff_t>(stations_[i].size)));
      }
    if ((*answer)[3].wkc == all && (*answer)[3].data != types_)
      fail("the types are " + hex((*answer)[3].data));
  }
  if (complete_ && operational_)
    for (Station& s : stations_) s.inOp = true;
  else lookAt(next_ = (next_ + 1) % all);
}

std::optional<std::vector<Bytes>> Master::readAll(unsigned ado, size_t bytes) {
  std::vector<Bytes> all;
  for (size_t i = 0; i < stations_.size(); ++i) {
    const auto answer = bus_.exchange({station(PROTOCOL_ECAT_FPRD, i, ado, Bytes(bytes))});
    if (!answer || answer->front().wkc != 1) return std::nullopt;
    all.push_back(answer->front().data);
  }
  return all;
}

bool Master::writeAll(unsigned ado, const Bytes& data) {
  for (size_t i = 0; i < stations_.size(); ++i) {
    const auto answer = bus_.exchange({station(PROTOCOL_ECAT_FPWR, i, ado, data)});
    if (!answer || answer->front().wkc != 1) return false;
  }
  return true;
}

}  // namespace faults

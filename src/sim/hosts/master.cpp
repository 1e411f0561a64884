#include "hosts/master.h"

#include <algorithm>

#include "protocol.h"

namespace hosts {
namespace {
constexpr size_t kHeader = 16, kDatagramHeader = 10, kFcs = 4;
constexpr int kGapNibbles = 24;
constexpr uint64_t kLongest = 100000;  // core cycles that a frame is waited for
constexpr unsigned kOthersStation = 0x2345;
}  // namespace

Bytes stamped(uint32_t number, size_t length) {
  Bytes bytes;
  for (int i = 0; i < 4; ++i) bytes.push_back(static_cast<uint8_t>(number >> (8 * i)));
  for (uint32_t i = 4; i < length; ++i)
    bytes.push_back(static_cast<uint8_t>((number * 2654435761u + i * 40503u) >> 13));
  return bytes;
}

int64_t numberOf(const Bytes& bytes) {
  uint32_t number = 0;
  for (int i = 3; i >= 0; --i) number = number << 8 | bytes[static_cast<size_t>(i)];
  return bytes == stamped(number, bytes.size()) ? int64_t{number} : -1;
}

Bytes messageOf(uint32_t number) {
  Bytes bytes{place::kMailbox - 6, 0, 0, 0, 0, 3};
  const Bytes rest = stamped(number, place::kMailbox - bytes.size());
  bytes.insert(bytes.end(), rest.begin(), rest.end());
  return bytes;
}
int64_t messageNumberOf(const Bytes& message) {
  const int64_t number = numberOf(Bytes(message.begin() + 6, message.end()));
  return number >= 0 && message == messageOf(static_cast<uint32_t>(number)) ? number : -1;
}

Master::Master(Core& core, Random& random) : core_(core), random_(random) {
  core_.atCycle = [this] { cycle(); };
}

Datagram Master::pass(Datagram datagram) {
  const bool ran = std::exchange(runs_, false);
  for (uint64_t i = 0; !idle() || core_.cycles() < quietUntil_; ++i) core_.cycle();
  send({datagram}, false);
  while (!idle()) core_.cycle();
  // Its register writes take effect.
  core_.cycle(200);
  runs_ = ran;
  return back_->datagrams.front();
}

Datagram Master::write(unsigned address, uint64_t value, unsigned bytes) {
  Bytes data;
  for (unsigned i = 0; i < bytes; ++i) data.push_back(static_cast<uint8_t>(value >> (8 * i)));
  const Datagram d = pass({true, address, data});
  if (d.counter != 1) throw Wrong("a write of the master to " + std::to_string(address) + " is refused");
  return d;
}

void Master::cycle() {
  if (onWay_) {
    if (core_.returned()) take();
    else if (core_.cycles() > quietUntil_) throw Wrong("a frame does not come back");
  } else if (runs_ && core_.cycles() > quietUntil_) {
    const bool foreign = random_.once(4);
    send(plan(), foreign);
  }
}

void Master::send(std::vector<Datagram> datagrams, bool foreign) {
  Bytes bytes{0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0, 1, 2, 3, 4, 5, 0x88, 0xa4, 0, 0};
  for (size_t i = 0; i < datagrams.size(); ++i) {
    const Datagram& d = datagrams[i];
    const bool more = i + 1 < datagrams.size();
    bytes.push_back(foreign   ? (d.write ? PROTOCOL_ECAT_FPWR : PROTOCOL_ECAT_FPRD)
                    : d.write ? PROTOCOL_ECAT_APWR
                              : PROTOCOL_ECAT_APRD);
    bytes.push_back(0);
    const unsigned station = foreign ? kOthersStation : 0;
    for (unsigned v : {station, d.address, static_cast<unsigned>(d.data.size() | (more ? 0x8000 : 0)), 0u})
      bytes.push_back(static_cast<uint8_t>(v)), bytes.push_back(static_cast<uint8_t>(v >> 8));
    bytes.insert(bytes.end(), d.data.begin(), d.data.end());
    bytes.push_back(0), bytes.push_back(0);
  }
  const size_t length = bytes.size() - kHeader;
  bytes[14] = static_cast<uint8_t>(length), bytes[15] = static_cast<uint8_t>(0x10 | length >> 8);
  core_.send(toNibbles(bytes));
  quietUntil_ = core_.cycles() + kLongest;
  onWay_ = Frame{bytes, std::move(datagrams), foreign};
}

void Master::take() {
  Frame frame = std::move(*onWay_);
  onWay_.reset();
  ++frames_;
  quietUntil_ = core_.cycles() + static_cast<uint64_t>(core_.info().cyclesPerNibble) * kGapNibbles +
                (random_.once(4) ? random_.below(2000) : random_.below(40));
  const std::vector<uint8_t>& nibbles = core_.nibbles();
  Bytes bytes;
  for (size_t i = 0; i + 1 < nibbles.size(); i += 2)
    bytes.push_back(static_cast<uint8_t>(nibbles[i] | nibbles[i + 1] << 4));
  const size_t sent = std::max<size_t>(frame.bytes.size(), 60);
  if (bytes.size() != sent + kFcs || crc32(bytes.data(), bytes.size()) != kCrcResidue)
    throw Wrong("a frame has come back broken");
  size_t at = kHeader;
  for (Datagram& d : frame.datagrams) {
    const size_t data = at + kDatagramHeader, end = data + d.data.size();
    const Bytes was = d.data;
    d.data.assign(bytes.begin() + static_cast<long>(data), bytes.begin() + static_cast<long>(end));
    d.counter = bytes[end] | bytes[end + 1] << 8;
    if ((d.write || frame.foreign) && d.data != was) throw Wrong("a frame has come back changed");
    if (frame.foreign && d.counter) throw Wrong("a frame for another station was counted");
    if (!frame.foreign && !d.purpose.empty()) use(d);
    at = end + 2;
  }
  back_ = std::move(frame);
}

// One to three orders, each another thing.
std::vector<Datagram> Master::plan() {
  std::vector<Datagram> all;
  const unsigned first = random_.below(6);
  for (unsigned k = 0, n = 1 + random_.below(3); k < n; ++k) switch ((first + k) % 6) {
      case 0:
        all.push_back({true, place::kOutputs, stamped(static_cast<uint32_t>(outputs_ + 1), place::kProcess)});
        all.back().purpose = "outputs";
        break;
      case 1:
        all.push_back({false, place::kInputs, Bytes(place::kProcess)});
        all.back().purpose = "inputs";
        break;
      case 2:
        if (toPost_ == 0) break;
        all.push_back({true, place::kMailboxIn, messageOf(static_cast<uint32_t>(posted_ + 1))});
        all.back().purpose = "post";
        break;
      case 3:
        all.push_back({false, place::kMailboxOut, Bytes(place::kMailbox)});
        all.back().purpose = "fetch";
        break;
      default: {
        const bool write = random_.once(2);
        const unsigned at = random_.below(place::kMasterBytes - 32), length = 1 + random_.below(32);
        Bytes data(length);
        if (write)
          for (uint8_t& b : data) b = random_.byte();
        all.push_back({write, place::kMaster + at, data});
        all.back().purpose = "memory";
      }
    }
  if (all.empty()) all.push_back({false, 0x0000, Bytes(4)});
  return all;
}

void Master::use(const Datagram& d) {
  if (d.purpose == "memory") {
    if (d.counter != 1) throw Wrong("memory of the master is refused");
    const size_t at = d.address - place::kMaster;
    if (d.write) std::copy(d.data.begin(), d.data.end(), memory_.begin() + static_cast<long>(at));
    else if (!std::equal(d.data.begin(), d.data.end(), memory_.begin() + static_cast<long>(at)))
      throw Wrong("memory of the master has changed");
    return;
  }
  if (d.counter != 1) return;  // nothing there, or no place
  if (d.purpose == "outputs") ++outputs_;
  else if (d.purpose == "post") ++posted_, --toPost_;
  else {
    const int64_t number = d.purpose == "inputs" ? numberOf(d.data) : messageNumberOf(d.data);
    int64_t& last = d.purpose == "inputs" ? inputs_ : fetched_;
    if (number < 0) throw Wrong("the master has read a torn buffer: " + d.purpose);
    if (d.purpose == "inputs" ? number < last : number != last + 1)
      throw Wrong("the master has read an old, lost or doubled buffer: " + d.purpose);
    last = number;
  }
}

}  // namespace hosts

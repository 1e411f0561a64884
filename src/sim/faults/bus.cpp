#include "faults/bus.h"

#include "core/esc.h"
#include "core/wire.h"

namespace faults {

namespace {
constexpr size_t kEthernet = 14, kHeader = 10;
constexpr int64_t kNibbleNs = kNibble / kNs;

Bytes frameOf(const std::vector<Datagram>& datagrams, uint8_t index) {
  Bytes bytes{
      0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0, 1, 2, 3, 4, 5, esc::kEtherCat >> 8, esc::kEtherCat & 0xff, 0, 0};
  for (const Datagram& d : datagrams) {
    const size_t length = d.data.size() | (&d == &datagrams.back() ? 0 : 0x8000);
    bytes.push_back(d.command), bytes.push_back(index);
    for (int k = 0; k < 4; ++k) bytes.push_back(static_cast<uint8_t>(d.address >> (8 * k)));
    bytes.push_back(static_cast<uint8_t>(length)), bytes.push_back(static_cast<uint8_t>(length >> 8));
    bytes.insert(bytes.end(), {0, 0});
    bytes.insert(bytes.end(), d.data.begin(), d.data.end());
    bytes.insert(bytes.end(), {0, 0});
  }
  const size_t all = bytes.size() - kEthernet - 2;
  bytes[kEthernet] = static_cast<uint8_t>(all), bytes[kEthernet + 1] = static_cast<uint8_t>(0x10 | all >> 8);
  return bytes;
}

// Adds an answer to the datagrams: data, working counters. False if it is no answer to them.
bool add(const Bytes& answer, uint8_t index, std::vector<Datagram>& datagrams, bool first) {
  size_t at = kEthernet + 2;
  for (Datagram& d : datagrams) {
    if (answer.size() < at + kHeader + d.data.size() + 2) return false;
    if (answer[at] != d.command || answer[at + 1] != index) return false;
    at += kHeader;
    for (size_t i = 0; i < d.data.size(); ++i) {
      const uint8_t byte = answer[at + i];
      d.data[i] = static_cast<uint8_t>(first ? byte : d.data[i] | byte);
    }
    at += d.data.size();
    d.wkc += static_cast<unsigned>(answer[at] | answer[at + 1] << 8);
    at += 2;
  }
  return true;
}
}  // namespace

Datagram station(uint8_t command, unsigned slave, unsigned ado, Bytes data) {
  return {command, addressOf(slave) | ado << 16, std::move(data)};
}
Datagram broadcast(uint8_t command, unsigned ado, Bytes data) {
  return {command, ado << 16, std::move(data)};
}
Datagram logical(uint8_t command, uint32_t address, Bytes data) {
  return {command, address, std::move(data)};
}

Bus::Bus(const NetworkSpec& spec)
    : answers_(spec.ring ? 2 : 1),
      network_(
          spec,
          [] {
            NetworkOptions o;
            o.skipIdle = false;
            return o;
          }(),
          [this](int64_t, const NibbleFrame& f, size_t card) { returned(f, card); }) {}

void Bus::returned(const NibbleFrame& frame, size_t card) {
  Bytes bytes = goodFrame(frame);
  if (bytes.empty()) ++bad_;
  else answers_[card].push_back(std::move(bytes));
}

std::optional<std::vector<Datagram>> Bus::exchange(const std::vector<Datagram>& datagrams, int64_t afterNs,
                                                   const Within& within) {
  for (auto& a : answers_) a.clear();
  const Bytes frame = frameOf(datagrams, ++index_);
  for (size_t card = 0; card < network_.cards(); ++card) network_.send(frame, card);
  ++sent_;
  const int64_t began = network_.ns();
  bool done = !within;
  // What was pushed has not left yet, so that the network is not quiet.
  do {
    network_.step(network_.ns());
    if (!done && network_.ns() - began >= afterNs) within(), done = true;
  } while (!network_.quiet() || !done);
  std::vector<Datagram> answer = datagrams;
  bool any = false;
  for (auto& frames : answers_)
    for (const Bytes& bytes : frames) {
      if (!add(bytes, index_, answer, !any))
        violation_ = "a frame with a good FCS is not the one that was sent";
      any = true;
    }
  if (answers_[0].size() > 1 || answers_.back().size() > 1) violation_ = "a frame came back twice";
  if (any) return answer;
  ++lost_;
  return std::nullopt;
}

}  // namespace faults

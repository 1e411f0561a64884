// The simulated network as its master has it: datagrams out, answers back.
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "core/network.h"

namespace faults {

struct Datagram {
  uint8_t command;
  uint32_t address;  // ADP and ADO, or the logical address
  Bytes data;
  unsigned wkc = 0;
};

Datagram station(uint8_t command, unsigned slave, unsigned ado, Bytes data);
Datagram broadcast(uint8_t command, unsigned ado, Bytes data);
Datagram logical(uint8_t command, uint32_t address, Bytes data);

// The station address of a slave.
constexpr unsigned addressOf(size_t slave) { return static_cast<unsigned>(0x1000 + slave); }

class Bus {
 public:
  explicit Bus(const NetworkSpec& spec);

  // Sends a frame and waits until nothing moves any more: what came back, nothing if it is lost. In a ring it
  // leaves both ways; data and working counters of both answers are put together, so that data to be read
  // must be 0. `within`, if there is one, is called once, when the frame has been on its way for so long.
  using Within = std::function<void()>;
  std::optional<std::vector<Datagram>> exchange(const std::vector<Datagram>& datagrams, int64_t afterNs = 0,
                                                const Within& within = nullptr);
  void idle(int64_t ns) { network_.idleUntil(network_.ns() + ns); }

  Network& network() { return network_; }
  size_t slaves() const { return network_.size(); }
  uint64_t sent() const { return sent_; }
  uint64_t lost() const { return lost_; }
  uint64_t bad() const { return bad_; }  // came back with a wrong FCS, or as a runt
  // What came back is not what was sent, but for data and working counters; empty if that never happened.
  const std::string& violation() const { return violation_; }

 private:
  void returned(const NibbleFrame& frame, size_t card);

  std::vector<std::vector<Bytes>> answers_;  // good frames, by card
  Network network_;
  uint8_t index_ = 0;
  uint64_t sent_ = 0, lost_ = 0, bad_ = 0;
  std::string violation_;
};

}  // namespace faults

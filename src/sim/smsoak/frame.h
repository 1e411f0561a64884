// A frame of datagrams, and what its way through the core is in actions of the bus.
#pragma once

#include <functional>

#include "core/ethernet.h"
#include "smsoak/core.h"
#include "smsoak/history.h"

namespace smsoak {

constexpr unsigned kStation = 0x1001;

struct Datagram {
  uint8_t command;
  uint32_t address;  // ADP and ADO, or the logical address
  Bytes data;
  int reads = -1;  // local address of the first byte read, written; -1: none
  int writes = -1;
  bool checked = true;  // false: setting up, nothing of it is looked at
  // Found by Frame.
  size_t header = 0;
  int increment = 0;  // of the working counter; -1: it did not come back
  Bytes returned;     // data, as far as it came back
};

// A datagram to the station, and one to a logical address.
Datagram physical(bool read, bool write, unsigned address, Bytes data);
Datagram logical(bool read, bool write, uint32_t address, unsigned reads, unsigned writes, Bytes data);

enum class Fault { none, fcs, cut, receiveError };

class Frame {
 public:
  Frame(std::vector<Datagram> datagrams, Fault fault, unsigned where);

  const std::vector<Nibble>& symbols() const { return symbols_; }
  std::vector<Datagram>& datagrams() { return datagrams_; }
  bool good() const { return fault_ == Fault::none; }
  // Nibbles behind the SFD that are processed.
  size_t processed() const { return nibbles_; }
  // Fills in what the core has returned, and appends what it did. `firstStep`: number of the first datagram;
  // `managersAt`: whose memory.
  void finish(const Core& core, uint64_t firstStep, const std::function<unsigned(unsigned)>& managersAt,
              History& actions);
  // The last cycle in which the frame may have an effect.
  uint64_t last() const { return last_; }

 private:
  std::vector<Datagram> datagrams_;
  Fault fault_;
  std::vector<Nibble> symbols_;
  size_t nibbles_;
  uint64_t last_ = 0;
};

}  // namespace smsoak

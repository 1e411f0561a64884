// The master of the bus: frames without an end beside what the host does, each looked at when it is back.
#pragma once

#include <array>
#include <deque>
#include <optional>

#include "core/ethernet.h"
#include "hosts/core.h"
#include "smsoak/random.h"

namespace hosts {

using smsoak::Random;

// Where things lie in the RAM of 1 KiB: what both share, what the host has, what the master has.
namespace place {
constexpr unsigned kMailboxIn = 0x1000, kMailboxOut = 0x1020, kMailbox = 32;  // bytes
constexpr unsigned kOutputs = 0x1040, kInputs = 0x1070, kProcess = 16;        // bytes, three of each
constexpr unsigned kHost = 0x1100, kHostBytes = 0x200;
constexpr unsigned kMaster = 0x1300, kMasterBytes = 0x100;
}  // namespace place

// A whole buffer: its number, and bytes that follow from that.
Bytes stamped(uint32_t number, size_t length);
// Its number; -1: it is torn.
int64_t numberOf(const Bytes& stamped);

// The same as a message: the driver's header, and the buffer.
Bytes messageOf(uint32_t number);
int64_t messageNumberOf(const Bytes& message);

// An order to the slave, and what has come back.
struct Datagram {
  bool write;
  unsigned address;
  Bytes data;
  int counter = 0;
  std::string purpose = {};
};

class Master {
 public:
  Master(Core& core, Random& random);
  // One frame with one datagram, now; beside nothing else.
  Datagram pass(Datagram datagram);
  Datagram write(unsigned address, uint64_t value, unsigned bytes);

  // Frames from now on, as often as they fit, or none.
  void run(bool runs) { runs_ = runs; }
  // Messages to the host, until so many have been taken.
  void post(int messages) { toPost_ += messages; }
  bool posted() const { return toPost_ == 0; }
  bool idle() const { return !onWay_; }

  uint64_t frames() const { return frames_; }
  int64_t lastPosted() const { return posted_; }
  int64_t lastOutputs() const { return outputs_; }
  int64_t lastInputs() const { return inputs_; }
  int64_t lastFetched() const { return fetched_; }

 private:
  struct Frame {
    Bytes bytes;
    std::vector<Datagram> datagrams;
    bool foreign;  // for another station: it comes back as it was
  };
  void cycle();
  void send(std::vector<Datagram> datagrams, bool foreign);
  void take();
  void use(const Datagram& d);
  std::vector<Datagram> plan();

  Core& core_;
  Random& random_;
  std::optional<Frame> onWay_, back_;
  bool runs_ = false;
  int toPost_ = 0;
  uint64_t frames_ = 0, quietUntil_ = 0;
  int64_t posted_ = 0, outputs_ = 0, inputs_ = -1, fetched_ = 0;
  std::array<uint8_t, place::kMasterBytes> memory_{};
};

}  // namespace hosts

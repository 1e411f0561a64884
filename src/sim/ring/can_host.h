// CAN programs in a host's place at a port of a ring node, F or T: every frame that passes comes to them, and
// what they send leaves in their order.
#pragma once

#include <deque>
#include <utility>
#include <vector>

#include "board/board.h"
#include "ring/can_frame.h"

extern "C" {
#include "node/ring_node.h"
}

class CanHost : public FirmwareHost {
 public:
  // On a pair: at port T, with the bit rate of the pair.
  CanHost(BoardHardware& hardware, const ring_node_parameters& parameters, bool isOnPair)
      : FirmwareHost(hardware),
        parameters_(parameters),
        isOnPair_(isOnPair) {}
  ~CanHost() override { stop(); }

  // It waits behind those that were handed over before; `by` is told with what becomes of it.
  void send(const CanFrame& frame, const void* by) { waiting_.push_back({frame, by}); }
  size_t backlog() const { return waiting_.size() + (busy_ ? 1 : 0); }
  // What has happened since the last call, in its order.
  std::vector<CanEvent> events() { return std::exchange(events_, {}); }
  // Frames that the port has dropped. With bus errors not more than 255 until the controller is reset: the
  // register stops there.
  uint64_t overruns() const { return overruns_; }
  // Frames that the node has given up, as it was alone or reset.
  uint64_t failed() const { return failed_; }
  const CanFault& state() const { return last_; }
  // As the ring's registers have shown it.
  uint8_t ringState() const { return ringState_; }
  uint8_t ringPorts() const { return ringPorts_; }

 protected:
  void run() override;
  bool isWoken() override { return (!busy_ && !waiting_.empty()) || FirmwareHost::isWoken(); }

 private:
  bool start();
  // Of port T everything lies behind that of port F.
  uint16_t at(unsigned ofPortF) const { return static_cast<uint16_t>(ofPortF + (isOnPair_ ? kPorts : 0)); }
  bool hasBusErrors() const { return isOnPair_ || !parameters_.relay; }
  Time timeOf(uint16_t stamp);
  void receive();
  void sendNext();
  void lookAtFaults(bool isError);
  void countOverruns();
  void publish();

  static constexpr unsigned kPorts = 0x100;
  ring_node_parameters parameters_;
  bool isOnPair_;
  can_port port_{};
  struct Waiting {
    CanFrame frame;
    const void* by;
  };
  std::deque<Waiting> waiting_;
  Waiting onWire_{};
  bool busy_ = false;
  CanFault last_;
  uint8_t overrunsSeen_ = 0;
  uint64_t overruns_ = 0, failed_ = 0;
  uint8_t ringState_ = 0, ringPorts_ = 0;
  std::vector<CanEvent> pass_, events_;  // of this pass of the program, not yet published; published
};

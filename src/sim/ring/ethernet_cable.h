// The cable at port 0 of a node that has one: to the plant network, or to an EtherCAT master.
#pragma once

#include "core/slave.h"
#include "core/wire.h"

class EthernetCable {
 public:
  // A good frame of the node, and when it has left.
  struct Frame {
    Time at;
    Bytes bytes;
  };
  explicit EthernetCable(Slave& node);

  // A frame for the node leaves when those before have; beyond what a station takes in it is lost.
  void send(const Bytes& frame, Time now);
  // The node has power, or not: then what is on its way is lost.
  void setPower(bool on, Time now);
  // When a nibble leaves next.
  Time next() const { return powered_ && sender_.backlog() > 0 ? sender_.next : kNever; }
  void step() { sender_.step(); }
  // The frames of the node since the last call.
  std::vector<Frame> taken() { return std::exchange(frames_, {}); }
  uint64_t fromNode() const { return fromNode_; }
  uint64_t toNode() const { return toNode_; }
  Time lastSent() const { return lastSent_; }  // to the node

 private:
  Slave& node_;
  bool powered_ = true;
  std::vector<Frame> frames_;
  uint64_t fromNode_ = 0, toNode_ = 0;
  Time lastSent_ = 0;
  FrameCollector collector_;
  Sender sender_;
};

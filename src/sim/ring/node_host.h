// The host program of a ring node on its board, and what somebody at the bench wants of it.
#pragma once

#include <deque>
#include <map>
#include <set>

#include "board/board.h"

extern "C" {
#include "node/ring_node.h"
}

class RingNodeHost : public FirmwareHost {
 public:
  // A message that came, with its bytes.
  struct Message {
    Time at;
    unsigned source, pipe, number;
    bool toAll, urgent, repeat;
    Bytes data;
  };
  // How a message of this node has ended.
  struct End {
    unsigned tag;
    transport_outcome outcome;
    std::vector<unsigned> unconfirmed;
  };

  RingNodeHost(BoardHardware& hardware, const ring_node_parameters& parameters)
      : FirmwareHost(hardware, Passes::areTold),
        parameters_(parameters) {}
  ~RingNodeHost() override { stop(); }

  const ring_node& state() const { return node_; }
  // Takes the number of a message that is to be sent; how it ends is told under it.
  unsigned send(unsigned destination, bool urgent, const Bytes& data);
  // A value of process data; without bytes: no valid one. UserError if the transport has no place for it, nor
  // for one that is watched.
  void setObject(unsigned destination, unsigned number, const Bytes& data);
  void watch(unsigned source, unsigned number);
  void clearConflict() { clear_ = asked_ = true; }
  // Messages are left with the transport, which tells their senders BUSY, or refused.
  enum class Takes { all, none, refuses };
  void setTakes(Takes takes) { takes_ = takes, asked_ = true; }

  // What has come and ended since the last call, at most so many of the oldest.
  std::vector<Message> messages(size_t most);
  std::vector<End> ends();
  std::vector<unsigned> members() const;
  uint64_t received() const { return received_; }
  // The newest value of an object that is watched.
  struct Value {
    unsigned source, number;
    bool old;
    Bytes data;
  };
  std::vector<Value> values() const;

 protected:
  void run() override;
  bool isWoken() override { return asked_ || FirmwareHost::isWoken(); }

 private:
  struct Wanted {
    unsigned tag, destination;
    bool urgent;
    Bytes data;
  };
  struct Object {
    unsigned destination, number;
    Bytes data;
  };
  void take();
  void serveBench();

  ring_node_parameters parameters_;
  ring_node node_{};
  bool asked_ = false, clear_ = false;
  Takes takes_ = Takes::all;
  unsigned tag_ = 0;
  uint64_t received_ = 0;
  std::deque<Wanted> wanted_;
  std::map<unsigned, Bytes> underWay_;  // by tag: the transport does not copy them
  std::deque<Object> objects_;
  std::set<std::pair<unsigned, unsigned>> set_, watched_;  // objects: to whom, and of whom
  std::deque<Message> inbox_;
  std::deque<End> ends_;
};

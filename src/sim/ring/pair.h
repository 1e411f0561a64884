// A twisted pair: a CAN bus with the transceivers of its nodes.
#pragma once

#include <memory>
#include <vector>

#include "core/slave.h"

class Pair {
 public:
  // From a transceiver's TXD to all RXD.
  static constexpr Time kDelay = 150 * kNs;

  // Before it runs.
  void connect(Slave& slave);
  // A node that has no power is recessive.
  void release(const Slave& slave, Time now);
  // A transceiver that is stuck dominant, or not any more. Nobody runs meanwhile.
  void hold(bool dominant, Time now);
  // What nodes have driven until now arrives at all. Nobody runs meanwhile.
  void deliver();

 private:
  struct Member {
    Slave* slave = nullptr;                // none: what is stuck
    std::vector<Slave::LightEdge> driven;  // since the last delivery; its processor fills it
    bool level = true;
  };
  std::vector<std::unique_ptr<Member>> members_;
  bool level_ = true;
};

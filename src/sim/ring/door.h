// A door through which programs join a CAN port, or a recorder of it.
#pragma once

#include "ring/can_frame.h"
#include "ring/can_host.h"

class Door {
 public:
  virtual ~Door() = default;
  // Takes what programs have sent; never waits. Null: the port has no host now, frames are lost as on a bus
  // that nobody hears.
  virtual void serve(CanHost* port) = 0;
  // Something has happened at the port; what this door itself has sent, too.
  virtual void happened(const CanEvent& event) = 0;
  virtual std::string name() const = 0;

  // Frames for the port that are none; frames and answers for programs that do not read.
  uint64_t malformed() const { return malformed_; }
  uint64_t dropped() const { return dropped_; }

 protected:
  static constexpr size_t kBacklog = 1000;  // frames that may wait at the port
  uint64_t malformed_ = 0, dropped_ = 0;
};

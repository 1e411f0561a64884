// A CAN interface of Linux (AF_CAN), where the kernel has them (TL-05).
#pragma once

#include <string>

#include "ring/door.h"

class LinuxCanDoor : public Door {
 public:
  // `interface`: such as vcan0.
  explicit LinuxCanDoor(const std::string& interface);
  ~LinuxCanDoor() override;
  void serve(CanHost* port) override;
  void happened(const CanEvent& event) override;
  std::string name() const override { return "socketcan"; }

 private:
  int socket_;
};

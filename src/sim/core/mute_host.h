// The host program "mute": switches detector and reports of an alarm slave off, so that it says nothing.
#pragma once

#include "core/host.h"

class MuteHost : public Host {
 public:
  ~MuteHost() override { stop(); }
  std::string command(const std::vector<std::string>& words) override;

 protected:
  void run() override;
};

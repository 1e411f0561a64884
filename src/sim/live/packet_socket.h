// A Linux network interface as a network card: whole Ethernet frames without FCS, in and out.
#pragma once

#include <string>

#include "core/ethernet.h"

class PacketSocket {
 public:
  // Joins the interface, promiscuous. UserError if there is none of that name, it is down, or it may not be
  // joined.
  explicit PacketSocket(const std::string& interface);
  ~PacketSocket();
  PacketSocket(const PacketSocket&) = delete;

  // The next frame somebody else has sent; false if none is waiting.
  bool receive(Bytes& frame);
  void send(const Bytes& frame);
  int fd() const { return fd_; }

 private:
  [[noreturn]] void fail(const std::string& what) const;
  std::string interface_;
  int fd_ = -1;
};

// Frames between a gateway on the ring and an EtherCAT master at an interface of this computer.
#pragma once

#include <string>

#include "live/pacer.h"
#include "live/packet_socket.h"
#include "ring/ring.h"

class MasterLink {
 public:
  MasterLink(Ring& ring, const std::string& interface, double timeScale)
      : ring_(ring),
        card_(interface),
        scale_(timeScale),
        pacer_(timeScale, 0) {}
  // What has come goes to the gateway, what it has sent to the master. Without a frame on its way simulated
  // time waits until it is no longer ahead of `timeScale` times that of the wall clock.
  void serve();

 private:
  void waitForWall();
  Ring& ring_;
  PacketSocket card_;
  double scale_;
  Bytes frame_;
  Pacer pacer_;
};

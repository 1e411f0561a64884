// cannelloni over TCP: behind a word of welcome from either side, frames one behind the other (TL-01).
#pragma once

#include "ring/tcp_door.h"

class CannelloniStreamDoor : public TcpDoor {
 public:
  explicit CannelloniStreamDoor(uint16_t port) : TcpDoor(port) {}
  void happened(const CanEvent& event) override;
  std::string name() const override { return "cannelloni tcp"; }

 protected:
  std::string greeting() const override;
  void take(Client& client, CanHost* port) override;
  bool isWhole(const Client& client) const override;
};

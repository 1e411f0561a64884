// socketcand: CAN over TCP, in lines of text between < and > (TL-01).
#pragma once

#include <string>

#include "ring/tcp_door.h"

class SocketcandDoor : public TcpDoor {
 public:
  static constexpr const char* kBus = "can0";  // the name under which clients open the port
  explicit SocketcandDoor(uint16_t port) : TcpDoor(port) {}
  void happened(const CanEvent& event) override;
  std::string name() const override { return "socketcand"; }

 protected:
  std::string greeting() const override { return "< hi >"; }
  void take(Client& client, CanHost* port) override;
  bool isWhole(const Client& client) const override { return client.in.find('>') != std::string::npos; }

 private:
  std::string answer(Client& client, const std::string& words, CanHost* port);
  bool send(Client& client, const std::string& words, CanHost* port);
};

// socketcand: CAN over TCP, in lines of text between < and > (TL-01).
#pragma once

#include <cstdint>
#include <list>
#include <string>

#include "ring/door.h"

class SocketcandDoor : public Door {
 public:
  static constexpr const char* kBus = "can0";  // the name under which clients open the port
  explicit SocketcandDoor(uint16_t port);
  ~SocketcandDoor() override;
  void serve(CanHost* port) override;
  void happened(const CanEvent& event) override;
  std::string name() const override { return "socketcand"; }

 private:
  struct Client {
    int fd;
    uintptr_t number;  // frames are known by it, also when the client has left
    std::string in, out;
    bool open = false, raw = false, ended = false, gone = false;
  };
  static const void* name(const Client& c) { return reinterpret_cast<const void*>(c.number); }
  void take(Client& client, CanHost* port);
  std::string answer(Client& client, const std::string& words, CanHost* port);
  bool send(Client& client, const std::string& words, CanHost* port);
  void say(Client& client, const std::string& text);
  void flush(Client& client);

  int listener_;
  std::list<Client> clients_;
  uintptr_t last_ = 0;  // number of a client; no address is as low
};

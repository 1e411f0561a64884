// A door on TCP: programs that have connected, and what waits for them.
#pragma once

#include <cstdint>
#include <list>
#include <string>

#include "ring/door.h"

class TcpDoor : public Door {
 public:
  ~TcpDoor() override;
  void serve(CanHost* port) override;

 protected:
  struct Client {
    int fd;
    uintptr_t number;  // frames are known by it, also when the client has left
    std::string in, out;
    bool open = false, raw = false;
    bool ended = false, deaf = false, gone = false;  // nothing comes, nothing can be told, nothing counts
  };
  explicit TcpDoor(uint16_t port);
  static const void* sender(const Client& c) { return reinterpret_cast<const void*>(c.number); }
  // What a client is told first.
  virtual std::string greeting() const = 0;
  // Carries out what a client has sent, and removes it from `in`. A frame that finds no place at the port
  // stays there.
  virtual void take(Client& client, CanHost* port) = 0;
  // Something in `in` is whole; what a client has sent before it left is still carried out.
  virtual bool isWhole(const Client& client) const = 0;
  void say(Client& client, const std::string& text);

  std::list<Client> clients_;

 private:
  void admit();
  void read(Client& client);
  void flush(Client& client);

  int listener_;
  inline static uintptr_t last_ = 0;  // number of a client of any door; no address is as low
};

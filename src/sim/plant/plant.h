// The plant network behind a master or a ring's gateway: a network of its own (10.0.2.0/24) in user space, by
// libslirp. Datagrams to 10.0.2.2 leave as ordinary ones to 127.0.0.1, what is answered comes back. Needs no
// privileges.
#pragma once

#include <array>
#include <functional>
#include <list>
#include <memory>
#include <vector>

#include <poll.h>

#include "core/ethernet.h"

struct Slirp;

class Plant {
 public:
  // The stations in it, as the node must know them.
  static constexpr std::array<uint8_t, 4> kNodeIp{10, 0, 2, 15}, kServerIp{10, 0, 2, 2};
  static constexpr std::array<uint8_t, 6> kServerMac{0x52, 0x55, 10, 0, 2, 2};  // as libslirp makes it

  explicit Plant(std::function<void(const Bytes&)> toNode);
  ~Plant();
  Plant(const Plant&) = delete;

  void fromNode(const Bytes& frame);
  // Takes what has come from the computer; never waits.
  void poll();

 private:
  struct Timer {
    void (*callback)(void*);
    void* opaque;
    int64_t atMs = -1;  // never
  };
  struct Callbacks;
  friend struct Callbacks;
  void deliver();

  std::function<void(const Bytes&)> toNode_;
  std::vector<Bytes> waiting_;  // for the node
  std::list<Timer> timers_;
  std::vector<pollfd> fds_;
  Slirp* slirp_ = nullptr;
};

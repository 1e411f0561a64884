#include "ring/linux_can.h"

#include <linux/can.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "core/user_error.h"
#include "ring/socketcan.h"

LinuxCanDoor::LinuxCanDoor(const std::string& interface)
    : socket_(socket(PF_CAN, SOCK_RAW | SOCK_NONBLOCK | SOCK_CLOEXEC, CAN_RAW)) {
  if (socket_ < 0) throw UserError(std::string("this kernel has no AF_CAN: ") + std::strerror(errno) + ".");
  sockaddr_can address{};
  address.can_family = AF_CAN;
  address.can_ifindex = static_cast<int>(if_nametoindex(interface.c_str()));
  if (address.can_ifindex == 0 || bind(socket_, reinterpret_cast<sockaddr*>(&address), sizeof address) < 0) {
    close(socket_);
    throw UserError("'" + interface + "' is no CAN interface that can be had.");
  }
}

LinuxCanDoor::~LinuxCanDoor() { close(socket_); }

// What waits at the port is not read from the interface, whose queue then fills as that of a slow bus does.
void LinuxCanDoor::serve(CanHost* port) {
  can_frame f;
  // Only so many at a time: a program that never ends would stop the simulation.
  for (int left = 8; left > 0 && (!port || port->backlog() < kBacklog); --left) {
    if (read(socket_, &f, sizeof f) != static_cast<ssize_t>(sizeof f)) return;
    const auto frame = socketcan::canFrame(f.can_id, f.can_dlc, f.data);
    if (!frame) ++malformed_;
    else if (!port) ++dropped_;
    else port->send(*frame, this);
  }
}

void LinuxCanDoor::happened(const CanEvent& e) {
  if (e.kind == CanEvent::sent && e.by == this) return;
  const auto s = socketcan::of(e);
  if (!s) return;
  can_frame f{};
  f.can_id = s->id;
  f.can_dlc = s->length;
  std::copy(s->data.begin(), s->data.end(), f.data);
  if (write(socket_, &f, sizeof f) < 0) ++dropped_;
}

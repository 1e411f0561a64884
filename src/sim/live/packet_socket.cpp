#include "live/packet_socket.h"

#include <arpa/inet.h>
#include <linux/if_ether.h>
#include <linux/if_packet.h>
#include <net/if.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "core/user_error.h"

#ifndef PACKET_IGNORE_OUTGOING  // Linux 4.20
#define PACKET_IGNORE_OUTGOING 23
#endif

namespace {
template <class T>
bool set(int fd, int level, int option, const T& value) {
  return setsockopt(fd, level, option, &value, sizeof value) == 0;
}
}  // namespace

void PacketSocket::fail(const std::string& what) const {
  const int error = errno;
  if (fd_ >= 0) close(fd_);
  throw UserError("cannot " + what + " the interface '" + interface_ + "': " + std::strerror(error) + ".");
}

PacketSocket::PacketSocket(const std::string& interface) : interface_(interface) {
  const unsigned index = if_nametoindex(interface.c_str());
  if (index == 0) throw UserError("there is no network interface '" + interface + "'.");
  fd_ = socket(AF_PACKET, SOCK_RAW | SOCK_CLOEXEC, htons(ETH_P_ALL));
  if (fd_ < 0 && (errno == EPERM || errno == EACCES))
    throw UserError("joining the interface '" + interface + "' needs root or the capability CAP_NET_RAW.");
  if (fd_ < 0) fail("join");
  ifreq request{};
  std::strncpy(request.ifr_name, interface.c_str(), IFNAMSIZ - 1);
  if (ioctl(fd_, SIOCGIFFLAGS, &request) < 0) fail("join");
  if (!(request.ifr_flags & IFF_UP)) {
    close(fd_);
    throw UserError("the interface '" + interface + "' is down.");
  }
  set(fd_, SOL_PACKET, PACKET_IGNORE_OUTGOING, int{1});  // an older kernel tells by the packet type
  set(fd_, SOL_PACKET, PACKET_AUXDATA, int{1});
  sockaddr_ll address{};
  address.sll_family = AF_PACKET;
  address.sll_protocol = htons(ETH_P_ALL);
  address.sll_ifindex = static_cast<int>(index);
  if (bind(fd_, reinterpret_cast<sockaddr*>(&address), sizeof address) < 0) fail("join");
  packet_mreq membership{};
  membership.mr_ifindex = static_cast<int>(index);
  membership.mr_type = PACKET_MR_PROMISC;
  if (!set(fd_, SOL_PACKET, PACKET_ADD_MEMBERSHIP, membership)) fail("set promiscuous");
  Bytes early;  // what came between socket() and bind(), of other interfaces too
  while (receive(early)) {
  }
}

PacketSocket::~PacketSocket() {
  if (fd_ >= 0) close(fd_);
}

bool PacketSocket::receive(Bytes& frame) {
  while (true) {
    frame.resize(2048);
    sockaddr_ll from{};
    alignas(cmsghdr) char control[CMSG_SPACE(sizeof(tpacket_auxdata))];
    iovec part{frame.data(), frame.size()};
    msghdr message{};
    message.msg_name = &from, message.msg_namelen = sizeof from;
    message.msg_iov = &part, message.msg_iovlen = 1;
    message.msg_control = control, message.msg_controllen = sizeof control;
    const ssize_t n = recvmsg(fd_, &message, MSG_DONTWAIT);
    if (n < 0 && (errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR)) return false;
    if (n < 0 && errno == ENETDOWN) throw UserError("the interface '" + interface_ + "' went down.");
    if (n < 0)
      throw UserError("cannot receive from the interface '" + interface_ + "': " + std::strerror(errno) +
                      ".");
    if (from.sll_pkttype == PACKET_OUTGOING || (message.msg_flags & MSG_TRUNC)) continue;
    frame.resize(static_cast<size_t>(n));
    if (n < 14) continue;
    // The kernel takes a VLAN tag out of the frame and tells it beside it.
    for (cmsghdr* c = CMSG_FIRSTHDR(&message); c; c = CMSG_NXTHDR(&message, c)) {
      if (c->cmsg_level != SOL_PACKET || c->cmsg_type != PACKET_AUXDATA) continue;
      tpacket_auxdata aux;
      std::memcpy(&aux, CMSG_DATA(c), sizeof aux);
      if (!(aux.tp_status & TP_STATUS_VLAN_VALID)) continue;
      const uint16_t type = aux.tp_status & TP_STATUS_VLAN_TPID_VALID ? aux.tp_vlan_tpid : 0x8100;
      const uint8_t tag[] = {static_cast<uint8_t>(type >> 8), static_cast<uint8_t>(type),
                             static_cast<uint8_t>(aux.tp_vlan_tci >> 8),
                             static_cast<uint8_t>(aux.tp_vlan_tci)};
      frame.insert(frame.begin() + 12, std::begin(tag), std::end(tag));
    }
    return true;
  }
}

void PacketSocket::send(const Bytes& frame) {
  if (::send(fd_, frame.data(), frame.size(), 0) >= 0 || errno == ENOBUFS || errno == EAGAIN ||
      errno == EMSGSIZE)
    return;
  throw UserError("cannot send into the interface '" + interface_ + "': " + std::strerror(errno) + ".");
}

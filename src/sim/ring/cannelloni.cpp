#include "ring/cannelloni.h"

#include <vector>

#include "ring/cannelloni_frame.h"
#include "ring/loopback.h"

namespace {
constexpr uint8_t kVersion = 2, kData = 0;
constexpr size_t kHead = 5, kMost = 1472;  // bytes of a datagram
}  // namespace

CannelloniDoor::CannelloniDoor(uint16_t port, uint16_t peer)
    : socket_(loopbackSocket(SOCK_DGRAM, port)),
      peer_(peer),
      learns_(peer == 0) {}

CannelloniDoor::~CannelloniDoor() { close(socket_); }

// The frames of a datagram are taken all or none. Those of CAN FD among them find no bus, and are dropped.
bool CannelloniDoor::take(const uint8_t* d, size_t length, CanHost* port) {
  if (length < kHead || d[0] != kVersion || d[1] != kData) return false;
  if (heard_ && d[2] != wanted_) ++gaps_;
  heard_ = true;
  wanted_ = static_cast<uint8_t>(d[2] + 1);
  unsigned fds = 0;
  std::vector<CanFrame> frames;
  size_t at = kHead;
  for (int left = d[3] << 8 | d[4]; left > 0; --left) {
    const cannelloni::Found found = cannelloni::find(d + at, length - at);
    if (found.bytes == 0 || found.isMalformed) return false;
    if (found.frame) frames.push_back(*found.frame);
    else ++fds;
    at += found.bytes;
  }
  if (at != length) return false;
  dropped_ += fds;
  for (const CanFrame& f : frames)
    if (!port || port->backlog() >= kBacklog) ++dropped_;
    else port->send(f, this);
  return true;
}

void CannelloniDoor::serve(CanHost* port) {
  uint8_t buffer[65536];
  sockaddr_in from;
  socklen_t size = sizeof from;
  // Only so many at a time: a program that never ends would stop the simulation.
  for (int left = 8; left > 0; --left) {
    const ssize_t n = recvfrom(socket_, buffer, sizeof buffer, 0, reinterpret_cast<sockaddr*>(&from), &size);
    if (n < 0) break;
    if (!learns_ && ntohs(from.sin_port) != peer_) ++malformed_;
    else if (!take(buffer, static_cast<size_t>(n), port)) ++malformed_;
    else if (learns_) peer_ = ntohs(from.sin_port);
    size = sizeof from;
  }
  flush();
}

void CannelloniDoor::flush() {
  if (count_ == 0) return;
  if (peer_ != 0) { // else nobody has joined
    Bytes datagram = {kVersion, kData, sequence_++, static_cast<uint8_t>(count_ >> 8),
                      static_cast<uint8_t>(count_)};
    datagram.insert(datagram.end(), frames_.begin(), frames_.end());
    const sockaddr_in to = loopbackAddress(peer_);
    if (sendto(socket_, datagram.data(), datagram.size(), 0, reinterpret_cast<const sockaddr*>(&to),
               sizeof to) < 0)
      dropped_ += count_;
  }
  frames_.clear();
  count_ = 0;
}

void CannelloniDoor::happened(const CanEvent& e) {
  const bool isFrame = e.kind == CanEvent::received || (e.kind == CanEvent::sent && e.by != this);
  if (!isFrame) return;
  const std::string frame = cannelloni::bytesOf(e.frame);
  if (kHead + frames_.size() + frame.size() > kMost) flush();
  frames_.insert(frames_.end(), frame.begin(), frame.end());
  ++count_;
}

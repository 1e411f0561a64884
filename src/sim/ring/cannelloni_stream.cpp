#include "ring/cannelloni_stream.h"

#include <algorithm>

#include "ring/cannelloni_frame.h"

namespace {
constexpr const char* kWelcome = "CANNELLONIv1";

cannelloni::Found first(const std::string& in, size_t at) {
  return cannelloni::find(reinterpret_cast<const uint8_t*>(in.data()) + at, in.size() - at);
}
}  // namespace

std::string CannelloniStreamDoor::greeting() const { return kWelcome; }

// If nobody knows where the next frame begins the client is sent away.
void CannelloniStreamDoor::take(Client& c, CanHost* port) {
  const std::string welcome = kWelcome;
  if (!c.open) {
    const size_t there = std::min(c.in.size(), welcome.size());
    if (c.in.compare(0, there, welcome, 0, there) != 0) {
      ++malformed_;
      c.gone = true;
    }
    if (c.gone || there < welcome.size()) return;
    c.in.erase(0, welcome.size());
    c.open = true;
  }
  size_t at = 0;
  while (!port || port->backlog() < kBacklog) {
    const cannelloni::Found found = first(c.in, at);
    if (found.isMalformed) ++malformed_;
    if (found.bytes == 0) {
      c.gone = found.isMalformed;
      break;
    }
    at += found.bytes;
    if (found.isMalformed) continue;
    if (port && found.frame) port->send(*found.frame, sender(c));
    else ++dropped_;
  }
  c.in.erase(0, at);
}

bool CannelloniStreamDoor::isWhole(const Client& c) const { return c.open && first(c.in, 0).bytes > 0; }

void CannelloniStreamDoor::happened(const CanEvent& e) {
  if (e.kind != CanEvent::received && e.kind != CanEvent::sent) return;
  CanFrame sent = e.frame;
  if (sent.remote) sent.dlc = 0;  // python-can would wait for data
  const std::string frame = cannelloni::bytesOf(sent);
  for (Client& c : clients_)
    if (c.open && e.by != sender(c)) say(c, frame);
}

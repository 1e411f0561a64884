#include "ring/tcp_door.h"

#include <algorithm>

#include "ring/loopback.h"

namespace {
constexpr size_t kClients = 16;
constexpr size_t kUnread = 4 << 20;  // bytes that wait for a client; then it is gone
constexpr size_t kPiece = 4096;      // that are read at a time
}  // namespace

TcpDoor::TcpDoor(uint16_t port) : listener_(loopbackSocket(SOCK_STREAM, port)) {}

TcpDoor::~TcpDoor() {
  for (Client& c : clients_) close(c.fd);
  close(listener_);
}

void TcpDoor::say(Client& c, const std::string& text) {
  if (c.deaf) return;
  if (c.out.size() + text.size() > kUnread) {
    ++dropped_;
    c.gone = true;
    return;
  }
  c.out += text;
  flush(c);
}

// A client that does not listen any more may have sent what has still to be carried out.
void TcpDoor::flush(Client& c) {
  if (c.out.empty() || c.gone) return;
  const ssize_t n = ::send(c.fd, c.out.data(), c.out.size(), MSG_NOSIGNAL);
  if (n > 0) c.out.erase(0, static_cast<size_t>(n));
  else if (n < 0 && errno != EAGAIN && errno != EWOULDBLOCK && errno != EINTR) c.deaf = true;
  if (c.deaf) c.out.clear();
}

// A client whose next frame finds no place at the port is not read until there is one, as by a slow bus.
void TcpDoor::read(Client& c) {
  char buffer[kPiece];
  while (!c.gone && !c.ended && c.in.size() <= sizeof buffer) {
    const ssize_t n = recv(c.fd, buffer, sizeof buffer, 0);
    if (n > 0) {
      c.in.append(buffer, static_cast<size_t>(n));
      continue;
    }
    if (n == 0 || (errno != EAGAIN && errno != EWOULDBLOCK && errno != EINTR)) c.ended = true;
    break;
  }
}

// If all places are taken, that of the first client that has opened nothing.
void TcpDoor::admit() {
  for (size_t left = kClients; left > 0; --left) {
    const int fd = accept4(listener_, nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC);
    if (fd < 0) return;
    if (clients_.size() >= kClients) {
      const auto idle =
          std::find_if(clients_.begin(), clients_.end(), [](const Client& c) { return !c.open; });
      close(idle == clients_.end() ? fd : idle->fd);
      ++dropped_;
      if (idle == clients_.end()) continue;
      clients_.erase(idle);
    }
    clients_.push_back({fd, ++last_, "", ""});
    say(clients_.back(), greeting());
  }
}

void TcpDoor::serve(CanHost* port) {
  // Who sends goes to the end, so that the next place at a full port is another one's.
  auto c = clients_.begin();
  for (size_t left = clients_.size(); left > 0; --left) {
    const auto now = c++;
    const size_t backlog = port ? port->backlog() : 0;
    read(*now);
    take(*now, port);
    flush(*now);
    if (port && port->backlog() > backlog) clients_.splice(clients_.end(), clients_, now);
    if (now->gone || (now->ended && !isWhole(*now))) {
      if (!now->gone && !now->in.empty()) ++malformed_;
      close(now->fd);
      clients_.erase(now);
    }
  }
  admit();
}

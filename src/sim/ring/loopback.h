// Sockets of the internet protocol, on the loopback interface only.
#pragma once

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <string>

#include "core/user_error.h"

inline sockaddr_in loopbackAddress(uint16_t port) {
  sockaddr_in a{};
  a.sin_family = AF_INET;
  a.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  a.sin_port = htons(port);
  return a;
}

// A socket that never waits, bound to a port of 127.0.0.1; `type`: SOCK_STREAM or SOCK_DGRAM.
inline int loopbackSocket(int type, uint16_t port) {
  const int fd = socket(AF_INET, type | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  const int on = 1;
  const sockaddr_in a = loopbackAddress(port);
  if (fd >= 0 && type == SOCK_STREAM) setsockopt(fd, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
  if (fd < 0 || bind(fd, reinterpret_cast<const sockaddr*>(&a), sizeof a) < 0 ||
      (type == SOCK_STREAM && listen(fd, 8) < 0)) {
    const std::string why = std::strerror(errno);
    if (fd >= 0) close(fd);
    throw UserError("port " + std::to_string(port) + " of 127.0.0.1 cannot be had: " + why + ".");
  }
  return fd;
}

#include "core/control.h"

#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <sstream>

#include "core/user_error.h"

namespace {
constexpr size_t kLongest = 65536;  // of a line

bool isLater() { return errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR; }

// A program listens there.
bool isServed(const sockaddr_un& address) {
  const int fd = socket(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  const bool served =
      connect(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0 || isLater();
  close(fd);
  return served;
}
}  // namespace

Control::Control(const std::string& path, OnLine onLine) : path_(path), onLine_(std::move(onLine)) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.size() >= sizeof address.sun_path) throw UserError("the control path '" + path + "' is too long.");
  std::strcpy(address.sun_path, path.c_str());
  struct stat there;
  if (lstat(path.c_str(), &there) == 0) {
    if (!S_ISSOCK(there.st_mode)) throw UserError("'" + path + "' is there already and is no socket.");
    if (isServed(address)) throw UserError("another program listens at '" + path + "'.");
    unlink(path.c_str());
  }
  listener_ = socket(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  if (listener_ < 0 || bind(listener_, reinterpret_cast<sockaddr*>(&address), sizeof address) < 0 ||
      listen(listener_, 8) < 0) {
    const std::string why = std::strerror(errno);
    if (listener_ >= 0) close(listener_);
    throw UserError("cannot listen at '" + path + "': " + why + ".");
  }
  if (lstat(path.c_str(), &there) == 0) device_ = there.st_dev, inode_ = there.st_ino;
}

Control::~Control() {
  for (auto& [fd, client] : clients_) close(fd);
  struct stat there;
  if (lstat(path_.c_str(), &there) == 0 && there.st_dev == device_ && there.st_ino == inode_)
    unlink(path_.c_str());
  close(listener_);
}

void Control::wanted(std::vector<pollfd>& fds) const {
  fds.push_back({listener_, POLLIN, 0});
  for (auto& [fd, client] : clients_)
    fds.push_back({fd, static_cast<short>(client.out.empty() ? POLLIN : POLLOUT), 0});
}

void Control::serve() {
  for (int fd; (fd = accept4(listener_, nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC)) >= 0;) clients_[fd];
  for (auto it = clients_.begin(); it != clients_.end();) {
    auto& [fd, client] = *it;
    take(fd, client);
    if (client.gone || (client.ended && client.out.empty())) close(fd), it = clients_.erase(it);
    else ++it;
  }
}

void Control::flush(int fd, Client& client) {
  while (!client.out.empty()) {
    const ssize_t n = send(fd, client.out.data(), client.out.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
    if (n < 0) client.gone = !isLater();
    if (n <= 0) return;
    client.out.erase(0, static_cast<size_t>(n));
  }
}

// A client that does not read its answers is not read either, and nobody is read without end: the simulation
// would stop.
void Control::take(int fd, Client& client) {
  char buffer[4096];
  while (!client.ended && client.out.empty() && client.in.size() < kLongest) {
    const ssize_t n = recv(fd, buffer, sizeof buffer, MSG_DONTWAIT);
    if (n == 0) client.ended = true;
    if (n < 0) client.gone = !isLater();
    if (n <= 0) break;
    client.in.append(buffer, static_cast<size_t>(n));
    if (!client.skips) continue;
    const size_t end = client.in.find('\n');
    client.skips = end == std::string::npos;
    client.in.erase(0, client.skips ? end : end + 1);
  }
  flush(fd, client);
  for (size_t end; client.out.empty() && (end = client.in.find('\n')) != std::string::npos;) {
    client.out = answer(client.in.substr(0, end)) + "\n";
    client.in.erase(0, end + 1);
    flush(fd, client);
  }
  if (client.out.empty() && client.in.size() >= kLongest) {
    client.out = "error: a line may have " + std::to_string(kLongest) + " characters.\n";
    client.in.clear();
    client.skips = true;
    flush(fd, client);
  }
}

std::string Control::answer(const std::string& line) const {
  std::istringstream in(line);
  std::vector<std::string> words;
  for (std::string w; in >> w;) words.push_back(w);
  try {
    const std::string text = onLine_(words);
    return text.empty() ? "ok" : "ok " + text;
  } catch (const UserError& e) {
    return std::string("error: ") + e.what();
  }
}

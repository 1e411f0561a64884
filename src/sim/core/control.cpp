#include "core/control.h"

#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <sstream>

#include "core/user_error.h"

Control::Control(const std::string& path, OnLine onLine) : path_(path), onLine_(std::move(onLine)) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.size() >= sizeof address.sun_path) throw UserError("the control path '" + path + "' is too long.");
  std::strcpy(address.sun_path, path.c_str());
  struct stat there;
  if (stat(path.c_str(), &there) == 0) {
    if (!S_ISSOCK(there.st_mode)) throw UserError("'" + path + "' is there already and is no socket.");
    unlink(path.c_str());
  }
  listener_ = socket(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  if (listener_ < 0 || bind(listener_, reinterpret_cast<sockaddr*>(&address), sizeof address) < 0 ||
      listen(listener_, 8) < 0) {
    const std::string why = std::strerror(errno);
    if (listener_ >= 0) close(listener_);
    throw UserError("cannot listen at '" + path + "': " + why + ".");
  }
}

Control::~Control() {
  for (auto& [fd, text] : clients_) close(fd);
  close(listener_);
  unlink(path_.c_str());
}

void Control::wanted(std::vector<pollfd>& fds) const {
  fds.push_back({listener_, POLLIN, 0});
  for (auto& [fd, text] : clients_) fds.push_back({fd, POLLIN, 0});
}

void Control::serve() {
  for (int fd; (fd = accept4(listener_, nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC)) >= 0;) clients_[fd];
  for (auto it = clients_.begin(); it != clients_.end();) {
    auto& [fd, text] = *it;
    char buffer[512];
    ssize_t n;
    while ((n = recv(fd, buffer, sizeof buffer, MSG_DONTWAIT)) > 0)
      text.append(buffer, static_cast<size_t>(n));
    const bool gone = n == 0 || (errno != EAGAIN && errno != EWOULDBLOCK && errno != EINTR);
    for (size_t end; (end = text.find('\n')) != std::string::npos;) {
      const std::string reply = answer(text.substr(0, end)) + "\n";
      text.erase(0, end + 1);
      send(fd, reply.data(), reply.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
    }
    if (gone) close(fd), it = clients_.erase(it);
    else ++it;
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

// A Unix socket that takes lines of text and answers each with one line.
#pragma once

#include <poll.h>
#include <sys/types.h>

#include <functional>
#include <map>
#include <string>
#include <vector>

class Control {
 public:
  // What a line asks for; its answer, empty for a plain "ok". A UserError becomes "error: ...".
  using OnLine = std::function<std::string(const std::vector<std::string>& words)>;

  // Listens at `path`; replaces a socket left there, nothing else. At the end it removes its own one only.
  Control(const std::string& path, OnLine onLine);
  ~Control();
  Control(const Control&) = delete;

  // The descriptors to wait for.
  void wanted(std::vector<pollfd>& fds) const;
  // Takes what has come; never waits.
  void serve();

 private:
  // What has come of a client's next line, and what it has not read yet of the answers; whether the rest of a
  // line that is too long is skipped, it sends no more, and has left.
  struct Client {
    std::string in, out;
    bool skips = false, ended = false, gone = false;
  };
  static void flush(int fd, Client& client);
  void take(int fd, Client& client);
  std::string answer(const std::string& line) const;

  std::string path_;
  OnLine onLine_;
  int listener_ = -1;
  dev_t device_ = 0;
  ino_t inode_ = 0;
  std::map<int, Client> clients_;  // by their descriptors
};

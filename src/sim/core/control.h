// A Unix socket that takes lines of text and answers each with one line.
#pragma once

#include <poll.h>

#include <functional>
#include <map>
#include <string>
#include <vector>

class Control {
 public:
  // What a line asks for; its answer, empty for a plain "ok". A UserError becomes "error: ...".
  using OnLine = std::function<std::string(const std::vector<std::string>& words)>;

  // Listens at `path`; replaces a socket left there, nothing else.
  Control(const std::string& path, OnLine onLine);
  ~Control();
  Control(const Control&) = delete;

  // The descriptors to wait for.
  void wanted(std::vector<pollfd>& fds) const;
  // Takes what has come; never waits.
  void serve();

 private:
  std::string answer(const std::string& line) const;

  std::string path_;
  OnLine onLine_;
  int listener_ = -1;
  std::map<int, std::string> clients_;  // what has come of each one's next line
};

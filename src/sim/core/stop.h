// When a program that serves has to end.
#pragma once

#include <unistd.h>

#include <csignal>

class Stop {
 public:
  // At the beginning of a program: who has started it must still be there.
  Stop() : parent_(getppid()) {}

  // From now on SIGINT, SIGTERM and SIGHUP count; if `withParent`, also the end of who has started it.
  void listen(bool withParent) {
    withParent_ = withParent;
    for (int s : {SIGINT, SIGTERM, SIGHUP}) {
      const auto before = std::signal(s, [](int) { signalled_ = 1; });
      if (s == SIGHUP && before == SIG_IGN) std::signal(s, SIG_IGN);  // nohup
    }
  }
  bool isWanted() const { return signalled_ || (withParent_ && getppid() != parent_); }

 private:
  static inline volatile std::sig_atomic_t signalled_ = 0;
  pid_t parent_;
  bool withParent_ = false;
};

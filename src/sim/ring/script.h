// Lines of the control socket from a file, each at its time: such a run is the same each time.
#pragma once

#include <deque>
#include <string>
#include <vector>

#include "core/simulator.h"
#include "core/user_error.h"

class Script {
 public:
  // Lines `US COMMAND...` in order of time, others begin with #; without a path there are none.
  explicit Script(const std::string& path);
  // When the next one is due; never, if there is none.
  Time next() const { return lines_.empty() ? kNever : lines_.front().at; }
  // Carries out what is due at `now`. What is wrong with a line is a UserError.
  template <class Command>
  void run(Time now, Command command) {
    while (next() <= now) {
      const Line line = lines_.front();
      lines_.pop_front();
      perform(line, [&] { command(line.words); });
    }
  }

 private:
  struct Line {
    Time at;
    size_t number;
    std::vector<std::string> words;
  };
  template <class Act>
  void perform(const Line& line, Act act);
  [[noreturn]] void bad(size_t number, const std::string& why) const;
  std::string path_;
  std::deque<Line> lines_;
};

template <class Act>
void Script::perform(const Line& line, Act act) {
  try {
    act();
  } catch (const UserError& e) {
    bad(line.number, e.what());
  }
}

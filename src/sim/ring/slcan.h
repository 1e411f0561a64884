// slcan on a pseudo-terminal: the protocol of serial CAN adapters (TL-01).
#pragma once

#include <termios.h>

#include <deque>
#include <optional>
#include <string>

#include "ring/door.h"

class SlcanDoor : public Door {
 public:
  // `path` becomes a link to the terminal; one that a simulator has left there is replaced, nothing else.
  explicit SlcanDoor(const std::string& path);
  ~SlcanDoor() override;
  void serve(CanHost* port) override;
  void happened(const CanEvent& event) override;
  std::string name() const override { return "slcan"; }

 private:
  std::string answer(const std::string& command, CanHost* port);
  std::string send(const std::string& command, CanHost* port);
  // Of a command that sends, if frames may be sent now.
  std::optional<CanFrame> frameOf(const std::string& command) const;
  bool hear();
  bool take(CanHost* port);
  bool waits(CanHost* port);
  void leave();
  // The program at the terminal, as the port knows it.
  const void* program() const { return &programs_.back(); }
  std::string flags(const CanHost* port);
  void say(const std::string& text);
  void flush();

  std::string path_, terminalName_;
  int terminal_ = -1;
  termios raw_;
  std::deque<char> programs_{0};   // one for each; their places tell them apart
  std::string unread_, in_, out_;  // what is still to be carried out, a line that has begun, what leaves
  bool used_ = false;              // a program has the terminal, or had it in the last pass
  unsigned waited_ = 0;            // passes without a place at the port
  bool open_ = false, listenOnly_ = false, stamps_ = false, tooLong_ = false;
  bool overrun_ = false, busError_ = false;
};

// slcan on a pseudo-terminal: the protocol of serial CAN adapters (TL-01).
#pragma once

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
  void leave();
  std::string flags(const CanHost* port);
  void say(const std::string& text);
  void flush();

  std::string path_, terminalName_;
  int terminal_ = -1;
  std::string unread_, in_, out_;  // what is still to be carried out, a line that has begun, what leaves
  bool used_ = false;              // by a program
  bool open_ = false, listenOnly_ = false, stamps_ = false, tooLong_ = false;
  bool overrun_ = false, busError_ = false;
};

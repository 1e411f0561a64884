// slcan on a pseudo-terminal: the protocol of serial CAN adapters (TL-01).
#pragma once

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
  bool send(const std::string& command, CanHost* port);
  std::string flags(const CanHost* port);
  void say(const std::string& text);
  void flush();

  std::string path_, terminalName_;
  int terminal_ = -1, otherEnd_ = -1;
  std::string in_, out_;
  bool open_ = false, listenOnly_ = false, stamps_ = false, tooLong_ = false;
  bool overrun_ = false, busError_ = false;
};

// What each host interface has to show, through the driver of the firmware.
#pragma once

#include "hosts/host.h"
#include "hosts/master.h"

// The driver's board is a host.
struct board {
  hosts::Host& host;
};

namespace hosts {

// What a register is, from the generated header of the preset.
struct RegisterRow {
  std::string name;
  unsigned address, bytes;
  bool writable;
};
std::vector<RegisterRow> registersOf(const std::string& header);

// Conformance: registers, memory, events, SyncManagers beside a master; `rounds` of each handshake.
class Suite {
 public:
  Suite(Core& core, Host& host, Master& master, Random& random);
  void run(const std::vector<RegisterRow>& registers, int rounds);
  // The SyncManagers, as master and driver use them; they stay as they are.
  void switchOn();

 private:
  void identity();
  void walk(const std::vector<RegisterRow>& registers);
  void memory(int rounds);
  void events();
  void mailbox(int rounds);
  void processData(int rounds);
  void quiet();

  Core& core_;
  Host& host_;
  Master& master_;
  Random& random_;
  board board_;
  const bool byWrite_;
};

// Random accesses, good ones and others, beside the master; behind each bad one good ones must be right.
class Storm {
 public:
  Storm(Core& core, Host& host, Master& master, Random& random);
  void run(uint64_t accesses);
  // What was done and counted, a line per kind.
  void print() const;

 private:
  struct Count {
    uint64_t done = 0, counted = 0;
  };
  void good();
  void outside();
  void bad();
  void errors(const Bad& bad);
  void clear();
  void compare(unsigned address, unsigned length);

  Core& core_;
  Host& host_;
  Master& master_;
  Random& random_;
  std::vector<uint8_t> memory_;
  uint8_t errors_ = 0;
  std::map<std::string, Count> counts_;
};

}  // namespace hosts

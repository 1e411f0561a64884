// The local processor of a slave: a program written as firmware is, one access after the other, run beside
// the simulation.
#pragma once

#include <ucontext.h>

#include <cstdint>
#include <exception>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "core/ethernet.h"
#include "core/simulator.h"

class Slave;

class Host {
 public:
  Host();
  virtual ~Host();  // derived classes call stop() in theirs
  Host(const Host&) = delete;

  void attach(Slave& slave) { slave_ = &slave; }
  // The core cycle from which on the program wants to go on, once the host port is free.
  uint64_t wakeAt() const { return wakeAt_; }
  // Runs the program until it waits for something.
  void resume();
  // How long the program still delays; kNever if it does not.
  Time delayLeft() const;
  // Idle time was skipped, which counts for a delay.
  void skipped(Time t);
  // It accesses the slave, or a delay has just ended: time that must not be skipped.
  bool reacts() const;

  // What somebody at the bench tells the program; the answer, or a UserError.
  virtual std::string command(const std::vector<std::string>& words) = 0;

 protected:
  // The program. It runs on a stack of its own and never returns.
  virtual void run() = 0;
  // Ends the program: what it waits for never comes, its stack is cleared up.
  void stop();

  // For use in run(). Bytes are accessed in ascending order, each once.
  Bytes read(uint16_t addr, size_t n);
  void write(uint16_t addr, const Bytes& data);
  uint8_t read8(uint16_t addr) { return read(addr, 1)[0]; }
  uint16_t read16(uint16_t addr);
  void write16(uint16_t addr, uint16_t value) {
    write(addr, {static_cast<uint8_t>(value), static_cast<uint8_t>(value >> 8)});
  }
  void sleepNs(double ns);
  // The same, where idle time that is skipped counts.
  void delayNs(double ns);
  Slave& slave() { return *slave_; }

 private:
  struct Stopped {};
  static void entry(unsigned high, unsigned low);
  uint32_t access(uint16_t addr, bool write, uint32_t data, unsigned lanes);
  void suspend();

  Slave* slave_ = nullptr;
  uint64_t wakeAt_ = 0, reactsUntil_ = 0;
  bool delays_ = false;
  Time credit_ = 0;  // skipped within a delay, less than a core cycle
  bool started_ = false, stopping_ = false, ended_ = false;
  std::exception_ptr error_;
  std::unique_ptr<char[]> stack_;
  ucontext_t simulation_, program_;
};

// What a network file says about a slave's host program.
struct HostOptions {
  std::string program = "none";
  double delayUs = 0;          // io: from the master's write to AL control or a mailbox to the answer
  std::vector<Bytes> replies;  // io: answers to the mailbox messages of the master, in order
};

// Programs that only some simulators have add themselves before main() begins; always true.
using HostMaker = std::function<std::unique_ptr<Host>(const HostOptions&)>;
bool addHostProgram(const std::string& name, HostMaker maker);

// The program of that name: "none" is null. UserError if there is none, which names those that are there.
std::unique_ptr<Host> makeHost(const HostOptions& options);

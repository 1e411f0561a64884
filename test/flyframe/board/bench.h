// A board on a bench: its clock, and its host, which reads and writes through the pins.
#pragma once
#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <random>
#include <string>
#include <vector>

#include "verilated.h"

namespace board {
constexpr int kLanes = WIDTH / 8;
constexpr uint64_t kCyclesPerMs = 1000 * CORE_MHZ;
constexpr uint32_t kWord = 0xffffffffu >> (32 - WIDTH);

[[noreturn]] inline void fail(const std::string& what) {
  std::printf("%s\n", what.c_str());
  std::exit(1);
}

// Top is the bench that Verilator made.
template <class Top>
class Board {
 public:
  Top top;
  uint64_t cycles = 0;
  int fewest = 1000, most = 0;  // core cycles from the edge that sees the strobe until wait ends

  Board() { top.bus_ne = top.bus_noe = top.bus_nwe = 1; }
  virtual ~Board() = default;
  void cycle(uint64_t count = 1) {
    for (uint64_t i = 0; i < count; ++i) {
      before();
      top.clk_50 = 1, top.eval();
      top.clk_50 = 0, top.eval();
      after();
      ++cycles;
    }
  }
  uint32_t read(uint32_t address) {
    begin(address, (1u << kLanes) - 1);
    top.bus_noe = 0;
    wait();
    const uint32_t data = top.seen_d;
    end();
    if (top.seen_d) fail("the data pins are driven behind a read");
    return data;
  }
  void write(uint32_t address, uint32_t lanes, uint32_t data) {
    begin(address, lanes);
    top.host_d = data;
    top.host_drives = 1;
    top.bus_nwe = 0;
    wait();
    end();
  }
  // A byte, whatever the width of the bus.
  uint32_t readByte(uint32_t address) {
    return read(address / kLanes * kLanes) >> (8 * (address % kLanes)) & 0xff;
  }
  void writeByte(uint32_t address, uint32_t data) {
    write(address / kLanes * kLanes, 1u << (address % kLanes), data << (8 * (address % kLanes)));
  }
  // Writes and reads the words of a memory with no other effect, `accesses` in all.
  void fillAndCheck(uint32_t address, uint32_t bytes, int accesses) {
    std::mt19937 random(1);
    std::vector<uint8_t> memory(bytes);
    for (uint32_t a = 0; a < bytes; a += kLanes) write(address + a, (1u << kLanes) - 1, 0);
    for (int i = 0; i < accesses; ++i) {
      const uint32_t offset = random() % (bytes / kLanes) * kLanes;
      if (random() % 2) {
        const uint32_t lanes = 1 + random() % ((1u << kLanes) - 1), data = random() & kWord;
        write(address + offset, lanes, data);
        for (int lane = 0; lane < kLanes; ++lane)
          if (lanes >> lane & 1) memory[offset + lane] = static_cast<uint8_t>(data >> (8 * lane));
      } else {
        const uint32_t data = read(address + offset);
        for (int lane = 0; lane < kLanes; ++lane)
          if (static_cast<uint8_t>(data >> (8 * lane)) != memory[offset + lane])
            fail("read a wrong byte at " + std::to_string(address + offset + lane));
      }
    }
  }

 protected:
  virtual void before() {}  // around each cycle
  virtual void after() {}

 private:
  void begin(uint32_t address, uint32_t lanes) {
    top.bus_a = address / kLanes;
    top.bus_nbl = ~lanes & ((1u << kLanes) - 1);
    top.bus_ne = 0;
    cycle(2);
  }
  void wait() {
    cycle(1);
    int waited = 0;
    for (; !top.bus_nwait; ++waited) {
      if (waited > 1000) fail("the host waits for ever");
      cycle();
    }
    fewest = std::min(fewest, waited);
    most = std::max(most, waited);
  }
  void end() {
    top.bus_ne = top.bus_noe = top.bus_nwe = 1;
    top.host_drives = 0;
    cycle(4);
  }
};
}  // namespace board

// The whole board through its pins: reset, identity, and memory behind the host bus.
//   board --identity 0xf1 --address 0xf80 --bytes 128
// The exit code is 0 if all was right, 1 with a message if not.
#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <random>
#include <string>
#include <vector>

#include "Vboard_bench.h"
#include "verilated.h"

namespace {
constexpr int kLanes = WIDTH / 8;
constexpr uint32_t kSlave = 0xf1;
constexpr uint64_t kCyclesPerMs = 1000 * CORE_MHZ;
constexpr uint32_t kWord = 0xffffffffu >> (32 - WIDTH);

[[noreturn]] void fail(const std::string& what) {
  std::printf("%s\n", what.c_str());
  std::exit(1);
}

class Board {
 public:
  Vboard_bench top;
  uint64_t cycles = 0, phyCycles = 0;
  int fewest = 1000, most = 0;  // core cycles from the edge that sees the strobe until wait ends

  Board() { top.bus_ne = top.bus_noe = top.bus_nwe = 1; }
  void cycle(int count = 1) {
    for (int i = 0; i < count; ++i) {
      const bool before = top.phy_clk;
      top.clk_50 = 1, top.eval();
      top.clk_50 = 0, top.eval();
      phyCycles += !before && top.phy_clk;
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
}  // namespace

int main(int argc, char** argv) {
  uint32_t identity = 0, address = 0, bytes = 0;
  for (int i = 1; i + 1 < argc; i += 2) {
    const auto value = static_cast<uint32_t>(std::strtoul(argv[i + 1], nullptr, 0));
    if (!std::strcmp(argv[i], "--identity")) identity = value;
    if (!std::strcmp(argv[i], "--address")) address = value;
    if (!std::strcmp(argv[i], "--bytes")) bytes = value;
  }
  Board board;
  while (!board.top.phy_reset_n && board.cycles < 20 * kCyclesPerMs) board.cycle();
  if (!board.top.phy_reset_n || board.cycles < 10 * kCyclesPerMs)
    fail("the PHYs' reset does not last 10 ms and end");
  // 25 MHz, but while the PLL locks.
  const uint64_t phyCycles = board.cycles * 25 / CORE_MHZ;
  if (board.phyCycles < phyCycles - 100 || board.phyCycles > phyCycles + 1)
    fail("the PHYs' clock is not 25 MHz in reset");
  const double reset = static_cast<double>(board.cycles) / kCyclesPerMs;
  board.cycle(1000);
  if (board.top.alarm_buzzer || board.top.alarm_lamp || board.top.alarm_disabled)
    fail("a signal is on at the start");
  // A slave supplies its detector without a host; a master has a fault until it has one.
  if (board.top.alarm_supply != (identity == kSlave))
    fail("the detector has no supply, or the master no fault, at the start");

  if ((board.read(0) & 0xff) != identity) fail("the type is not " + std::to_string(identity));
  std::mt19937 random(1);
  std::vector<uint8_t> memory(bytes);
  for (uint32_t a = 0; a < bytes; a += kLanes) board.write(address + a, (1u << kLanes) - 1, 0);
  for (int i = 0; i < 5000; ++i) {
    const uint32_t offset = random() % (bytes / kLanes) * kLanes;
    if (random() % 2) {
      const uint32_t lanes = 1 + random() % ((1u << kLanes) - 1), data = random() & kWord;
      board.write(address + offset, lanes, data);
      for (int lane = 0; lane < kLanes; ++lane)
        if (lanes >> lane & 1) memory[offset + lane] = static_cast<uint8_t>(data >> (8 * lane));
    } else {
      const uint32_t data = board.read(address + offset);
      for (int lane = 0; lane < kLanes; ++lane)
        if (static_cast<uint8_t>(data >> (8 * lane)) != memory[offset + lane])
          fail("read a wrong byte at " + std::to_string(address + offset + lane));
    }
  }
  std::printf("5000 accesses in %d to %d cycles, reset %.1f ms, errors 0\n", board.fewest, board.most, reset);
}

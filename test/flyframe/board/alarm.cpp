// The whole alarm board through its pins: reset, identity, and memory behind the host bus.
//   alarm --identity 0xf1 --address 0xf80 --bytes 128
// The exit code is 0 if all was right, 1 with a message if not.
#include "bench.h"

#include <cstring>

#include "Valarm_bench.h"

using namespace board;

namespace {
constexpr uint32_t kSlave = 0xf1;

class AlarmBoard : public Board<Valarm_bench> {
 public:
  uint64_t phyCycles = 0;

 private:
  bool phyClk = false;
  void before() override { phyClk = top.phy_clk; }
  void after() override { phyCycles += !phyClk && top.phy_clk; }
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
  AlarmBoard board;
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
  board.fillAndCheck(address, bytes, 5000);
  std::printf("5000 accesses in %d to %d cycles, reset %.1f ms, errors 0\n", board.fewest, board.most, reset);
}

// The whole ring board through its pins: its host, and its optical ports, which lead to each other.
//   ring --node 0x8000 --identity 0xf3
// Where the node's registers begin, and what its first byte is. The exit code is 0 if all was right, 1 with a
// message if not.
#include "bench.h"

#include <cstring>

#include "Vring_bench.h"
#include "ring-node-tp.h"

using namespace board;

namespace {
class RingBoard : public Board<Vring_bench> {
 public:
  bool cut1 = false, cut2 = false;  // the fibres to port 1 and to port 2

 private:
  void before() override {
    top.optical_1_rx = top.optical_2_tx && !cut1;
    top.optical_2_rx = top.optical_1_tx && !cut2;
  }
};
}  // namespace

int main(int argc, char** argv) {
  uint32_t node = 0, identity = 0;
  for (int i = 1; i + 1 < argc; i += 2) {
    const auto value = static_cast<uint32_t>(std::strtoul(argv[i + 1], nullptr, 0));
    if (!std::strcmp(argv[i], "--node")) node = value;
    if (!std::strcmp(argv[i], "--identity")) identity = value;
  }
  RingBoard board;
  auto& top = board.top;
  top.optical_1_signal = top.optical_2_signal = top.can_rx = 1;
  board.cycle(9 * kCyclesPerMs);
  if (top.optical_1_tx || top.optical_2_tx) fail("there is light in reset");
  board.cycle(3 * kCyclesPerMs);
  if (!top.can_tx) fail("the twisted pair is dominant at the start");
  if (board.readByte(node + NODE_NODE_TYPE) != identity) fail("the type is not " + std::to_string(identity));
  board.fillAndCheck(node + NODE_CAN_F_SLOTN(0) + 8, 8, 2000);  // the data of a frame

  // Both ports come up a millisecond behind the first light, and tell so.
  const auto ports = [&] { return board.readByte(node + NODE_RING_PORTS); };
  const auto clear = [&] {
    board.writeByte(node + NODE_NODE_EVENTS, 0xff);
    board.cycle(4);
    if (top.ring_irq) fail("the interrupt stays behind its event");
  };
  const auto until = [&](uint32_t mask, uint32_t want, const char* what) {
    for (int us = 0; (ports() & mask) != want; ++us) {
      if (us > 20000) fail(what);
      board.cycle(CORE_MHZ);
    }
    if (!top.ring_irq) fail(std::string("no interrupt: ") + what);
    clear();
  };
  constexpr uint32_t kUp1 = NODE_RING_UP1_MASK, kUp2 = NODE_RING_UP2_MASK;
  board.writeByte(node + NODE_RING_CONTROL, NODE_RING_OFF_MASK);
  board.writeByte(node + NODE_RING_UP_MS, 1);
  board.writeByte(node + NODE_NODE_EVENTS, 0xff);
  board.writeByte(node + NODE_NODE_MASK, NODE_RING_EVENT_PORT_MASK);
  board.cycle(10);
  if (top.ring_irq) fail("an interrupt without an event");
  board.writeByte(node + NODE_RING_CONTROL, 0);
  until(kUp1 | kUp2, kUp1 | kUp2, "the ports do not come up");

  // A fibre breaks; then a receiver tells of no light.
  board.cut1 = true;
  until(kUp1, 0, "port 1 stays up without a fibre");
  // It is dark at port 1, which asks for light by the fibre to port 2: no pins are swapped.
  constexpr uint32_t kTold = NODE_RING_SIGNAL1_MASK | NODE_RING_SEARCH2_MASK;
  for (int us = 0; (ports() & kTold) != NODE_RING_SEARCH2_MASK; ++us) {
    if (us > 20000) fail("port 2 does not hear that port 1 is dark");
    board.cycle(CORE_MHZ);
  }
  board.cut1 = false;
  until(kUp1 | kUp2, kUp1 | kUp2, "port 1 does not come up again");
  top.optical_2_signal = 0;
  until(kUp2, 0, "port 2 stays up without light");
  std::printf("2000 accesses in %d to %d cycles, errors 0\n", board.fewest, board.most);
}

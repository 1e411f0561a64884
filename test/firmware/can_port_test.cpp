// The driver of a ring node's CAN port on a fake controller that has a twisted pair, too: what one start has
// joined the next one may not want.
extern "C" {
#include "node/can_port.h"
#include "ring-node-tp.h"
}

#include "ring_board.h"

namespace {
// A frame comes at the pair with each access, until port T is stopped. The last one may still be in the
// bridge then, which requests its slot `last` accesses later.
struct PairBoard : RingBoard {
  bool hasPair = true, isHeard = true;
  unsigned last = 0, left = 0;
  PairBoard() { alone = true; }
  uint8_t readByte(uint16_t a) override {
    hears();
    return isIn(a, NODE_CAN_T_CONTROL, 0x100) && !hasPair ? 0 : RingBoard::readByte(a);
  }
  void writeByte(uint16_t a, uint8_t value) override {
    hears();
    RingBoard::writeByte(a, value);
    if (a != NODE_CAN_T_CONTROL || (value & NODE_CAN_T_RUN_MASK) || !isHeard) return;
    isHeard = false;
    left = last;
  }
  bool isOn(uint8_t bits) const { return (memory[NODE_CAN_T_CONTROL] & bits) == bits; }
  // The lowest free slot of those of the bridge (BR-01).
  void hears() {
    const bool isLast = left > 0 && --left == 0;
    const bool isNext = isHeard && isOn(NODE_CAN_T_RUN_MASK | NODE_CAN_T_BRIDGE_MASK);
    if (!isLast && !isNext) return;
    const unsigned bridged = waiting >> 8 & 0xff;
    waiting |= ((bridged + 1) & ~bridged & 0xff) << 8;
  }
  bool bridgeFilter() const {
    return memory[NODE_CAN_F_FILTERN(8) + 3] & NODE_CAN_F_FILTERN_IN_USE_MASK >> 24;
  }
};

struct PortBench {
  PairBoard at;
  can_port port{};
  bool start(bool relay, uint16_t pairKbps, bool bridge) {
    can_port_config config{};
    config.address = 2, config.core_mhz = 100, config.pair_kbps = pairKbps, config.bridge = bridge;
    config.relay = relay, config.kbps = static_cast<uint16_t>(relay ? 2000 : 1000);
    return can_port_start(&port, &at, &config);
  }
  // Joined to a pair on which there is always something.
  bool joined(bool relay) {
    const bool starts = start(relay, 500, true);
    at.isHeard = true;
    for (int i = 0; i < 3; ++i) can_port_runs(&port);
    return starts && at.waiting >> 8 != 0 && at.bridgeFilter();
  }
};

void starts(bool relay) {
  const std::string in = relay ? " in relay mode" : " in bus mode";
  PortBench none;
  const bool before = none.joined(relay), after = none.start(relay, 0, false);
  check("BR-01: a start without the pair ends it" + in,
        before && after && !none.at.memory[NODE_CAN_T_CONTROL] && none.at.waiting == 0);
  check("BR-01: and no filter of the bridge takes frames for the host" + in, !none.at.bridgeFilter());
  PortBench again;
  check("BR-01: nothing that was bridged before a start leaves behind it" + in,
        again.joined(relay) && again.start(relay, 500, true) && again.at.waiting == 0 &&
            again.at.isOn(NODE_CAN_T_RUN_MASK | NODE_CAN_T_BRIDGE_MASK) && again.at.bridgeFilter());
  PortBench apart;
  check("BR-01: nor when the pair is not joined any more" + in,
        apart.joined(relay) && apart.start(relay, 500, false) && apart.at.waiting == 0 &&
            apart.at.isOn(NODE_CAN_T_RUN_MASK) && !apart.at.isOn(NODE_CAN_T_BRIDGE_MASK) &&
            !apart.at.bridgeFilter());
  // The first of these accesses come before F's slots are aborted for the first time, the others behind it.
  unsigned late = 0;
  for (unsigned last = 1; last <= 20; ++last) {
    PortBench inBridge;
    inBridge.at.last = last;
    late += !inBridge.joined(relay) || !inBridge.start(relay, 0, false) || inBridge.at.left != 0 ||
            inBridge.at.waiting != 0;
  }
  check("BR-01: nor what the bridge had in hand when the pair was stopped" + in, late == 0);
  PortBench single;
  single.at.hasPair = false;
  check("BR-01: a node without a second port is not written to where that would be" + in,
        single.start(relay, 0, false) && single.start(relay, 0, false) && !single.at.wrote(0x0200, 0x02ff) &&
            !single.at.wrote(NODE_CAN_F_FILTERN(8), NODE_CAN_F_FILTERN(16) - 1));
}
}  // namespace

void testCanPort() {
  starts(true);
  starts(false);
}

// The host program of a ring node (ring_node) on a fake controller, which may be gone for a while: nothing
// drives its bus, and every register reads as ones, or as zeros.
extern "C" {
#include "node/ring_node.h"
#include "ring-node.h"
}

#include "ring_board.h"

namespace {
constexpr uint8_t kOwn = 2, kPeer = 9, kLife = 5, kObject = 1;

struct NodeBench {
  RingBoard at;
  ring_node node{};
  ring_node_parameters parameters{};

  explicit NodeBench(uint8_t floating = 0xff) {
    at.floating = floating;
    parameters.address = kOwn, parameters.relay = true, parameters.kbps = 2000, parameters.core_mhz = 100;
    parameters.pd_ms = 100;
    ring_node_start(&node, &at, &parameters);
    run(1);
  }
  void run(unsigned ms) {
    for (unsigned i = 0; i < ms; ++i) at.now += 1000, ring_node_serve(&node);
  }
  void value() {
    transport_watch(&node.transport, kPeer, kObject);
    at.comes({false, kOwn, true, kPeer, kObject, RING_PROCESS_DATA, true}, {1}), run(1);
  }
  bool isOld() {
    uint8_t data[8];
    bool old;
    transport_value(&node.transport, kPeer, kObject, data, &old, node.now_us);
    return old;
  }
  // A message of another node, which the host takes if it comes.
  bool takes(uint8_t number, uint8_t life) {
    at.comes({false, kOwn, false, kPeer, RING_SHORT, 0, true}, {number, life, 1}), run(1);
    const transport_message* m = transport_received(&node.transport);
    if (m != nullptr) transport_take(&node.transport, m, false);
    return m != nullptr;
  }
};

void testTime(uint8_t floating) {
  NodeBench b(floating);
  b.value(), b.at.gone = true, b.run(290);
  check("TP-50, TB-24: a value is not old at once when the controller is gone", !b.isOld());
  b.run(20);
  check("TP-50, TB-24: without a controller, too, values become old", b.isOld());

  const uint8_t data[] = {1};
  transport_end end;
  NodeBench c(floating);
  c.at.gone = true;
  transport_send(&c.node.transport, 7, kPeer, false, data, sizeof data, nullptr, c.node.now_us);
  c.run(9000);
  check("TP-13, TB-24: a message is under way without a controller",
        !transport_ended(&c.node.transport, &end));
  c.run(1100);
  check("TP-13, TB-24: it ends all the same",
        transport_ended(&c.node.transport, &end) && end.outcome == TRANSPORT_NOT_CONFIRMED);

  NodeBench d(floating);
  const bool first = d.takes(0, kLife), older = d.takes(0, kLife - 1);
  d.at.gone = true, d.run(10000), d.at.gone = false, d.run(1);
  check("TP-20, TB-24: a source is forgotten while the controller is gone",
        first && !older && d.takes(0, kLife - 1));
}

void testOnes() {
  NodeBench b;
  b.value();
  const uint64_t before = b.node.now_us;
  b.at.gone = true, b.run(1), b.at.gone = false, b.run(1);
  check("TB-24: time goes on by what has passed while registers read as ones",
        b.node.now_us == before + 2000 && !b.isOld());
  b.at.gone = true, b.at.now += 1000, ring_node_serve(&b.node);
  check("TB-24: what reads as ones is no controller, and brings no frames",
        !ring_node_runs(&b.node) && b.node.fault == RING_NODE_NO_CONTROLLER &&
            b.node.transport.counters[TRANSPORT_WRONG_SOURCE] == 0);
  b.at.gone = false, b.at.frames.clear(), b.run(1100);
  check("TB-24: a controller that is back is set up anew, and sends",
        ring_node_runs(&b.node) && b.node.starts == 3 && !b.at.frames.empty());
  // A controller that another program stops, and that does not hold what is written.
  b.at.stuck[NODE_RING_CONTROL] = 0xff, b.at.memory[NODE_RING_CONTROL] = 0;
  b.at.frames.clear(), b.run(1100);
  check("TB-24: one that does not start sends nothing",
        b.node.fault == RING_NODE_SETTINGS && b.at.frames.empty());
}
// Neither is there a life to be read, which the next one would have to be behind.
void testStart() {
  NodeBench b;
  b.at.gone = true, b.at.storeFails = -1, ring_node_start(&b.node, &b.at, &b.parameters);
  check("TB-24: what reads as ones at the start is no life", b.node.link_life == 0);

  // The program is there before its controller, and in memory of whatever was there before.
  RingBoard at;
  ring_node node;
  std::memset(&node, 0xa5, sizeof node);
  at.gone = true;
  const bool isFault = ring_node_start(&node, &at, &b.parameters) == RING_NODE_NO_CONTROLLER;
  check("TB-24: a program that begins without a controller says so, and has nothing from before",
        isFault && !ring_node_conflict(&node) && transport_received(&node.transport) == nullptr);
  const uint8_t data[] = {1};
  transport* t = &node.transport;
  const bool given = transport_watch(t, kPeer, kObject) && transport_object(t, kPeer, kObject, data, 1) &&
                     transport_send(t, 7, kPeer, false, data, sizeof data, nullptr, node.now_us);
  const auto pass = [&] { at.now += 1000, ring_node_serve(&node); };
  for (unsigned i = 0; i < 300; ++i) pass();
  at.gone = false, pass(), pass();
  unsigned hellos = 0, messages = 0, values = 0;
  for (const ring_frame& f : at.frames) {
    const ring_id id = ring_id_of(f.id);
    if (id.pipe == RING_PROCESS_DATA) ++values;
    else if (id.number == RING_HELLO) ++hellos;
    else if (id.number == RING_SHORT) ++messages;
  }
  check("TP-13, TB-24: what it has sent by then leaves when the controller is there",
        given && hellos == 1 && values == 1 && messages == 1);
  at.comes({false, kOwn, true, kPeer, kObject, RING_PROCESS_DATA, true}, {3}), pass();
  uint8_t value[8];
  bool old;
  check("TP-50, TB-24: what it has watched by then is followed",
        transport_value(t, kPeer, kObject, value, &old, node.now_us) == 1 && value[0] == 3 && !old);

  ring_node_parameters impossible = b.parameters;
  impossible.address = 0;
  at.gone = true, ring_node_start(&node, &at, &impossible);
  at.gone = false, pass();
  check("TB-24: with impossible parameters nothing runs, and nothing can be sent",
        node.fault == RING_NODE_SETTINGS &&
            !transport_send(t, 7, kPeer, false, data, sizeof data, nullptr, node.now_us) &&
            !transport_watch(t, kPeer, kObject) && !transport_object(t, kPeer, kObject, data, 1));
}

// A bridge's filter accepts whatever goes to no node: the host has to leave that.
void testBridged() {
  NodeBench b;
  b.value();
  const auto comes = [&](uint8_t filter) {
    b.at.comes({false, kOwn, true, kPeer, kObject, RING_PROCESS_DATA, true}, {9});
    b.at.fifo.back()[5] = filter;
  };
  const auto value = [&] {
    uint8_t data[8];
    bool old;
    transport_value(&b.node.transport, kPeer, kObject, data, &old, b.node.now_us);
    return data[0];
  };
  comes(8), comes(31), b.run(1);
  check("BR-01: frames of the bridge are no data of the transport", value() == 1 && b.at.fifo.empty());
  comes(8), comes(0), b.run(1);
  check("BR-01: behind one of them others are received", value() == 9);
}

// Of a program before, another firmware's.
void testSettings() {
  RingBoard at;
  ring_node node;
  ring_node_parameters parameters = NodeBench().parameters;
  at.memory[NODE_RING_UP_MS] = 1, at.memory[NODE_RING_RETRIES] = 3;
  ring_node_start(&node, &at, &parameters);
  check("FR-12, FR-58: what is not given is as out of reset, whatever was set before",
        at.memory[NODE_RING_UP_MS] == 10 && at.memory[NODE_RING_RETRIES] == 15);
}

// The board's watchdog bites after a second.
void testWatchdog() {
  NodeBench b;
  b.node.due_us = UINT64_MAX; // as on a slow ring
  ring_node_wait(&b.node, 10'000'000);
  check("TB-24: no wait is longer than half a second", b.at.longest == 500'000);
}

// Conflicts of addresses that come again and again.
void testConflicts() {
  NodeBench b;
  const uint8_t first = b.node.transport.config.life;
  const uint32_t stored = b.at.stored;
  const auto clears = [&](unsigned count) {
    bool isNew = true;
    for (unsigned i = 0; i < count; ++i) {
      const uint8_t last = b.at.memory[NODE_RING_LIFE];
      b.at.conflicts(), b.run(1), ring_node_clear_conflict(&b.node);
      isNew = isNew && b.at.memory[NODE_RING_LIFE] != last && b.at.memory[NODE_RING_LIFE] != 0;
    }
    return isNew;
  };
  check("RB-13: a node goes on in another life each time", clears(99) && b.at.clears == 99);
  check("RB-13, GWB-09: which wears no memory", b.at.stored == stored);
  const uint8_t last = b.at.memory[NODE_RING_LIFE];
  b.at.memory[NODE_RING_LIFE] = 0, b.at.memory[NODE_RING_CONTROL] = 0;
  ring_node_start(&b.node, &b.at, &b.parameters);
  check("TP-02, TP-20, RB-13: the next start is newer by one, and another life on the links, too",
        b.node.transport.config.life == first + 1 && b.at.memory[NODE_RING_LIFE] == first + 1 &&
            b.at.memory[NODE_RING_LIFE] != last);
  // The memory fails, and works again; the controller keeps its life.
  const auto ahead = [&](int storeFails) {
    const uint8_t before = b.node.transport.config.life;
    b.at.storeFails = storeFails, ring_node_start(&b.node, &b.at, &b.parameters);
    return b.node.transport.config.life - before;
  };
  for (unsigned count : {0u, 1u, 2u}) {
    clears(count);
    const int without = ahead(-1);
    check("TP-20, RB-13: it is newer also without a memory", without >= 1 && without <= 2);
    clears(count);
    const int again = ahead(0);
    check("TP-20, RB-13: and when that works again", again >= 1 && again <= 3);
  }
  const uint8_t same = b.at.memory[NODE_RING_LIFE];
  const unsigned cleared = b.at.clears;
  ring_node_clear_conflict(&b.node);
  check("RB-13: without a conflict nothing is done",
        b.at.memory[NODE_RING_LIFE] == same && b.at.clears == cleared);
}

// For minutes nobody is there who would acknowledge a frame.
void testAlone() {
  NodeBench b;
  transport* t = &b.node.transport;
  const auto sets = [&](uint8_t value) { transport_object(t, kPeer, kObject, &value, 1); };
  const uint8_t data[] = {1};
  b.at.alone = true;
  b.takes(0, kLife), sets(1);
  transport_send(t, 7, kPeer, false, data, sizeof data, nullptr, b.node.now_us);
  b.run(500), transport_cancel(t, 7), b.run(100000), sets(2), b.run(400);
  b.at.frames.clear(), b.at.leaveAll(), b.at.alone = false, b.run(1);
  unsigned messages = 0, values = 0;
  bool isNewest = true;
  for (const ring_frame& f : b.at.frames) {
    const ring_id id = ring_id_of(f.id);
    const bool isValue = id.pipe == RING_PROCESS_DATA;
    if (isValue) ++values, isNewest = isNewest && f.data[0] == 2;
    else if (id.number != RING_HELLO) ++messages;
  }
  check("TP-50, TB-27: the value that goes out when others are back is the newest one",
        values > 0 && isNewest);
  check("TB-27: what has ended meanwhile does not go out, neither do old answers", messages == 0);
}
}  // namespace

void testRingNode() {
  testTime(0x00), testTime(0xff);
  testOnes();
  testStart();
  testBridged();
  testSettings();
  testWatchdog();
  testConflicts();
  testAlone();
}

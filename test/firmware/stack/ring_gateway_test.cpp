// The host program of a ring under an EtherCAT master (ring_gateway) between a fake slave controller and a
// fake ring node: a master at one side, nodes at the other, both played here.
#include "controller.h"

extern "C" {
#include "node/ring_gateway.h"
#include "ring-node-tp.h"
}

#include "../ring_board.h"

namespace {
constexpr unsigned kInputs = 540, kOutputs = 516, kSlotsAt = 28, kOutputsAt = 4;
constexpr uint8_t kOwn = 1;

// The side of the slave, of a chip that may be gone: every register reads as `floating` then.
struct Slave : Controller {
  bool gone = false;
  uint8_t floating = 0xff;
  uint8_t readByte(uint16_t a) override { return gone ? floating : Controller::readByte(a); }
  void writeByte(uint16_t a, uint8_t value) override {
    if (!gone) Controller::writeByte(a, value);
  }
};

struct GatewayBench {
  Slave c;
  RingBoard ring;
  gateway g{};
  ring_node_parameters parameters{};

  explicit GatewayBench(bool starts = true) {
    parameters.address = kOwn, parameters.relay = true, parameters.kbps = 2000, parameters.core_mhz = 100;
    parameters.pd_ms = 100;
    c.setWord(0x0420, 1000);
    if (starts) start();
  }
  void start() { gateway_start(&g, &c, &ring, &parameters); }
  void run(unsigned us) {
    for (unsigned i = 0; i < us; i += 100) ring.now += 100, gateway_serve(&g);
  }
  unsigned request(uint16_t state) {
    c.control(state), run(300);
    return c.status();
  }
  void mailboxes() { c.setSyncManager(0, 0x1000, 128, 0x26), c.setSyncManager(1, 0x1080, 128, 0x22); }
  void process() { c.setSyncManager(2, 0x1100, kOutputs, 0x64), c.setSyncManager(3, 0x1800, kInputs, 0x20); }
  unsigned safeOp() {
    mailboxes(), request(AL_PREOP), process();
    return request(AL_SAFEOP);
  }
  void op() { safeOp(), outputs(0), request(AL_OP); }
  // The outputs: the control byte, and the first byte of each slot.
  void outputs(uint8_t control, const Bytes& slots = {}) {
    Bytes all(kOutputs);
    all[0] = control;
    for (size_t i = 0; i < slots.size(); ++i) all[kOutputsAt + 8 * i] = slots[i];
    c.write(2, all);
    run(100);
  }
  Bytes inputs() {
    Bytes all;
    return c.read(3, all) ? all : Bytes(kInputs);
  }
  static uint64_t number(const Bytes& of, size_t at, unsigned bytes) {
    uint64_t n = 0;
    for (unsigned i = bytes; i-- > 0;) n = n << 8 | of.at(at + i);
    return n;
  }
  static uint64_t slot(const Bytes& inputs, unsigned i) { return number(inputs, kSlotsAt + 8 * i, 8); }
  static uint64_t valid(const Bytes& inputs) { return number(inputs, 20, 8); }
  // A node's value.
  void value(uint8_t node, uint8_t object, const Bytes& data) {
    ring.comes({false, kOwn, true, node, object, RING_PROCESS_DATA, true}, data);
  }
  void hello(uint8_t node, uint8_t ports = NODE_RING_UP1_MASK | NODE_RING_UP2_MASK) {
    ring.comes({false, 0, false, node, RING_HELLO, 0, true}, {1, 0, ports, 0, 0, 0, 0, 0});
  }
  // Process data that have left for a node since the last call, as DLC and first byte.
  std::vector<std::pair<unsigned, unsigned>> sent(uint8_t node, uint8_t object) {
    std::vector<std::pair<unsigned, unsigned>> all;
    for (const ring_frame& f : ring.frames) {
      const ring_id id = ring_id_of(f.id);
      if (id.is_data && id.pipe == RING_PROCESS_DATA && id.destination == node && id.number == object)
        all.emplace_back(f.dlc, f.dlc > 0 ? f.data[0] : 0);
    }
    return all;
  }
  std::vector<std::pair<unsigned, unsigned>> sentIn(unsigned us, uint8_t node, uint8_t object = 0) {
    ring.frames.clear();
    run(us);
    return sent(node, object);
  }
  // Process data with a valid value that have entered the port since frames were forgotten last.
  unsigned validSent() const {
    unsigned count = 0;
    for (const ring_frame& f : ring.frames) {
      const ring_id id = ring_id_of(f.id);
      count += id.is_data && id.pipe == RING_PROCESS_DATA && f.dlc > 0;
    }
    return count;
  }
  // All 64 outputs, valid.
  void allOutputs(uint8_t value) { outputs(1, Bytes(GATEWAY_SLOTS, value)); }
  // The chip is reset, with both of its sides.
  void reset() {
    ring.memory[NODE_RING_LIFE] = ring.memory[NODE_RING_ADDRESS] = ring.memory[NODE_RING_CONTROL] = 0;
    ring.waiting = 0;
    for (int n = 0; n < 4; ++n) c.setActivate(n, 0), c.memory[0x0807 + 8 * n] = 0;
    c.setWord(0x0120, AL_INIT), c.setWord(0x0130, AL_INIT);
  }
  void gone(bool is) { ring.gone = c.gone = is; }
  uint16_t mayWrite(uint16_t index, uint8_t subindex, uint16_t number) {
    const uint8_t bytes[] = {static_cast<uint8_t>(number), static_cast<uint8_t>(number >> 8)};
    return g.application.may_write(&g, index, subindex, bytes, 2) == 0;
  }
};
using Sent = std::vector<std::pair<unsigned, unsigned>>;

void inputs() {
  GatewayBench b;
  check("GW-01: SAFEOP", b.safeOp() == AL_SAFEOP);
  Bytes in = b.inputs();
  check("GW-02, GWB-01: ports up, relay mode; whether the ring is whole is not known yet",
        in[0] == 0x0e && in[1] == 1 && in[2] == 0 && in[3] == 0);
  check("GW-02: nothing is valid", b.valid(in) == 0);
  b.hello(2), b.hello(65), b.hello(125), b.run(200);
  in = b.inputs();
  check("GW-02: nodes present",
        in[1] == 4 && b.number(in, 4, 8) == 0x6 && in[4 + 65 / 8] == 0x02 && in[4 + 125 / 8] == 0x20);
  b.value(2, 0, {1, 2, 3}), b.value(65, 0, {9, 8, 7, 6, 5, 4, 3, 2}), b.value(66, 0, {1}), b.value(2, 1, {5});
  b.run(200);
  in = b.inputs();
  check("GW-02: values in their slots, and no others", b.slot(in, 0) == 0x030201 &&
                                                           b.slot(in, 63) == 0x0203040506070809 &&
                                                           b.valid(in) == (1 | uint64_t{1} << 63));
  b.value(2, 0, {}), b.run(200);
  in = b.inputs();
  check("GW-02, GWB-07: no valid value is 0", b.slot(in, 0) == 0 && b.valid(in) == uint64_t{1} << 63);
  b.run(300'000);
  in = b.inputs();
  check("GW-02, GWB-07: an old value is not valid", b.slot(in, 63) == 0 && b.valid(in) == 0);
  b.value(3, 0, {7}), b.run(200);
  check("GW-02: it is again", b.slot(b.inputs(), 1) == 7);
}

void breaks() {
  GatewayBench b;
  b.op();
  b.hello(2, NODE_RING_UP1_MASK), b.hello(3, NODE_RING_UP2_MASK), b.run(200);
  Bytes in = b.inputs();
  check("GW-02: a break between 2 and 3", in[0] == 0x0e && in[2] == 2 && in[3] == 3);
  b.hello(2), b.hello(3), b.run(200);
  in = b.inputs();
  check("GW-02, GWB-01: no break that is known", in[0] == 0x0e && in[2] == 0 && in[3] == 0);
  b.run(2'900'000), b.hello(2), b.hello(3), b.run(200'000);
  in = b.inputs();
  check("GW-02: whole again", in[0] == 0x0f && in[2] == 0 && in[3] == 0);
  b.ring.memory[NODE_RING_PORTS] = NODE_RING_UP1_MASK;
  b.run(200);
  check("GW-02: port 2 is down", (b.inputs()[0] & 0x0d) == 0x04);
  b.run(3'100'000);
  in = b.inputs();
  check("GW-02: nodes that are silent are not there", in[1] == 1 && b.number(in, 4, 8) == 2);
  b.ring.memory[NODE_RING_PORTS] = NODE_RING_UP1_MASK | NODE_RING_UP2_MASK;
  b.run(200);
  in = b.inputs();
  check("GWB-01: who hears nobody is alone", in[0] == 0x0e && in[2] == kOwn && in[3] == kOwn);
  // What runs no more tells nothing of before.
  b.ring.memory[NODE_RING_PORTS] = NODE_RING_UP1_MASK | NODE_RING_UP2_MASK;
  b.hello(2), b.value(2, 0, {1}), b.run(200);
  check("GW-02: a value", b.slot(b.inputs(), 0) == 1);
  b.ring.memory[NODE_NODE_TYPE] = 0, b.ring.memory[NODE_RING_LIFE] = 0, b.ring.memory[NODE_RING_CONTROL] = 0;
  b.ring.memory[NODE_RING_ADDRESS] = 0, b.run(2000);
  in = b.inputs();
  check("GWB-07: without the ring's controller all is 0", in == Bytes(kInputs) && b.c.status() == AL_OP);
}

void conflict() {
  GatewayBench b;
  b.op();
  b.hello(2), b.run(200);
  check("GW-02: no conflict", (b.inputs()[0] & 0x10) == 0);
  b.ring.conflicts(), b.run(9'900'000);
  check("GWB-09: a conflict of addresses is an input", (b.inputs()[0] & 0x10) != 0 && b.ring.clears == 0);
  b.run(200'000);
  check("GWB-09: it is cleared after ten seconds", (b.inputs()[0] & 0x10) == 0 && b.ring.clears == 1);
}

void outputs() {
  GatewayBench b;
  check("GW-03: before OP no valid value, once", b.sentIn(2000, 2) == Sent{{0, 0}});
  check("GW-03: and every pdMs", b.sentIn(300'000, 2) == Sent(3, {0, 0}));
  b.op();
  b.ring.frames.clear();
  b.outputs(0, {1, 2}), b.run(2000);
  check("GW-03: without bit 0 they are not valid", b.sent(2, 0).empty() && b.sent(3, 0).empty());
  b.ring.frames.clear();
  b.outputs(1, {1, 2}), b.run(2000);
  check("GW-03: with it they go out",
        b.sent(2, 0) == Sent{{8, 1}} && b.sent(3, 0) == Sent{{8, 2}} && b.sent(65, 0) == Sent{{8, 0}});
  b.ring.frames.clear();
  b.outputs(1, {1, 3}), b.run(2000);
  check("GW-03: on change", b.sent(2, 0).empty() && b.sent(3, 0) == Sent{{8, 3}});
  check("GW-03: and every pdMs", b.sentIn(200'000, 3) == Sent(2, {8, 3}));
  b.ring.frames.clear();
  b.outputs(0, {1, 3}), b.run(2000);
  check("GW-03: bit 0 falls", b.sent(2, 0) == Sent{{0, 0}} && b.sent(3, 0) == Sent{{0, 0}});
  b.outputs(1, {1, 3}), b.run(2000);
  b.c.expireWatchdog();
  check("GW-03: the watchdog", b.sentIn(2000, 2) == Sent{{0, 0}} && b.c.status() == (AL_SAFEOP | AL_ERROR) &&
                                   b.c.code() == AL_CODE_WATCHDOG);
  for (uint8_t state : {AL_SAFEOP, AL_PREOP, AL_INIT}) {
    GatewayBench d;
    d.op();
    d.outputs(1, {4}), d.run(2000);
    d.ring.frames.clear();
    d.request(state);
    check("GW-03: OP to " + std::to_string(state), d.sent(2, 0) == Sent{{0, 0}});
    check("GW-03: and every pdMs", d.sentIn(100'000, 2) == Sent{{0, 0}});
  }
}

void tables() {
  GatewayBench b;
  b.mailboxes(), b.request(AL_PREOP);
  check("GW-02, GWB-06: the table names nodes", b.mayWrite(0x8010, 1, 0x7dff) &&
                                                    b.mayWrite(0x8020, 64, 0x0200) &&
                                                    b.mayWrite(0x8010, 1, 0) && b.mayWrite(0x8010, 0, 0xff));
  check("GW-02, GWB-06: no others", !b.mayWrite(0x8010, 1, 0x7e00) && !b.mayWrite(0x8020, 1, 0x0100) &&
                                        !b.mayWrite(0x8020, 1, 0x0001) && !b.mayWrite(0x8010, 64, 0xff00));
  auto& o = b.g.device.objects;
  o.object_8010_01 = 0x0507, o.object_8020_01 = 0x0608, o.object_8020_02 = 0;
  b.process();
  check("GW-02, GWB-06: a changed table", b.request(AL_SAFEOP) == AL_SAFEOP);
  b.outputs(0), b.request(AL_OP), b.outputs(1, {1, 2});
  check("GW-02: outputs to its nodes only",
        b.sentIn(100'000, 6, 8) == Sent{{8, 1}} && b.sent(2, 0).empty() && b.sent(3, 0).empty());
  b.value(5, 7, {3}), b.value(2, 0, {4}), b.run(200);
  check("GW-02: inputs of its nodes only", b.slot(b.inputs(), 0) == 3 && b.valid(b.inputs()) == 1);
  // Twice the same, and what a device file may hold but no table.
  b.request(AL_PREOP);
  o.object_8020_02 = 0x0608;
  b.process();
  check("GWB-06: two slots for one output",
        b.request(AL_SAFEOP) == (AL_PREOP | AL_ERROR) && b.c.code() == AL_CODE_OUTPUT_MAPPING);
  o.object_8020_02 = 0, o.object_8010_40 = 0x7e00;
  check("GW-02: an impossible node", b.request(AL_SAFEOP | AL_ACKNOWLEDGE) == (AL_PREOP | AL_ERROR) &&
                                         b.c.code() == AL_CODE_INPUT_MAPPING);
  o.object_8010_40 = 0x0507;
  check("GW-02: one input in two slots", b.request(AL_SAFEOP | AL_ACKNOWLEDGE) == AL_SAFEOP);
  b.value(5, 7, {6}), b.run(200);
  check("GW-02: is in both", b.slot(b.inputs(), 0) == 6 && b.slot(b.inputs(), 63) == 6);
}

void faults() {
  GatewayBench b(false);
  b.ring.memory[NODE_NODE_TYPE] = 0;
  b.start();
  check("GW-01: without a ring the slave starts", b.safeOp() == AL_SAFEOP && b.inputs() == Bytes(kInputs));
  b.ring.memory[NODE_NODE_TYPE] = 0xf3;
  b.run(200'000);
  check("GWB-08: a chip that is there only later begins in INIT", b.c.status() == AL_INIT);
  b.op();
  b.ring.frames.clear();
  b.outputs(1, {5}), b.run(2000);
  check("GW-03: and gets the outputs to the ring", b.sent(2, 0) == Sent{{8, 5}} && b.inputs()[1] == 1);
  // Messages have nobody who takes them.
  for (uint8_t n = 0; n < RING_PIPES; ++n) {
    b.ring.comes({false, kOwn, false, 9, RING_SHORT, n, true}, {n, 1, 'h', 'i'}), b.run(200);
  }
  unsigned refused = 0;
  for (const ring_frame& f : b.ring.frames) {
    const ring_id id = ring_id_of(f.id);
    refused += !id.is_data && id.number == RING_DONE && id.destination == 9 && f.data[3] == RING_REFUSED;
  }
  check("GWB-07: messages are refused", refused == RING_PIPES);
  // The chip is reset, with both of its sides.
  GatewayBench d;
  d.op();
  d.outputs(1, {5});
  d.ring.memory[NODE_RING_LIFE] = 0, d.ring.memory[NODE_RING_ADDRESS] = 0,
  d.ring.memory[NODE_RING_CONTROL] = 0;
  d.run(200'000);
  check("GWB-08: a reset of the chip ends in INIT", d.c.status() == AL_INIT);
  check("GW-03: and outputs are not valid", d.sentIn(100'000, 2) == Sent{{0, 0}});
}

// In whatever moment the chip loses what it had, of outputs before nothing leaves behind it.
void resets() {
  GatewayBench b;
  unsigned old = 0, states = 0, again = 0;
  for (unsigned ms = 1; ms <= 101; ++ms) {
    b.op(), b.ring.frames.clear();
    b.allOutputs(5), b.run(ms * 1000 - 100);
    again += b.sent(2, 0).front() == std::make_pair(8u, 5u);
    b.reset(), b.ring.frames.clear(), b.run(1000);
    states += b.c.status() == AL_INIT;
    old += b.validSent() + (b.sent(2, 0) != Sent{{0, 0}});
  }
  check("GWB-08: a reset in any millisecond ends in INIT", states == 101);
  check("GW-03, GWB-08: no output of before leaves as valid behind it", old == 0);
  check("GW-03, GWB-08: outputs are valid again in OP", again == 101);
}

void outages(uint8_t floating, unsigned ms) {
  const std::string what = std::to_string(ms) + " ms, registers read as " + (floating ? "ones" : "zeros");
  GatewayBench b;
  b.ring.floating = b.c.floating = floating;
  b.op(), b.allOutputs(5), b.run(2000);
  b.gone(true), b.ring.frames.clear(), b.run(ms * 1000);
  b.reset(), b.gone(false), b.run(300'000);
  check("GW-03, GWB-08: away for " + what + ": no output of before leaves as valid", b.validSent() == 0);
  check("GWB-08: it ends in INIT", b.c.status() == AL_INIT && b.sent(2, 0).size() >= 3);
  b.safeOp(), b.allOutputs(6), b.run(100'000);
  check("GW-03, GWB-08: valid outputs in SAFEOP are none, neither", b.validSent() == 0);
  b.request(AL_OP), b.run(2000);
  check("GW-03, GWB-08: in OP they are", b.sent(2, 0).back() == std::make_pair(8u, 6u));
}

// What ends outputs comes in the pass in which they are due.
void endsWhenDue() {
  for (bool watchdog : {true, false}) {
    GatewayBench b;
    b.op(), b.allOutputs(5), b.run(99'900), b.ring.frames.clear();
    if (watchdog) b.c.expireWatchdog();
    else b.c.control(AL_SAFEOP);
    b.run(2000);
    check("GW-03: no value of before leaves as valid in the pass of its end",
          b.validSent() == 0 && b.sent(2, 0) == Sent{{0, 0}});
  }
}

// What is left in the FIFO makes no event.
void framesLeft() {
  GatewayBench b;
  for (uint8_t n = 2; n < 80; ++n) b.hello(n);
  b.run(100);
  const bool hasMore = !b.ring.fifo.empty() && b.g.node.due_us <= b.g.node.now_us;
  b.run(100);
  check("GW-03: frames left in the controller are not waited for, and nothing is once they are taken",
        hasMore && b.ring.fifo.empty() && b.g.node.due_us > b.g.node.now_us);
}
}  // namespace

void testRingGateway() {
  inputs();
  breaks();
  conflict();
  outputs();
  tables();
  faults();
  resets();
  for (uint8_t floating : {0x00, 0xff})
    for (unsigned ms : {20u, 120u, 500u}) outages(floating, ms);
  endsWhenDue();
  framesLeft();
}

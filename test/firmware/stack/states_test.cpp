// The AL state machine: the table of transitions and codes is typed from the rules AL-03 and ST-02 to ST-13.
#include "bench.h"

namespace {
constexpr uint8_t I = 1, P = 2, B = 3, S = 4, O = 8;
const char* nameOf(int s) {
  return s == I ? "INIT" : s == P ? "PREOP" : s == B ? "BOOT" : s == S ? "SAFEOP" : "OP";
}

// From a state, with all settings right: the AL status code of a request; 0 is a transition.
struct Row {
  uint8_t from, to;
  uint16_t code;
};
const Row kTable[] = {
    {I, I, 0},      {I, P, 0},      {I, B, 0},      {I, S, 0x0011}, {I, O, 0x0011}, {P, I, 0}, {P, P, 0},
    {P, B, 0x0011}, {P, S, 0},      {P, O, 0x0011}, {B, I, 0},      {B, P, 0x0011}, {B, B, 0}, {B, S, 0x0011},
    {B, O, 0x0011}, {S, I, 0},      {S, P, 0},      {S, B, 0x0011}, {S, S, 0},      {S, O, 0}, {O, I, 0},
    {O, P, 0},      {O, B, 0x0011}, {O, S, 0},      {O, O, 0},
};

void transitions() {
  for (const Row& row : kTable) {
    Bench b;
    bool ok = row.from == I || b.to(row.from);
    if (row.from == I) row.to == B ? b.bootMailboxes() : b.mailboxes();
    if (row.from == P && row.to == S) b.process();
    if (row.from == S) b.outputs({1, 2, 3}), b.serve();
    b.program.entered.clear();
    b.request(row.to);
    ok = ok && (row.code ? b.error(row.from, row.code) : b.is(row.to));
    const bool enters = !row.code && row.from != row.to;
    ok = ok && b.program.entered == (enters ? std::vector<int>{row.to} : std::vector<int>{});
    check(std::string("ST-02: ") + nameOf(row.from) + " to " + nameOf(row.to), ok && !b.c.out);
  }
  for (uint8_t from : {I, P, B, S, O}) {
    bool ok = true;
    for (int wanted = 0; wanted < 16; ++wanted) {
      if (wanted == I || wanted == P || wanted == B || wanted == S || wanted == O) continue;
      Bench b;
      ok = ok && (from == I || b.to(from));
      b.request(static_cast<uint16_t>(wanted));
      ok = ok && b.error(from, 0x0012);
    }
    check(std::string("ST-02: a state that there is not, in ") + nameOf(from), ok);
  }
  Bench b;
  b.device.boot_receive.length = 0;
  b.start();
  b.bootMailboxes();
  b.request(B);
  check("ST-02: no Bootstrap", b.error(I, 0x0013));
}

void start() {
  Bench b;
  check("ST-01: INIT after the start, without error", b.is(I) && !b.c.out);
  const auto off = [&](int n) { return (b.c.memory[0x0807 + 8 * n] & 1) == 1; };
  bool ok = off(0) && off(1) && off(2) && off(3);
  b.to(P);
  ok = ok && !off(0) && !off(1) && off(2) && off(3);
  b.process(), b.request(S);
  ok = ok && !off(0) && !off(2) && !off(3);
  b.request(P);
  ok = ok && !off(1) && off(2) && off(3);
  b.request(I);
  check("ST-01: SyncManagers are on in the states that need them",
        ok && off(0) && off(1) && off(2) && off(3));
}

void errors() {
  Bench b;
  b.to(P);
  b.request(O);
  check("ST-02: an error shows", b.error(P, 0x0011));
  b.process();
  b.request(S);
  check("ST-04: what goes up without acknowledge is ignored", b.error(P, 0x0011));
  b.request(P);
  check("ST-04: and so is the same state", b.error(P, 0x0011));
  b.request(P | 0x10);
  check("ST-03: the present state with acknowledge ends the error", b.is(P));
  b.request(O);
  b.request(S | 0x10);
  check("ST-04: an acknowledge may come with a request", b.is(S));
  b.request(B);
  b.request(I);
  check("ST-04: ways back need no acknowledge", b.is(I));
  b.to(S);
  b.request(9 | 0x10);
  b.request(B), b.request(0);
  check("ST-04: Bootstrap and nonsense are no ways back", b.error(S, 0x0012));
  b.request(S | 0x10);
  b.request(S);
  check("ST-03: the present state without error changes nothing", b.is(S));
  b.request(9 | 0x10);
  b.request(12 | 0x10);
  check("ST-02: an acknowledge with nonsense gives its own error", b.error(S, 0x0012));
}

void mailboxSettings() {
  const auto refused = [](const char* what, bool boot, const std::function<void(Bench&)>& spoil) {
    Bench b;
    boot ? b.bootMailboxes() : b.mailboxes();
    spoil(b);
    b.request(boot ? B : P);
    check(std::string("ST-05: ") + what, b.error(I, boot ? 0x0015 : 0x0016));
  };
  for (bool boot : {false, true}) {
    const auto length = static_cast<uint16_t>(boot ? 256 : 128);
    const auto send = static_cast<uint16_t>(boot ? 0x1100 : 0x1080);
    refused("mailbox off", boot, [](Bench& b) { b.c.setActivate(0, 0); });
    refused("the other mailbox off", boot, [](Bench& b) { b.c.setActivate(1, 0); });
    refused("another start", boot, [=](Bench& b) { b.c.setSyncManager(0, 0x1001, length, 0x26); });
    refused("another length", boot,
            [=](Bench& b) { b.c.setSyncManager(1, send, static_cast<uint16_t>(length - 1), 0x22); });
    refused("three buffers", boot, [=](Bench& b) { b.c.setSyncManager(0, 0x1000, length, 0x24); });
    refused("the wrong way round", boot, [=](Bench& b) { b.c.setSyncManager(1, send, length, 0x26); });
  }
  Bench b;
  b.c.setSyncManager(0, 0x1000, 128, 0x36), b.c.setSyncManager(1, 0x1080, 128, 0x02);
  b.request(P);
  check("ST-05: interrupts of mailboxes are the master's own", b.is(P));
}

void processSettings() {
  const auto refused = [](const char* what, unsigned code, const std::function<void(Bench&)>& spoil) {
    Bench b;
    b.to(P), b.process();
    spoil(b);
    b.request(S);
    check(what, b.error(P, code) && b.program.cycles == 0);
  };
  refused("ST-06: no outputs", 0x001d, [](Bench& b) { b.c.setActivate(2, 0); });
  refused("ST-06: outputs too long", 0x001d, [](Bench& b) { b.c.setSyncManager(2, 0x1100, 4, 0x64); });
  refused("ST-06: outputs too short", 0x001d, [](Bench& b) { b.c.setSyncManager(2, 0x1100, 2, 0x64); });
  refused("ST-06: outputs elsewhere", 0x001d, [](Bench& b) { b.c.setSyncManager(2, 0x1104, 3, 0x64); });
  refused("ST-06: outputs in a mailbox", 0x001d, [](Bench& b) { b.c.setSyncManager(2, 0x1100, 3, 0x66); });
  refused("ST-06: outputs without event", 0x001d, [](Bench& b) { b.c.setSyncManager(2, 0x1100, 3, 0x44); });
  refused("ST-06: no inputs", 0x001e, [](Bench& b) { b.c.setActivate(3, 0); });
  refused("ST-06: inputs of another length", 0x001e,
          [](Bench& b) { b.c.setSyncManager(3, 0x1200, 3, 0x20); });
  refused("ST-06: inputs as outputs", 0x001e, [](Bench& b) { b.c.setSyncManager(3, 0x1200, 4, 0x24); });
  refused("ST-07: outputs that cannot be mapped", 0x0025,
          [](Bench& b) { b.demo.objects.object_1600_01 = 0x70000310; });
  refused("ST-07: inputs that cannot be mapped", 0x0024,
          [](Bench& b) { b.demo.objects.object_1a00_01 = 0x60000108; });
  refused("ST-07: a PDO of the other direction", 0x0024,
          [](Bench& b) { b.demo.objects.object_1c13_01 = 0x1600; });
  refused("ST-08: types that do not fit", 0x0026, [](Bench& b) { b.demo.objects.object_1c33_01 = 0; });
  refused("ST-08: SYNC mode without clocks", 0x0028, [](Bench& b) { b.demo.objects.object_1c32_01 = 2; });
  refused("ST-08: SYNC mode without SYNC0", 0x0030, [](Bench& b) {
    b.device.sync = true, b.demo.objects.object_1c32_01 = 2, b.demo.objects.object_1c33_01 = 2;
  });
  refused("ST-08: SYNC0 without cycle", 0x0036,
          [](Bench& b) { b.device.sync = true, b.c.setSync0(true, 0); });
  refused("ST-08: SYNC0 too fast", 0x0036, [](Bench& b) {
    b.device.sync = true, b.demo.objects.object_1c32_05 = 100000, b.c.setSync0(true, 99999);
  });
  refused("ST-09: a watchdog of no time", 0x001f, [](Bench& b) { b.c.setWord(0x0420, 0); });
  refused("ST-08: SYNC0 as a pulse", 0x0030,
          [](Bench& b) { b.device.sync = true, b.c.setSync0(true, 1000), b.c.setWord(0x0982, 1); });
  refused("ST-08: SYNC0 that is no event", 0x0030,
          [](Bench& b) { b.device.sync = true, b.c.setSync0(true, 1000), b.c.memory[0x0151] = 0; });
  Bench b;
  b.to(P), b.process();
  b.c.setWord(0x0420, 0), b.c.setSyncManager(2, 0x1100, 3, 0x24);
  b.request(S);
  check("ST-09: no trigger needs no time", b.is(S));
}

void op() {
  Bench b;
  b.to(S);
  b.request(O);
  check("ST-10: OP without outputs", b.error(S, 0x0019));
  b.request(S | 0x10);
  b.outputs({1, 2, 3}), b.serve();
  b.c.expireWatchdog();
  b.request(O);
  check("ST-10: OP with an expired watchdog", b.error(S, 0x001b));
  b.request(S | 0x10);
  b.outputs({1, 2, 3}), b.serve();
  b.request(O);
  check("ST-10: OP with outputs", b.is(O));
  b.outputs({1, 2, 3}), b.serve();
  const bool valid = b.program.lastValid;
  b.c.expireWatchdog(), b.serve();
  check("ST-11: the watchdog leads to SAFEOP", b.error(S, 0x001b) && valid && !b.program.lastValid);
  b.request(P), b.process(), b.request(S);
  b.request(O);
  check("ST-10: outputs of before do not count", b.error(S, 0x0019));
  Bench late;
  late.to(S);
  late.outputs({1, 2, 3}), late.request(O);
  check("ST-10: outputs and the request in one pass", late.is(O));
  late.request(S), late.request(O);
  check("ST-10: nor do those of OP", late.error(S, 0x0019));
  Bench fallen;
  fallen.to(O);
  slave_fail(&fallen.demo.slave, AL_SAFEOP, 0x8002), fallen.serve();
  fallen.request(O | 0x10);
  check("ST-10: nor those before a fall", fallen.error(S, 0x0019));
}

void switchedOff() {
  for (uint8_t from : {P, S, O, B})
    for (int n : {0, 1}) {
      Bench b;
      b.to(from);
      b.c.setActivate(n, 0), b.serve();
      check(std::string("ST-12: a mailbox is switched off in ") + nameOf(from),
            b.error(I, from == B ? 0x0015 : 0x0016));
    }
  for (uint8_t from : {S, O}) {
    Bench b;
    b.to(from);
    b.c.setActivate(2, 0), b.serve();
    check(std::string("ST-12: outputs are switched off in ") + nameOf(from), b.error(P, 0x001d));
    Bench d;
    d.to(from);
    d.c.setSyncManager(3, 0x1200, 8, 0x20), d.serve();
    check(std::string("ST-12: inputs are changed in ") + nameOf(from), d.error(P, 0x001e));
  }
  for (uint8_t from : {S, O}) {
    Bench e;
    e.to(from);
    e.c.setSyncManager(2, 0x1100, 3, 0x24), e.serve();
    check(std::string("ST-09, ST-12: the watchdog's trigger is taken away in ") + nameOf(from),
          e.error(P, 0x001d));
  }
  Bench b;
  b.to(O);
  b.c.control(I), b.c.setActivate(0, 0), b.c.setActivate(1, 0), b.serve();
  check("ST-12: with a request for INIT there is no error", b.is(I));
}

void program() {
  for (uint8_t wanted : {P, B, S, O}) {
    Bench b;
    const uint8_t from = wanted == O ? S : wanted == S ? P : I;
    b.program.refuseState = wanted, b.program.refuseCode = 0x8001;
    b.to(wanted);
    check(std::string("ST-13: the program refuses ") + nameOf(wanted), b.error(from, 0x8001));
  }
  Bench b;
  b.program.refuseState = P, b.program.refuseCode = 0x8001;
  b.request(P);
  check("ST-13: it is asked last", b.error(I, 0x0016));
  Bench d;
  d.to(O);
  slave_fail(&d.demo.slave, AL_SAFEOP, 0x8002), d.serve(1);
  check("ST-13: the program falls back", d.error(S, 0x8002));
  slave_fail(&d.demo.slave, AL_OP, 0x8003), slave_fail(&d.demo.slave, AL_BOOT, 0x8003), d.serve(1);
  check("ST-13: but does not go up", d.error(S, 0x8002));
  slave_fail(&d.demo.slave, AL_INIT, 0x8004), d.serve(1);
  check("ST-13: to INIT from anywhere", d.error(I, 0x8004));
  // From within its own functions.
  for (uint8_t wanted : {S, O}) {
    Bench e;
    static slave* failing;
    failing = &e.demo.slave;
    if (wanted == S) e.application.cycle = [](void*, bool) { slave_fail(failing, AL_PREOP, 0x8005); };
    else
      e.application.may_enter = [](void*, uint8_t state) {
        if (state == AL_OP) slave_fail(failing, AL_INIT, 0x8005);
        return uint16_t{0};
      };
    e.to(wanted);
    check("ST-13: the program fails while a state is entered", e.error(wanted == S ? P : I, 0x8005));
  }
}
}  // namespace

void testStates() {
  start();
  transitions();
  errors();
  mailboxSettings();
  processSettings();
  op();
  switchedOff();
  program();
}

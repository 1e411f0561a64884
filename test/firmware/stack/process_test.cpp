// Process data: when a cycle is, and which outputs it has.
#include "bench.h"

namespace {
void freeRun() {
  Bench b;
  b.to(AL_PREOP);
  b.demo.objects.object_1c32_01 = 0, b.demo.objects.object_1c33_01 = 0;
  b.process(), b.request(AL_SAFEOP);
  const unsigned begin = b.program.cycles;
  b.serve(10);
  check("ST-40: free-run: a cycle per pass", b.is(AL_SAFEOP) && b.program.cycles == begin + 10);
}

void smSynchronous() {
  Bench b;
  b.to(AL_SAFEOP);
  const unsigned begin = b.program.cycles;
  b.serve(10);
  check("ST-44: inputs are there when SAFEOP begins", begin == 1 && b.inputs().size() == 4);
  check("ST-41: SM-synchronous: no outputs, no cycle", b.program.cycles == begin);
  b.outputs({1, 0, 1}), b.serve(10);
  check("ST-41: a cycle per outputs", b.program.cycles == begin + 1 && !b.program.lastValid);
  check("ST-43: SAFEOP leaves the objects", b.demo.objects.object_7000_01 == 0);
  b.request(AL_OP);
  check("ST-43: OP begins with those that came last",
        b.demo.objects.object_7000_01 == 1 && b.demo.objects.object_7000_02 == 1);
  check("ST-41: with a cycle", b.program.cycles == begin + 2 && b.program.lastValid);
  b.outputs({2, 0, 0}), b.serve(10);
  check("ST-41, ST-43: in OP they are valid",
        b.program.cycles == begin + 3 && b.program.lastValid && b.demo.objects.object_7000_01 == 2);
  // Inputs only: their reading makes the cycle.
  Bench d;
  d.to(AL_PREOP);
  d.device.outputs.most = 0, d.demo.objects.object_1c33_01 = 1;
  d.process(0), d.request(AL_SAFEOP);
  const unsigned first = d.program.cycles;
  d.serve(5);
  const bool still = d.program.cycles == first;
  d.inputs(), d.serve(5);
  check("ST-41: without outputs a cycle when the inputs were read",
        d.is(AL_SAFEOP) && still && d.program.cycles == first + 1);
}

// What is over when the program looks.
void meanwhile() {
  Bench b;
  b.to(AL_OP);
  b.c.expireWatchdog(), b.outputs({1, 2, 3}), b.serve();
  check("ST-11: a watchdog that runs again has expired all the same", b.error(AL_SAFEOP, 0x001b));
  b.c.expireWatchdog();
  b.request(AL_SAFEOP | 0x10), b.outputs({1, 2, 3});
  b.request(AL_OP);
  check("ST-11: what expired before OP is of before", b.is(AL_OP));
  Bench d;
  d.to(AL_PREOP);
  d.device.outputs.most = 0, d.demo.objects.object_1c33_01 = 1;
  d.process(0), d.request(AL_SAFEOP);
  d.c.setActivate(3, 0), d.c.setActivate(3, 1), d.serve();
  check("ST-41, ST-44: there are inputs again when their SyncManager was off", d.inputs().size() == 4);
}

void newest() {
  Bench b;
  b.to(AL_PREOP);
  b.demo.objects.object_1c32_01 = 0, b.demo.objects.object_1c33_01 = 0;
  b.process(), b.request(AL_SAFEOP);
  for (uint8_t n : {3, 2, 1}) b.outputs({n, 0, 0}), b.serve();
  b.request(AL_OP);
  check("ST-43: the last of several outputs in SAFEOP", b.is(AL_OP) && b.demo.objects.object_7000_01 == 1);
  bool ok = true;
  for (unsigned frame : {1u, 100u, 900u, 1100u, 3000u, 9000u}) {
    Bench d;
    d.to(AL_PREOP);
    d.device.outputs.most = 0, d.demo.objects.object_1c33_01 = 1;
    d.process(0);
    d.c.frame = frame;
    d.request(AL_SAFEOP);
    d.serve(2000);
    ok = ok && d.is(AL_SAFEOP) && d.inputs().size() == 4;
  }
  check("ST-44: inputs although frames pass when SAFEOP is entered", ok);
}

void sync0() {
  Bench b;
  b.device.sync = true;
  b.to(AL_PREOP), b.process();
  b.c.setSync0(true, 1000000);
  b.request(AL_SAFEOP);
  const unsigned begin = b.program.cycles;
  b.outputs({1, 0, 0}), b.serve(5);
  const bool waits = b.program.cycles == begin;
  b.c.sync0(), b.serve(5);
  check("ST-42: a cycle with SYNC0 only", b.is(AL_SAFEOP) && waits && b.program.cycles == begin + 1);
  b.request(AL_OP);
  b.outputs({2, 0, 0}), b.serve(5);
  const bool there = b.demo.objects.object_7000_01 == 2 && b.program.cycles == begin + 1;
  b.c.sync0(), b.serve();
  check("ST-42: in OP, too", there && b.program.cycles == begin + 2 && b.program.lastValid);
  for (int i = 0; i < 4; ++i) b.c.sync0(), b.serve();
  const bool patient = b.is(AL_OP);
  b.outputs({3, 0, 0}), b.serve(), b.c.sync0(), b.serve();
  for (int i = 0; i < 4; ++i) b.c.sync0(), b.serve();
  check("ST-42: four SYNC0 without outputs pass", patient && b.is(AL_OP));
  b.c.sync0(), b.serve();
  check("ST-42: the fifth does not", b.error(AL_SAFEOP, 0x001a) && !b.program.lastValid);
  b.request(AL_SAFEOP | 0x10), b.outputs({1, 0, 0}), b.serve(), b.request(AL_OP);
  for (int i = 0; i < 100; ++i) b.outputs({1, 0, 0}), b.serve(1);
  const bool still = b.is(AL_OP);
  b.outputs({1, 0, 0}), b.serve(1);
  check("ST-42: 101 outputs without SYNC0", still && b.error(AL_SAFEOP, 0x002d));
  Bench plain;
  plain.to(AL_PREOP), plain.process();
  plain.c.setSync0(true, 1000000);
  plain.request(AL_SAFEOP);
  check("ST-42: a device without clocks does not look at SYNC0",
        plain.is(AL_SAFEOP) && plain.demo.slave.mode == SLAVE_SM_SYNCHRONOUS);
}

// The pin is a level: it falls when everything is served, also where nobody looks at an event.
void interrupt() {
  for (uint8_t state : {AL_PREOP, AL_SAFEOP, AL_OP}) {
    Bench b;
    b.device.sync = true;
    b.to(state);
    const auto falls = [&](const char* what, bool raises, const std::function<void()>& act) {
      b.serve(5);
      const bool before = b.c.interrupts();
      act();
      const bool raised = b.c.interrupts();
      b.serve(5);
      check(std::string("ST-49: the interrupt ends, ") + what,
            !before && (raised || !raises) && !b.c.interrupts());
    };
    const Bytes asked{0, 0x20, 0x40, 0, 0x10, 0, 0, 0, 0, 0};
    falls("a request for a state", true, [&] { b.c.control(state); });
    falls("a repeat request", true, [&] { b.c.setActivate(1, 3); });
    falls("a message", true, [&] { b.post(3, asked); });
    falls("its answer is read", true, [&] { b.fetch(0); });
    falls("nothing more", false, [] {});
    b.post(3, asked), b.serve();
    falls("a message that must wait", false, [&] { b.post(3, asked); });
    falls("until the answer before it is read", true, [&] { b.fetch(0); });
    b.fetch(0);
    falls("SYNC0 in another mode", false, [&] { b.c.sync0(); });
    if (state == AL_PREOP) continue;
    falls("outputs", true, [&] { b.outputs({0, 0, 0}); });
    falls("inputs are read", false, [&] { b.inputs(); });
    falls("the watchdog", state == AL_OP, [&] { b.c.expireWatchdog(); });
  }
}
}  // namespace

void testProcess() {
  freeRun();
  smSynchronous();
  meanwhile();
  newest();
  sync0();
  interrupt();
}

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
  b.outputs({2, 0, 0}), b.serve(10);
  check("ST-41, ST-43: in OP they are valid",
        b.program.cycles == begin + 2 && b.program.lastValid && b.demo.objects.object_7000_01 == 2);
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

void interrupt() {
  Bench b;
  b.device.sync = true;
  b.start();
  const auto raises = [&](const std::function<void()>& act) {
    b.serve(5);
    const bool before = b.c.interrupts();
    act();
    const bool raised = b.c.interrupts();
    b.serve(5);
    return !before && raised && !b.c.interrupts();
  };
  b.to(AL_OP);
  b.c.setSync0(true, 1000), b.serve();
  check("ST-48: everything that is to be served interrupts, and is served",
        raises([&] {
          b.outputs({0, 0, 0});
        }) &&
            raises([&] { b.c.control(AL_OP); }) && raises([&] { b.c.expireWatchdog(); }) &&
            raises([&] { b.c.setActivate(1, 3); }));
}
}  // namespace

void testProcess() {
  freeRun();
  smSynchronous();
  sync0();
  interrupt();
}

// What the master does between any two accesses of the host: nothing of it is lost, nothing old stays.
#include "bench.h"

namespace {
// For each moment `n` of what `host` does: `act` happens then, and after some passes `holds`. A last one,
// behind all accesses, ends it.
void everywhere(const std::string& name, uint8_t state, const std::function<void(Bench&)>& host,
                const std::function<void(Bench&)>& act, const std::function<bool(Bench&)>& holds) {
  unsigned n = 0;
  int wrong = -1;
  for (bool within = true; within && wrong < 0; ++n) {
    Bench b;
    b.to(state);
    b.c.before(n, [&] { act(b); });
    host(b);
    within = b.c.hasHappened();
    b.serve(8);
    if (b.c.hasHappened() && !holds(b)) wrong = static_cast<int>(n);
  }
  check(name + (wrong < 0 ? "" : ", before access " + std::to_string(wrong)), wrong < 0 && n > 10);
}

const auto passes = [](Bench& b) { b.serve(2); };
void first(Bench& b) { b.outputs({1, 0, 0}); }
void second(Bench& b) { b.outputs({2, 0, 0}); }
bool hasSecond(Bench& b) { return b.is(AL_OP) && b.program.lastOutput == 2 && b.program.lastValid; }
}  // namespace

void testBetween() {
  everywhere(
      "ST-41: outputs come while outputs are taken", AL_OP, [](Bench& b) { first(b), passes(b); }, second,
      hasSecond);
  everywhere(
      "ST-41, ST-43: outputs come while OP is entered", AL_SAFEOP,
      [](Bench& b) { first(b), b.request(AL_OP); }, second, hasSecond);
  everywhere(
      "ST-11: the watchdog expires while outputs are taken", AL_OP, [](Bench& b) { first(b), passes(b); },
      [](Bench& b) { b.c.expireWatchdog(); }, [](Bench& b) { return b.error(AL_SAFEOP, 0x001b); });
  everywhere(
      "ST-11: the watchdog expires and runs again while outputs are taken", AL_OP,
      [](Bench& b) { first(b), passes(b); }, [](Bench& b) { b.c.expireWatchdog(), second(b); },
      [](Bench& b) { return b.error(AL_SAFEOP, 0x001b); });
  everywhere(
      "ST-44: the inputs' SyncManager is off for a moment while SAFEOP is entered", AL_PREOP,
      [](Bench& b) { b.process(), b.request(AL_SAFEOP); },
      [](Bench& b) { b.c.setActivate(3, 0), b.c.setActivate(3, 1); },
      [](Bench& b) { return b.is(AL_SAFEOP) && b.inputs().size() == 4; });
  everywhere(
      "ST-44: inputs are read while inputs are written", AL_OP, [](Bench& b) { first(b), passes(b); },
      [](Bench& b) { b.inputs(); }, [](Bench& b) { return b.is(AL_OP) && b.inputs().size() == 4; });
  // As long as the request before is not read another one is refused, and the master says it again.
  const std::vector<std::pair<uint8_t, uint8_t>> ways{
      {AL_INIT, AL_PREOP}, {AL_PREOP, AL_SAFEOP}, {AL_SAFEOP, AL_OP}, {AL_OP, AL_SAFEOP}};
  for (const auto& [from, to] : ways) {
    const uint8_t begin = from == AL_INIT ? static_cast<uint8_t>(AL_PREOP) : from;
    everywhere(
        "ST-02: INIT is asked for on the way from state " + std::to_string(from), begin,
        [from = from, to = to](Bench& b) {
          if (from == AL_INIT) b.request(AL_INIT), b.mailboxes();
          if (from == AL_PREOP) b.process();
          if (from == AL_SAFEOP) first(b), b.serve(1);
          b.request(to);
        },
        [](Bench& b) { b.c.control(AL_INIT); },
        [](Bench& b) { return b.request(AL_INIT | 0x10) == AL_INIT && b.c.code() == 0; });
    if (from == AL_INIT) continue;
    everywhere(
        "ST-12: the mailbox is switched off in state " + std::to_string(from), from,
        [](Bench& b) {
          b.post(3, {0, 0x20, 0x40, 0, 0x10, 0, 0, 0, 0, 0}), passes(b);
        },
        [](Bench& b) { b.c.setActivate(0, 0); }, [](Bench& b) { return b.error(AL_INIT, 0x0016); });
  }
  everywhere(
      "ST-12: outputs are switched off in OP", AL_OP, [](Bench& b) { first(b), passes(b); },
      [](Bench& b) { b.c.setActivate(2, 0); }, [](Bench& b) { return b.error(AL_PREOP, 0x001d); });
  // A full mailbox refuses it, and the master says it again.
  const Bytes next{0, 0x20, 0x40, 0x18, 0x10, 1, 0, 0, 0, 0};
  bool posted = false;
  everywhere(
      "ST-14: a message comes while another one is answered", AL_PREOP,
      [](Bench& b) {
        b.post(3, {0, 0x20, 0x40, 0, 0x10, 0, 0, 0, 0, 0}), passes(b);
      },
      [&](Bench& b) { posted = b.post(3, next, 2); },
      [&](Bench& b) {
        const Bench::Message one = b.fetch();
        if (!posted) b.post(3, next, 2);
        const Bench::Message two = b.fetch();
        return one.type == 3 && one.data.at(3) == 0 && two.type == 3 && two.data.at(3) == 0x18 &&
               b.fetch().type == -1;
      });
}

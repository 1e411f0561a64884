// The mailbox: one by one, counters, repetition, errors, emergencies.
#include "bench.h"

namespace {
const Bytes kReadType{0, 0x20, 0x40, 0, 0x10, 0, 0, 0, 0, 0};  // upload of 0x1000:0
const Bytes kReadRevision{0, 0x20, 0x40, 0x18, 0x10, 3, 0, 0, 0, 0};

void oneByOne() {
  Bench b;
  b.to(AL_PREOP);
  b.post(3, kReadType), b.serve();
  check("ST-14: the reply waits, the next request too",
        b.c.full(1) && b.post(3, kReadRevision) && (b.serve(10), b.c.full(0)));
  const auto first = b.fetch(), second = b.fetch();
  check("ST-14: both are answered in order",
        first.data[3] == 0x00 && second.data[3] == 0x18 && second.data[5] == 3);
}

void counters() {
  Bench b;
  b.to(AL_PREOP);
  bool ok = true;
  for (int i = 0; i < 20; ++i) ok = ok && b.ask(3, kReadType).counter == i % 7 + 1;
  check("ST-15: replies are counted from 1 to 7", ok);
  b.post(3, kReadType, 5), ok = b.fetch().type == 3;
  b.post(3, kReadRevision, 5);
  check("ST-15: the same counter again is dropped", ok && b.fetch().type == -1);
  b.post(3, kReadRevision, 6);
  check("ST-15: another one is answered", b.fetch().type == 3);
  b.post(3, kReadType, 0), ok = b.fetch().type == 3;
  b.post(3, kReadType, 0);
  check("ST-15: 0 is not compared", ok && b.fetch().type == 3);
  b.post(3, kReadType, 3), b.fetch();
  b.request(AL_INIT), b.mailboxes(), b.request(AL_PREOP);
  b.post(3, kReadType, 3);
  const auto m = b.fetch();
  check("ST-15: counters begin anew with PREOP", m.type == 3 && m.counter == 1);
}

void repetition() {
  Bench b;
  b.to(AL_PREOP);
  b.c.setActivate(1, 3), b.serve();
  check("ST-16: with nothing to repeat it is acknowledged", b.c.repeatAcknowledged(1) && !b.c.full(1));
  const auto reply = b.ask(3, kReadRevision);
  b.c.setActivate(1, 1), b.serve();
  const auto again = b.fetch(0);
  check("ST-16: the last message once more", b.c.repeatAcknowledged(1) && again.counter == reply.counter &&
                                                 again.data == reply.data && again.type == 3);
  b.c.setActivate(1, 3), b.serve();
  check("ST-16: and once more", b.fetch(0).data == reply.data && b.fetch().type == -1);
  // A newer message is in the mailbox already.
  b.post(3, kReadType), b.serve();
  b.c.setActivate(1, 1), b.serve();
  const auto older = b.fetch(0);
  const bool acknowledged = b.c.repeatAcknowledged(1);
  const auto newer = b.fetch(1);
  check("ST-16: what was there already is taken back and follows",
        acknowledged && older.data == reply.data && older.counter == reply.counter && newer.data[3] == 0x00 &&
            newer.counter == reply.counter % 7 + 1);
  check("ST-16: and only once", b.fetch().type == -1);
  // The repeated message is lost, too.
  b.post(3, kReadRevision), b.serve();
  b.c.setActivate(1, 3), b.serve();
  b.fetch(0);
  b.c.setActivate(1, 1), b.serve();
  const auto twice = b.fetch(0), behind = b.fetch(1);
  check("ST-16: a repetition can be repeated", twice.data[3] == 0x00 && behind.data[3] == 0x18);
}

// Frames pass while the host switches its mailbox, for shorter and longer than the driver waits.
void repetitionBesideFrames() {
  bool ok = true;
  for (unsigned frame : {1u, 5u, 20u, 60u, 500u, 1500u, 2500u, 5000u}) {
    Bench b;
    b.to(AL_PREOP);
    const auto first = b.ask(3, kReadRevision);
    b.post(3, kReadType), b.serve();
    b.c.setActivate(1, 3);
    b.c.frame = frame;
    for (int i = 0; i < 2000 && !b.c.repeatAcknowledged(1); ++i) b.serve(1);
    const auto older = b.fetch(0);
    b.c.frame = frame;
    const auto newer = b.fetch(2000);
    ok = ok && older.data == first.data && older.counter == first.counter && newer.data[3] == 0x00 &&
         newer.counter == first.counter % 7 + 1 && b.ask(3, kReadRevision).data == first.data;
  }
  check("ST-16: a repetition while frames pass", ok);
  Bench b;
  b.to(AL_PREOP);
  b.ask(3, kReadType);
  const auto lost = b.ask(3, kReadRevision);
  b.c.setActivate(1, 3), b.serve();
  b.c.setActivate(1, 1), b.serve();
  const bool acknowledged = b.c.repeatAcknowledged(1);
  const auto again = b.fetch(0);
  check("ST-16: asked for twice before it is read, it is there once",
        acknowledged && again.data == lost.data && again.counter == lost.counter && b.fetch().type == -1);
}

void mistakes() {
  Bench b;
  b.to(AL_PREOP);
  const auto is = [&](const char* what, int detail, int type, const Bytes& data, int channel = 0,
                      int length = -1) {
    b.post(type, data, -1, channel, length);
    const auto m = b.fetch();
    check(std::string("ST-17: ") + what, m.type == 0 &&
                                             m.data == Bytes({1, 0, static_cast<uint8_t>(detail), 0}) &&
                                             b.ask(3, kReadType).type == 3);
  };
  is("more bytes than there are", 8, 3, kReadType, 0, 123);
  is("by far more", 8, 3, kReadType, 0, 0xffff);
  is("another channel", 3, 3, kReadType, 1);
  is("EoE", 2, 2, kReadType);
  is("VoE", 2, 15, kReadType);
  is("CoE too short", 6, 3, {0, 0x20, 0x40});
  is("an SDO too short", 6, 3, {0, 0x20, 0x40, 0, 0x10, 0, 0, 0, 0});
  is("FoE too short", 6, 4, {1, 0, 0, 0, 0});
  is("nothing at all", 6, 3, {});
  is("an unknown service", 4, 3, {0, 0x90, 0x40, 0, 0x10, 0, 0, 0, 0, 0});
  is("an emergency of the master", 4, 3, {0, 0x10, 0x40, 0, 0x10, 0, 0, 0, 0, 0});
  b.post(3, kReadType, -1, 0xc0);
  check("ST-17: a priority is none", b.fetch().type == 3);
  b.post(0, {1, 0, 2, 0});
  check("ST-17: an error is not answered", b.fetch().type == -1 && !b.c.full(0));
  b.device.protocols = SLAVE_COE;
  is("FoE that the device has not", 2, 4, {1, 0, 0, 0, 0, 0, 'x'});
  Bench boot;
  boot.to(AL_BOOT);
  const auto m = boot.ask(3, kReadType);
  check("ST-17, ST-39: CoE in Bootstrap", m.type == 0 && m.data == Bytes({1, 0, 2, 0}));
}

void emergencies() {
  Bench b;
  const uint8_t data[] = {1, 2, 3, 4, 5};
  check("ST-30: no emergency in INIT", !slave_emergency(&b.demo.slave, 0x5000, 1, data));
  for (uint8_t state : {AL_PREOP, AL_SAFEOP, AL_OP}) {
    Bench d;
    d.to(state);
    slave_emergency(&d.demo.slave, 0x5112, 0x81, data);
    const auto m = d.fetch();
    check("ST-30: an emergency", m.type == 3 && m.data == Bytes({0, 0x10, 0x12, 0x51, 0x81, 1, 2, 3, 4, 5}));
  }
  b.to(AL_PREOP);
  bool ok = true;
  for (uint16_t i = 1; i <= 4; ++i) ok = ok && slave_emergency(&b.demo.slave, i, 0, nullptr);
  check("ST-30: four wait, no more", ok && !slave_emergency(&b.demo.slave, 5, 0, nullptr));
  b.post(3, kReadType);
  for (uint8_t i = 1; i <= 4; ++i) {
    const auto m = b.fetch();
    ok = ok && m.type == 3 && m.data == Bytes({0, 0x10, i, 0, 0, 0, 0, 0, 0, 0});
    if (i == 1) ok = ok && b.fetch().data[1] == 0x30;
  }
  check("ST-18, ST-30: they come in order, the first before the answer", ok && b.fetch().type == -1);
  // A program that never stops telling.
  ok = true;
  for (int i = 0; i < 10; ++i) {
    b.post(3, kReadType);
    unsigned between = 0;
    for (bool answered = false; !answered && between < 3; ++between) {
      slave_emergency(&b.demo.slave, 7, 0, nullptr), slave_emergency(&b.demo.slave, 7, 0, nullptr);
      answered = b.fetch(1).data.at(1) == 0x30;
    }
    ok = ok && between <= 2;
  }
  check("ST-18: emergencies without end hold up no answer", ok);
  Bench boot;
  boot.to(AL_BOOT);
  check("ST-30: no emergency in Bootstrap", !slave_emergency(&boot.demo.slave, 0x5000, 1, data));
}

void order() {
  Bench b;
  b.to(AL_PREOP);
  // A list in fragments, with an emergency meanwhile and a repetition.
  b.device.send.length = 32;
  b.c.setSyncManager(1, 0x1080, 32, 0x22), b.serve();
  b.request(AL_INIT | 0x10);
  b.c.setSyncManager(0, 0x1000, 128, 0x26);
  b.c.setSyncManager(1, 0x1080, 32, 0x22);
  b.request(AL_PREOP);
  b.post(3, {0, 0x80, 1, 0, 0, 0, 1, 0});
  const auto first = b.fetch();
  slave_emergency(&b.demo.slave, 0x1000, 0, nullptr);
  b.post(3, kReadType);
  b.c.setActivate(1, 3);
  const auto repeated = b.fetch(1), emergency = b.fetch(1), fragment = b.fetch(1);
  check("ST-18: repeated, emergency, list", repeated.data == first.data && emergency.data[1] == 0x10 &&
                                                fragment.data[1] == 0x80 &&
                                                fragment.data[2] == (fragment.data[4] ? 0x82 : 2));
  Bench::Message last;
  for (int i = 0; i < 10 && last.data.size() != 10; ++i) last = b.fetch(1);
  check("ST-18: and then the next answer", last.data.size() == 10 && last.data[1] == 0x30);
}
}  // namespace

void testMailbox() {
  oneByOne();
  counters();
  repetition();
  repetitionBesideFrames();
  mistakes();
  emergencies();
  order();
}

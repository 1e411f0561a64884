// Orders of the server and of the panel against a fake controller.
#include <random>

#include "master_fake.h"

namespace {
void put(Message& m, uint64_t v, int bytes) {
  while (bytes-- > 0) m.push_back(static_cast<uint8_t>(v >> (8 * bytes)));
}

// An answer with an order, as the controller hands it over: it has checked the tag.
Message order(uint8_t code, uint16_t node, uint16_t seconds, uint32_t ticket) {
  Message m;
  put(m, PROTOCOL_MAGIC, 2), put(m, PROTOCOL_VERSION, 1), put(m, PROTOCOL_KIND_ANSWER, 1), put(m, 7, 2),
      put(m, 0, 2), put(m, 0x1122334455667788, 8), put(m, 0x99aabbccddeeff00, 8);
  put(m, 1, 4), put(m, 2, 4), put(m, 3, 4), put(m, ticket, 4), put(m, code, 1), put(m, 0, 1), put(m, node, 2),
      put(m, seconds, 2), put(m, 0, 2);
  m.resize(PROTOCOL_ANSWER_BYTES, 0xa5);
  return m;
}

struct Ordered : StartedMaster {
  using StartedMaster::StartedMaster;
  void take(const Message& m) {
    c.mailbox.push_back(m);
    serve();
  }
  // The end of the only order, as server and log are told.
  bool ended(uint8_t code, uint8_t result, uint16_t node, uint16_t ticket) {
    log_record r;
    return c.events == std::vector<Message>{{code, result, static_cast<uint8_t>(node),
                                             static_cast<uint8_t>(node >> 8), static_cast<uint8_t>(ticket),
                                             static_cast<uint8_t>(ticket >> 8)}} &&
           event_log_read(&host.log, 0, &r) && r.kind == LOG_ORDER && r.position == code && r.node == node &&
           (r.detail & 0xff) == result && r.detail >> 16 == ticket;
  }
};

// The two datagrams for one slave: who is there, then the write.
std::vector<Request> writeTo(uint8_t position, uint16_t ado, const Message& data) {
  const unsigned adp = (0x10000u - position) & 0xffff;
  return {{PROTOCOL_ECAT_APRD, adp, ESC_SLAVE_STATE + 2, {0, 0}}, {PROTOCOL_ECAT_APWR, adp, ado, data}};
}

void orders() {
  Ordered silence;
  silence.take(order(PROTOCOL_ORDER_SILENCE, 0xffff, 0, 5));
  check("HOST-15: silence for all goes by way of the controller",
        silence.c.silenced == 1 && silence.c.resets == 0 && silence.c.requests.empty() &&
            silence.ended(1, 0, 0xffff, 5) && silence.host.orders == 1);
  Ordered reset;
  reset.take(order(PROTOCOL_ORDER_RESET, 0xffff, 0, 0x12345));
  check("HOST-15: so does a reset", reset.c.resets == 1 && reset.c.silenced == 0 &&
                                        reset.c.requests.empty() && reset.ended(2, 0, 0xffff, 0x2345));
  Ordered one;
  one.take(order(PROTOCOL_ORDER_SILENCE, 4, 0, 1));
  check("HOST-15: silence for one slave is a write at its position",
        one.c.requests == writeTo(3, ESC_ALARM_COMMAND, {1}) && one.c.silenced == 0 && one.ended(1, 0, 4, 1));
  Ordered restart;
  restart.take(order(PROTOCOL_ORDER_RESET, 1, 0, 1));
  check("HOST-15: a reset of one slave, too",
        restart.c.requests == writeTo(0, ESC_ALARM_COMMAND, {2}) && restart.ended(2, 0, 1, 1));
  Ordered disable;
  disable.take(order(PROTOCOL_ORDER_DISABLE, 5, 0x1234, 1));
  check("HOST-15: a detector is disabled for a time",
        disable.c.requests == writeTo(4, ESC_DETECTOR_MODE, {1, 0, 0x34, 0x12}) && disable.ended(3, 0, 5, 1));
  Ordered test;
  test.take(order(PROTOCOL_ORDER_TEST, 0xffff, 60, 1));
  check("HOST-15: all are tested for a time",
        test.c.requests == std::vector<Request>{{PROTOCOL_ECAT_BWR, 0, ESC_DETECTOR_MODE, {2, 0, 60, 0}}} &&
            test.ended(4, 0, 0xffff, 1));
  Ordered watch;
  watch.take(order(PROTOCOL_ORDER_WATCH, 2, 99, 1));
  check("HOST-15: a detector is watched again",
        watch.c.requests == writeTo(1, ESC_DETECTOR_MODE, {0, 0, 0, 0}) && watch.ended(5, 0, 2, 1));
  Ordered seen;
  seen.take(order(PROTOCOL_ORDER_ACKNOWLEDGE, 3, 0, 1));
  check("HOST-15: that somebody has seen an alarm is recorded, and changes nothing",
        seen.c.requests.empty() && seen.c.silenced == 0 && seen.c.resets == 0 && seen.ended(6, 0, 3, 1));
}

void bounds() {
  for (const uint8_t code : {PROTOCOL_ORDER_DISABLE, PROTOCOL_ORDER_TEST}) {
    Ordered never;
    never.take(order(code, 4, 0, 1));
    check("HOST-15: an order for no time at all is refused",
          never.c.requests.empty() && never.ended(code, 4, 4, 1));
    Ordered longest;
    longest.take(order(code, 4, 0xffff, 1));
    check("HOST-15: the longest time is taken",
          longest.c.requests.size() == 2 && longest.ended(code, 0, 4, 1));
  }
  for (const unsigned code : {7u, 8u, 200u, 255u}) {
    Ordered unknown;
    unknown.take(order(static_cast<uint8_t>(code), 4, 1, 1));
    check("HOST-15: an unknown order: result 1",
          unknown.c.requests.empty() && unknown.ended(static_cast<uint8_t>(code), 1, 4, 1));
  }
  for (const uint16_t node : {0, 6, 0xfffe}) {
    Ordered none;
    none.take(order(PROTOCOL_ORDER_DISABLE, node, 1, 70000));
    check("HOST-15: a node that is not there: no datagram, result 3",
          none.c.requests.empty() && none.ended(3, 3, node, 70000 & 0xffff));
  }
  Ordered absent;
  absent.c.slaves[3].status = PROTOCOL_SLAVE_ABSENT;
  absent.serve();
  absent.take(order(PROTOCOL_ORDER_DISABLE, 4, 1, 1));
  check("HOST-15: one that does not answer is not there",
        absent.c.requests.empty() && absent.ended(3, 3, 4, 1));
  Ordered moved;
  moved.c.otherNode = 77;
  moved.take(order(PROTOCOL_ORDER_DISABLE, 4, 1, 1));
  bool written = false;
  for (const Request& r : moved.c.requests) written = written || r.command == PROTOCOL_ECAT_APWR;
  check("HOST-15: a slave at another place than in the table is not written to",
        !written && moved.ended(3, 3, 4, 1));
  Ordered twice;
  twice.c.slaves[4].node = 2;
  twice.serve();
  twice.take(order(PROTOCOL_ORDER_DISABLE, 2, 1, 1));
  check("HOST-15: two slaves with one node ID are both meant",
        twice.c.requests.size() == 4 && twice.ended(3, 0, 2, 1));

  // Messages that are no orders, cut off or longer.
  std::mt19937 random(4);
  Ordered s;
  const int messages = 10'000;
  for (int i = 0; i < messages; ++i) {
    Message m = order(static_cast<uint8_t>(1 + random() % 6), 0xffff, 1, 1);
    switch (random() % 4) {
      case 0: m.resize(1 + random() % 63); break;
      case 1: m.resize(65 + random() % 192, static_cast<uint8_t>(random())); break;
      case 2: m[random() % 6] ^= static_cast<uint8_t>(1 + random() % 255); break;
      default: m[PROTOCOL_ANSWER_ORDER_AT] = 0;
    }
    s.take(m);
  }
  check("HOST-15: 10,000 messages that are no orders are counted, without effect",
        s.host.malformed == messages && s.host.orders == 0 && s.c.requests.empty() && s.c.events.empty() &&
            s.c.silenced == 0 && s.c.resets == 0);
  s.take(order(PROTOCOL_ORDER_SILENCE, 0xffff, 0, 5));
  check("HOST-15: a good one behind them is executed", s.c.silenced == 1 && s.ended(1, 0, 0xffff, 5));
}

void lines() {
  Ordered third;
  third.c.unanswered = 2;
  third.take(order(PROTOCOL_ORDER_DISABLE, 4, 1, 1));
  check("HOST-15: two datagrams without answer, the third is good",
        third.c.requests.size() == 4 && third.ended(3, 0, 4, 1));
  Ordered silent;
  silent.c.unanswered = 1000;
  silent.take(order(PROTOCOL_ORDER_TEST, 0xffff, 1, 1));
  check("HOST-15: a line that does not answer: result 2",
        silent.c.requests.size() == 3 && silent.ended(4, 2, 0xffff, 1));
  Ordered partly;
  partly.c.taken = 4;
  partly.take(order(PROTOCOL_ORDER_TEST, 0xffff, 1, 1));
  check("HOST-15: an order that not all have taken: result 2",
        partly.c.requests.size() == 3 && partly.ended(4, 2, 0xffff, 1));
  Ordered fewer;
  fewer.c.slaves[2].status = PROTOCOL_SLAVE_ABSENT;
  fewer.serve();
  fewer.take(order(PROTOCOL_ORDER_TEST, 0xffff, 1, 1));
  check("HOST-15: those that are not there need not take it",
        fewer.c.requests.size() == 1 && fewer.ended(4, 0, 0xffff, 1));
  Ordered ordinary;
  ordinary.c.slaves[2].node = 0;
  ordinary.c.taken = 4;
  ordinary.serve();
  ordinary.take(order(PROTOCOL_ORDER_TEST, 0xffff, 1, 1));
  check("HOST-15: nor need an ordinary slave",
        ordinary.c.requests.size() == 1 && ordinary.ended(4, 0, 0xffff, 1));
  // The low half of the master's time begins anew after 71.6 minutes: no time-out.
  for (const uint32_t before : {10u, 100u, 1100u}) {
    Ordered wrapping;
    wrapping.c.time = 0x100000000 - before;
    wrapping.c.looks = 20;
    wrapping.take(order(PROTOCOL_ORDER_DISABLE, 4, 1, 1));
    check("HOST-15: an order while the master's time wraps", wrapping.c.time < 0x100000000 + 100000 &&
                                                                 wrapping.c.requests.size() == 2 &&
                                                                 wrapping.ended(3, 0, 4, 1));
  }
  Ordered hanging;
  hanging.c.requestHangs = true;
  hanging.take(order(PROTOCOL_ORDER_DISABLE, 4, 1, 1));
  check("HOST-15: a datagram that is never sent: result 2, the line stands still",
        hanging.ended(3, 2, 4, 1) && !hanging.host.line_moves);
}

void untold() {
  Ordered s;
  s.c.eventHangs = true;
  for (uint32_t i = 1; i <= 10; ++i) s.take(order(PROTOCOL_ORDER_ACKNOWLEDGE, 3, 0, i));
  check("HOST-15: events wait for their place: eight of them", s.c.events.empty() && s.host.untold == 2);
  s.take(order(PROTOCOL_ORDER_SILENCE, 0xffff, 0, 11));
  check("HOST-15: orders are executed meanwhile", s.c.silenced == 1);
  s.c.eventHangs = false;
  s.serve(20);
  bool inOrder = s.c.events.size() == 8;
  for (size_t i = 0; i < s.c.events.size(); ++i) inOrder = inOrder && s.c.events[i][4] == i + 1;
  check("HOST-15: and are told in order, each once", inOrder);
}

void storage() {
  for (const uint8_t code : {1, 2, 3, 4, 5, 6}) {
    Ordered s;
    s.c.logWriteFails = -1;
    s.host.log.failed = true;
    s.take(order(code, 4, 1, 1));
    check("HOST-15: no order of the server while the memory does not work: result 4",
          s.c.requests.empty() && s.c.silenced == 0 && s.c.resets == 0 && s.c.events.size() == 1 &&
              s.c.events[0][1] == PROTOCOL_RESULT_REFUSED);
  }
  Ordered later;
  later.c.logWriteFails = 1;
  later.take(order(PROTOCOL_ORDER_ACKNOWLEDGE, 4, 0, 1));  // executed, but not logged
  later.take(order(PROTOCOL_ORDER_ACKNOWLEDGE, 4, 0, 2));
  later.take(order(PROTOCOL_ORDER_ACKNOWLEDGE, 4, 0, 3));
  check("HOST-15: orders go on when it works again",
        later.c.events.size() == 3 && later.c.events[0][1] == 0 && later.c.events[1][1] == 4 &&
            later.c.events[2][1] == 0);
  Ordered start;
  start.host.store_failed = true;
  start.c.inputs = BOARD_SILENCE;
  start.pass(40);
  check("PANEL-01: buttons work without memory", start.c.silenced == 1);
}

void buttons() {
  const struct {
    uint8_t button, order;
    const char* name;
  } all[] = {{BOARD_SILENCE, PROTOCOL_ORDER_SILENCE, "silence"},
             {BOARD_ACKNOWLEDGE, PROTOCOL_ORDER_ACKNOWLEDGE, "acknowledge"},
             {BOARD_RESET, PROTOCOL_ORDER_RESET, "reset"}};
  for (const auto& b : all) {
    Ordered s;
    s.c.inputs = b.button;
    s.pass(500);
    check(std::string("PANEL-01: the button ") + b.name + " counts once while it is pressed",
          s.c.silenced == (b.order == 1) && s.c.resets == (b.order == 2) && s.ended(b.order, 0, 0xffff, 0));
    s.c.inputs = 0;
    s.pass(40);
    s.c.inputs = b.button;
    s.pass(40);
    check("PANEL-01: and again when it was let go", s.c.events.size() == 2);
  }
  Ordered bouncing;
  for (int i = 0; i < 200; ++i) {
    bouncing.c.inputs = i % 2 ? BOARD_RESET : 0;
    bouncing.serve();
  }
  check("PANEL-01: a contact that bounces does not count", bouncing.c.resets == 0);
  bouncing.c.inputs = BOARD_RESET;
  bouncing.pass(25);
  check("PANEL-01: until it stands", bouncing.c.resets == 0);
  bouncing.pass(10);
  check("PANEL-01: and then once", bouncing.c.resets == 1);
  for (int i = 0; i < 50; ++i) {
    bouncing.c.inputs = i % 2 ? BOARD_RESET : 0;
    bouncing.serve();
  }
  bouncing.c.inputs = 0;
  bouncing.pass(100);
  check("PANEL-01: nor does it when it is let go", bouncing.c.resets == 1);
  MasterController c;
  c.inputs = BOARD_RESET | BOARD_MAINS_FAILED;
  alarm_master host;
  const auto p = goodMaster();
  alarm_master_start(&host, &c, &p);
  for (int i = 0; i < 100; ++i) alarm_master_serve(&host);
  check("PANEL-01: a button that is pressed at the start does not count, what is wrong then does",
        c.resets == 0 && c.memory[MASTER_HOST_FAULTS] == MASTER_MAINS_FAILED_MASK);
  Ordered test;
  test.c.inputs = BOARD_TEST;
  test.pass(40);
  const bool on = test.c.memory[MASTER_MASTER_CONTROL] & MASTER_LAMP_TEST_MASK;
  test.c.inputs = 0;
  test.pass(40);
  check("PANEL-02: the lamp test lasts as long as its button is pressed",
        on && !(test.c.memory[MASTER_MASTER_CONTROL] & MASTER_LAMP_TEST_MASK) && !test.c.stopped);
}
}  // namespace

void testOrders() {
  orders();
  bounds();
  lines();
  untold();
  storage();
  buttons();
}

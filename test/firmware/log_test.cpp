// The log of a master.
#include "master_fake.h"

namespace {
constexpr uint16_t kAlarm = PROTOCOL_SLAVE_ALARM | PROTOCOL_SLAVE_LATCHED;

std::vector<log_record> newest(event_log& log, uint32_t count) {
  std::vector<log_record> all;
  for (uint32_t i = 0; i < count; ++i) {
    log_record r;
    if (event_log_read(&log, i, &r)) all.push_back(r);
  }
  return all;
}

bool is(const log_record& r, uint8_t kind, uint8_t position, uint16_t node, uint32_t detail) {
  return r.kind == kind && r.position == position && r.node == node && r.detail == detail;
}

void ring() {
  board b;
  event_log log;
  event_log_open(&log, &b, 3);
  log_record r;
  check("LOG-01: an erased memory holds no event",
        !event_log_read(&log, 0, &r) && log.last == 0 && !log.failed);
  b.erased = 0;
  event_log_open(&log, &b, 3);
  check("LOG-01: nor does one of zeros", log.last == 0);
  bool kept = true;
  for (uint32_t i = 1; i <= 2500; ++i) {
    const log_record w{0,
                       i * 1'000'000'000'000ull,
                       0,
                       static_cast<uint8_t>(i),
                       static_cast<uint8_t>(i >> 8),
                       static_cast<uint16_t>(i * 7),
                       i * 1'000'003};
    event_log_write(&log, &w);
    if (i % 100 == 50) event_log_open(&log, &b, 3);  // a restart
    kept = kept && event_log_read(&log, 0, &r) && r.number == i && r.time_us == w.time_us && r.life == 3 &&
           is(r, w.kind, w.position, w.node, w.detail);
  }
  check("LOG-01: the newest event can be read, also after restarts", kept);
  check("LOG-01: the last 1,000 are kept",
        newest(log, 1001).size() == 1000 && newest(log, 1000).back().number == 1501 && b.log.size() == 1000);
  // Number 2,500 is at place 500; a power failure leaves any bytes in one place.
  for (size_t at = 0; at < BOARD_LOG_BYTES; ++at) {
    auto spoiled = b;
    spoiled.log[500][at] ^= 0x10;
    event_log again;
    event_log_open(&again, &spoiled, 4);
    kept = kept && again.last == 2499 && event_log_read(&again, 0, &r) && r.number == 2499;
  }
  check("LOG-02: an event that is not whole is none, the others stay", kept);
  auto moved = b;
  moved.log[700] = moved.log[500];
  event_log again;
  event_log_open(&again, &moved, 4);
  check("LOG-02: nor is one at the place of another",
        again.last == 2500 && newest(again, 1000).size() == 999);
}

void events() {
  StartedMaster s;
  check("LOG-03: the log begins with the start", is(newest(s.host.log, 1).at(0), LOG_START, 0, 0, 1));
  s.c.slaves[2].status = kAlarm | PROTOCOL_SLAVE_SOUNDING;
  s.pass(20);
  check("LOG-03: an alarm", is(newest(s.host.log, 1).at(0), LOG_ALARM, 2, 3, 7) && s.host.log.last == 2 &&
                                newest(s.host.log, 1).at(0).life == s.host.line_life);
  s.c.slaves[2].status = PROTOCOL_SLAVE_LATCHED;
  s.pass(1500);
  check("LOG-03: it lasts until it is reset", s.host.log.last == 2);
  s.c.slaves[2].status = 0;
  s.pass(1500);
  check("LOG-03: and is over then", is(newest(s.host.log, 1).at(0), LOG_ALARM_OVER, 2, 3, 0));
  s.c.slaves[4].status = PROTOCOL_SLAVE_OPEN | PROTOCOL_SLAVE_WAITING | PROTOCOL_SLAVE_DISABLED;
  s.pass(20);
  check("LOG-03: a fault of a slave",
        is(newest(s.host.log, 1).at(0), LOG_SLAVE_FAULTS, 4, 5, PROTOCOL_SLAVE_OPEN));
  s.c.setState(PROTOCOL_MASTER_MAINS | PROTOCOL_MASTER_DISABLED);
  s.pass(20);
  check("LOG-03: one of the master",
        is(newest(s.host.log, 1).at(0), LOG_MASTER_FAULTS, 0, 0, PROTOCOL_MASTER_MAINS));
  const uint32_t before = s.host.log.last;
  s.pass(3000);
  check("LOG-03: each once", s.host.log.last == before);
}

// What comes and goes all the time must not wear out the memory, nor hide an alarm.
void chatter() {
  StartedMaster s;
  for (int i = 0; i < 10'000; ++i) {
    s.c.slaves[1].status = i % 2 ? PROTOCOL_SLAVE_OPEN : 0;
    s.c.setState(i % 2 ? PROTOCOL_MASTER_MAINS : 0);
    s.serve();
  }
  check("LOG-04: a fault that comes and goes is logged once a second at most", s.host.log.last <= 1 + 2 * 11);
  s.c.slaves[1].status = kAlarm;
  s.serve(2);
  check("LOG-04: an alarm that comes then is logged at once",
        newest(s.host.log, 2).at(0).kind == LOG_ALARM || newest(s.host.log, 2).at(1).kind == LOG_ALARM);
  s.c.slaves[1].status = PROTOCOL_SLAVE_SHORT;
  s.c.setState(0);
  s.pass(3000);
  log_record last{};
  for (const auto& r : newest(s.host.log, 10))
    if (r.kind == LOG_SLAVE_FAULTS && last.number == 0) last = r;
  check("LOG-04: what there is at the end is logged in any case", last.detail == PROTOCOL_SLAVE_SHORT);
}

// A table that changes while it is read byte by byte.
void tears() {
  struct Torn : MasterController {
    unsigned reads = 0;
    uint8_t readByte(uint16_t address) override {
      // Now and then the low byte of the status is a wrong one.
      if (address == MASTER_SLAVE_STATE && ++reads % 3 == 0) return PROTOCOL_SLAVE_ALARM;
      return MasterController::readByte(address);
    }
  } c;
  alarm_master host;
  const auto p = goodMaster();
  alarm_master_start(&host, &c, &p);
  for (int i = 0; i < 300; ++i) alarm_master_serve(&host);
  check("LOG-03: a state read while it changes does not count",
        host.picture.alarms == 0 && host.log.last == 1);
}
}  // namespace

void testLog() {
  ring();
  events();
  chatter();
  tears();
}

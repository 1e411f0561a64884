// The host program of an alarm master against a fake controller: its start, its life, and what it does when
// something does not work.
#include <algorithm>

#include "master_fake.h"

namespace {
constexpr uint8_t kRun = MASTER_LINE_RUN_MASK | MASTER_REPORT_RUN_MASK | MASTER_LINE_LISTED_MASK;

Message lifeOf(MasterController& c) {
  return {&c.memory[MASTER_MASTER_LIFE], &c.memory[MASTER_MASTER_LIFE] + 8};
}

void start() {
  MasterController c;
  alarm_master host;
  const auto p = goodMaster();
  check("HOST-02: a master starts", alarm_master_start(&host, &c, &p) == SELF_TEST_GOOD);
  check("its controller gets the parameters",
        c.word(MASTER_MASTER_ID) == 7 && c.word(MASTER_MASTER_PORT) == 0x50c3 &&
            c.word(MASTER_SERVER_PORT) == 0x51c3 &&
            std::equal(p.master_mac, p.master_mac + 6, &c.memory[MASTER_MASTER_MAC]) &&
            std::equal(p.server_mac, p.server_mac + 6, &c.memory[MASTER_SERVER_MAC]) &&
            std::equal(p.master_ip, p.master_ip + 4, &c.memory[MASTER_MASTER_IP]) &&
            std::equal(p.server_ip, p.server_ip + 4, &c.memory[MASTER_SERVER_IP]) &&
            std::equal(p.key, p.key + 16, &c.memory[MASTER_MASTER_KEY]) &&
            c.word(MASTER_BUS_CYCLE) == 25000 && c.word(MASTER_BUS_CYCLE + 2) == 0 &&
            c.word(MASTER_ANSWER_TIMEOUT) == 2500 && c.memory[MASTER_RETRIES] == 2 &&
            c.word(MASTER_REPORT_REPEAT) == 200 && c.word(MASTER_REPORT_HEARTBEAT) == 1000 &&
            c.memory[MASTER_SERVER_TIMEOUT] == 30 && c.memory[MASTER_MASTER_SELF_TEST] == 1);
  bool listed = true;
  for (unsigned i = 0; i < 256; ++i) listed = listed && c.expected[i] == (i < 5 ? i + 1 : 0);
  check("HOST-14: and the slaves expected", listed);
  check("HOST-12: and the promise to live", c.word(MASTER_HOST_ALIVE) == 5000);
  check("the line runs as the last thing",
        c.memory[MASTER_MASTER_CONTROL] == kRun && c.writes.back().first == MASTER_MASTER_CONTROL);
  check("HOST-13: the life is random, and so is that of the line another one",
        lifeOf(c) != Message(8, 0) && c.word(MASTER_LINE_LIFE) == 1 && host.line_life == 1);
  Message before = lifeOf(c);
  bool differs = true;
  for (unsigned life = 2; life <= 300; ++life) {
    c.reset();
    differs = differs && alarm_master_start(&host, &c, &p) == SELF_TEST_GOOD &&
              c.word(MASTER_LINE_LIFE) == life && lifeOf(c) != before;
    before = lifeOf(c);
  }
  check("HOST-16: both are other ones after each start", differs);
  c.reset();
  c.stored = 0xffff;
  alarm_master_start(&host, &c, &p);
  check("HOST-16: numbers of lives begin anew when all have been used",
        host.self_test == SELF_TEST_GOOD && c.word(MASTER_LINE_LIFE) == 1 && c.stored == 0x10001);
}

// The line runs whatever is wrong; reports only with right addresses and key.
void goesOn(const char* name, enum self_test expected, bool reports,
            const std::function<void(alarm_master_parameters&, MasterController&)>& spoil,
            bool listed = true) {
  MasterController c;
  auto p = goodMaster();
  spoil(p, c);
  alarm_master host;
  const enum self_test got = alarm_master_start(&host, &c, &p);
  for (int i = 0; i < 20; ++i) alarm_master_serve(&host);
  const uint8_t control = static_cast<uint8_t>(MASTER_LINE_RUN_MASK | (reports ? MASTER_REPORT_RUN_MASK : 0) |
                                               (listed ? MASTER_LINE_LISTED_MASK : 0));
  check(std::string(name) + ", but the line runs: " + self_test_text(expected),
        got == expected && c.memory[MASTER_MASTER_SELF_TEST] == expected &&
            c.memory[MASTER_MASTER_CONTROL] == control && !c.stopped && c.word(MASTER_HOST_ALIVE) > 0 &&
            c.watched > 0 && c.word(MASTER_LINE_LIFE) != 0);
}

void untouched(const char* name, const std::function<void(MasterController&)>& spoil) {
  MasterController c;
  spoil(c);
  alarm_master host;
  const auto p = goodMaster();
  const enum self_test got = alarm_master_start(&host, &c, &p);
  for (int i = 0; i < 20; ++i) alarm_master_serve(&host);
  check(std::string(name) + ": nothing is written, and the watchdog is left alone",
        got == SELF_TEST_CONTROLLER && c.writes.empty() && c.watched == 0);
}

void mistakes() {
  goesOn("master ID 0", SELF_TEST_MASTER_ID, false, [](auto& p, auto&) { p.master_id = 0; });
  goesOn("MAC of zeros", SELF_TEST_MAC, false,
         [](auto& p, auto&) { std::fill(p.master_mac, p.master_mac + 6, uint8_t{0}); });
  goesOn("MAC of a group", SELF_TEST_MAC, false, [](auto& p, auto&) { p.server_mac[0] = 1; });
  goesOn("IP of zeros", SELF_TEST_IP, false,
         [](auto& p, auto&) { std::fill(p.master_ip, p.master_ip + 4, uint8_t{0}); });
  goesOn("IP of a group", SELF_TEST_IP, false, [](auto& p, auto&) { p.server_ip[0] = 224; });
  goesOn("port 0", SELF_TEST_PORT, false, [](auto& p, auto&) { p.master_port = 0; });
  goesOn("server's port 0", SELF_TEST_PORT, false, [](auto& p, auto&) { p.server_port = 0; });
  goesOn("key of zeros", SELF_TEST_KEY, false,
         [](auto& p, auto&) { std::fill(p.key, p.key + PROTOCOL_KEY_BYTES, uint8_t{0}); });
  goesOn("bus cycle too short", SELF_TEST_BUS_CYCLE, true, [](auto& p, auto&) { p.bus_cycle_us = 9; });
  goesOn("bus cycle too long", SELF_TEST_BUS_CYCLE, true, [](auto& p, auto&) { p.bus_cycle_us = 41944; });
  goesOn("bus cycle far too long", SELF_TEST_BUS_CYCLE, true,
         [](auto& p, auto&) { p.bus_cycle_us = 0xffffffff; });
  goesOn("time-out too short", SELF_TEST_TIMEOUT, true, [](auto& p, auto&) { p.answer_timeout_us = 9; });
  goesOn("time-out too long", SELF_TEST_TIMEOUT, true, [](auto& p, auto&) { p.answer_timeout_us = 2622; });
  goesOn("too many retries", SELF_TEST_RETRIES, true, [](auto& p, auto&) { p.retries = 16; });
  goesOn("no repetition", SELF_TEST_REPORT, true, [](auto& p, auto&) { p.report_repeat_ms = 0; });
  goesOn("repetition too slow", SELF_TEST_REPORT, true, [](auto& p, auto&) { p.report_repeat_ms = 4096; });
  goesOn("no heartbeat", SELF_TEST_REPORT, true, [](auto& p, auto&) { p.report_heartbeat_ms = 0; });
  goesOn("heartbeat too slow", SELF_TEST_REPORT, true, [](auto& p, auto&) { p.report_heartbeat_ms = 4096; });
  goesOn("no time for the server", SELF_TEST_SERVER_TIMEOUT, true,
         [](auto& p, auto&) { p.server_timeout_s = 0; });
  goesOn("a promise too short", SELF_TEST_ALIVE, true, [](auto& p, auto&) { p.alive_ms = 9; });
  goesOn("one line", SELF_TEST_DISPLAY, true, [](auto& p, auto&) { p.panel.lines = 1; });
  goesOn("five lines", SELF_TEST_DISPLAY, true, [](auto& p, auto&) { p.panel.lines = 5; });
  goesOn("19 columns", SELF_TEST_DISPLAY, true, [](auto& p, auto&) { p.panel.columns = 19; });
  goesOn("41 columns", SELF_TEST_DISPLAY, true, [](auto& p, auto&) { p.panel.columns = 41; });
  static const alarm_place zero[] = {{0, "", ""}}, all[] = {{0xffff, "", ""}},
                           twice[] = {{3, "", ""}, {4, "", ""}, {3, "", ""}};
  goesOn(
      "a place without node ID", SELF_TEST_PLACES, true,
      [](auto& p, auto&) { p.panel.places = zero, p.panel.place_count = 1; }, false);
  goesOn(
      "a place of all", SELF_TEST_PLACES, true,
      [](auto& p, auto&) { p.panel.places = all, p.panel.place_count = 1; }, false);
  goesOn(
      "a node ID twice", SELF_TEST_PLACES, true,
      [](auto& p, auto&) { p.panel.places = twice, p.panel.place_count = 3; }, false);
  goesOn(
      "more places than the controller lists", SELF_TEST_PLACES, true,
      [](auto&, auto& c) { c.memory[MASTER_MAX_SLAVES] = 4; }, false);
  goesOn("a bit is stuck", SELF_TEST_MEMORY, true,
         [](auto&, auto& c) { c.stuck[MASTER_REQUEST_DATA + 5] = 0x10; });
  for (int line = 0; line < 3; ++line) {
    const auto dead = static_cast<uint16_t>(1 << line);
    goesOn("an address line is dead", SELF_TEST_MEMORY, true, [&](auto&, auto& c) {
      c.aliased = {MASTER_REQUEST_DATA, 8, dead};
    });
    goesOn("one of the event's is dead", SELF_TEST_MEMORY, true, [&](auto&, auto& c) {
      c.aliased = {MASTER_HOST_EVENT, PROTOCOL_HOST_EVENT_BYTES, dead};
    });
  }
  goesOn("an address is not kept", SELF_TEST_MEMORY, false,
         [](auto&, auto& c) { c.stuck[MASTER_SERVER_IP] = 0xff; });
  goesOn("the memory cannot be read", SELF_TEST_STORE, true, [](auto&, auto& c) { c.loadFails = -1; });
  goesOn("the memory cannot be written", SELF_TEST_STORE, true, [](auto&, auto& c) { c.storeFails = -1; });
  goesOn("the memory forgets", SELF_TEST_STORE, true, [](auto&, auto& c) { c.storeKeeps = false; });
  goesOn("no random numbers", SELF_TEST_RANDOM, true, [](auto&, auto& c) { c.randomFails = -1; });
  goesOn("neither memory nor random numbers", SELF_TEST_STORE, false,
         [](auto&, auto& c) { c.loadFails = -1, c.randomFails = -1; });
  untouched("another controller", [](auto& c) { c.memory[MASTER_MASTER_TYPE] = 0xf1; });
  untouched("no controller", [](auto& c) { c.memory[MASTER_MASTER_TYPE] = 0; });
}

// Every single call of the memory may fail, and every one from some on: the line always runs, and the life of
// the line is always another one.
void storage() {
  bool runs = true, told = true, differs = true;
  for (int call = 0; call < 3; ++call)
    for (const bool forever : {false, true}) {
      MasterController c;
      alarm_master host;
      const auto p = goodMaster();
      c.setWord(MASTER_LINE_LIFE, 9);  // of an earlier start
      c.stored = 8;
      (call == 0 ? c.loadFails : call == 1 ? c.storeFails : c.logWriteFails) = forever ? -1 : 1;
      alarm_master_start(&host, &c, &p);
      alarm_master_serve(&host);
      runs = runs && c.memory[MASTER_MASTER_CONTROL] == kRun;
      differs = differs && c.word(MASTER_LINE_LIFE) != 9 && c.word(MASTER_LINE_LIFE) != 0;
      told = told && (c.memory[MASTER_HOST_FAULTS] & MASTER_STORAGE_FAILED_MASK) != 0;
    }
  check("HOST-16: the line runs whichever call of the memory fails", runs);
  check("HOST-12: and the fault is told", told);
  check("HOST-16: the life of the line is another one then, too", differs);
  StartedMaster s;
  check("HOST-16: no fault is told while all works", s.c.memory[MASTER_HOST_FAULTS] == 0);
  s.c.logWriteFails = 1;
  s.c.slaves[0].status = PROTOCOL_SLAVE_ALARM;
  s.serve();
  check("HOST-16: a log that fails later is a fault",
        s.c.memory[MASTER_HOST_FAULTS] == MASTER_STORAGE_FAILED_MASK);
  s.c.slaves[1].status = PROTOCOL_SLAVE_ALARM;
  s.serve();
  check("HOST-16: until it works again", s.c.memory[MASTER_HOST_FAULTS] == 0);
  StartedMaster unread;
  unread.c.logReadFails = -1;
  const auto p = goodMaster();
  alarm_master_start(&unread.host, &unread.c, &p);
  check("HOST-16: a log that cannot be read stops nothing",
        unread.c.memory[MASTER_MASTER_CONTROL] == kRun && unread.host.self_test == SELF_TEST_GOOD);
}

// What lies just inside: in the registers as it is.
void accepted(const char* name, const std::function<void(alarm_master_parameters&)>& change) {
  MasterController c;
  auto p = goodMaster();
  change(p);
  alarm_master host;
  const bool started =
      alarm_master_start(&host, &c, &p) == SELF_TEST_GOOD && c.memory[MASTER_MASTER_CONTROL] == kRun;
  const uint32_t cycle = c.word(MASTER_BUS_CYCLE) | c.word(MASTER_BUS_CYCLE + 2) << 16;
  check(std::string("still allowed: ") + name,
        started && c.word(MASTER_MASTER_ID) == p.master_id && cycle == 25 * p.bus_cycle_us &&
            c.word(MASTER_ANSWER_TIMEOUT) == 25u * p.answer_timeout_us &&
            c.memory[MASTER_RETRIES] == p.retries && c.word(MASTER_REPORT_REPEAT) == p.report_repeat_ms &&
            c.word(MASTER_REPORT_HEARTBEAT) == p.report_heartbeat_ms &&
            c.memory[MASTER_SERVER_TIMEOUT] == p.server_timeout_s && c.word(MASTER_HOST_ALIVE) == p.alive_ms);
}

void limits() {
  accepted("the least master ID", [](auto& p) { p.master_id = 1; });
  accepted("the highest master ID", [](auto& p) { p.master_id = 0xffff; });
  accepted("a MAC with one bit", [](auto& p) {
    std::fill(p.server_mac, p.server_mac + 6, uint8_t{0});
    p.server_mac[5] = 1;
  });
  accepted("IPs from 1 to 223", [](auto& p) {
    p.master_ip[0] = 1;
    p.server_ip[0] = 223;
  });
  accepted("ports 1 and 65,535", [](auto& p) {
    p.master_port = 1;
    p.server_port = 0xffff;
  });
  accepted("the shortest times", [](auto& p) {
    p.bus_cycle_us = p.answer_timeout_us = p.alive_ms = 10;
    p.retries = 0;
    p.report_repeat_ms = p.report_heartbeat_ms = p.server_timeout_s = 1;
  });
  accepted("the longest times", [](auto& p) {
    p.bus_cycle_us = 41943, p.answer_timeout_us = 2621, p.alive_ms = 65535;
    p.retries = 15;
    p.report_repeat_ms = p.report_heartbeat_ms = 4095, p.server_timeout_s = 255;
  });
  accepted("a key with one bit", [](auto& p) {
    std::fill(p.key, p.key + PROTOCOL_KEY_BYTES, uint8_t{0});
    p.key[PROTOCOL_KEY_BYTES - 1] = 1;
  });
  accepted("the smallest display", [](auto& p) { p.panel.lines = 2, p.panel.columns = 20; });
  accepted("the largest display", [](auto& p) { p.panel.lines = 4, p.panel.columns = 40; });
  MasterController c;
  auto p = goodMaster();
  p.panel.place_count = 0;
  alarm_master host;
  check("an empty list is no mistake: no slave is expected",
        alarm_master_start(&host, &c, &p) == SELF_TEST_GOOD &&
            c.memory[MASTER_MASTER_CONTROL] == (MASTER_LINE_RUN_MASK | MASTER_REPORT_RUN_MASK));
}

// The host starts anew, the controller has run on.
void restarts() {
  StartedMaster s;
  const Message life = lifeOf(s.c);
  const unsigned lineLife = s.c.word(MASTER_LINE_LIFE);
  const auto p = goodMaster();
  alarm_master again;
  const size_t writes = s.c.writes.size();
  s.c.looks = 5;
  s.c.makeBusy();  // a datagram of before waits
  alarm_master_start(&again, &s.c, &p);
  check("HOST-16: a host that starts anew leaves the line running, and the master is the same",
        again.self_test == SELF_TEST_GOOD && !s.c.stopped && lifeOf(s.c) == life &&
            s.c.word(MASTER_LINE_LIFE) == lineLife && again.line_life == lineLife);
  check("HOST-16: a datagram that waits is not overwritten", s.c.overwritten.empty());
  bool keyWritten = false;
  for (size_t i = writes; i < s.c.writes.size(); ++i)
    keyWritten = keyWritten ||
                 (s.c.writes[i].first >= MASTER_MASTER_KEY && s.c.writes[i].first < MASTER_MASTER_LIFE + 8);
  check("HOST-13: key and life are not touched while reports run", !keyWritten);
  StartedMaster hung;
  hung.c.requestHangs = true;
  hung.c.makeBusy();
  alarm_master_start(&again, &hung.c, &p);
  check("HOST-16: not even if it waits for ever",
        again.self_test == SELF_TEST_MEMORY && hung.c.overwritten.empty() && !hung.c.stopped);
  s.c.reset();
  alarm_master_serve(&s.host);
  check("HOST-16: a controller that was reset is set up again, with other lives",
        s.c.memory[MASTER_MASTER_CONTROL] == kRun && lifeOf(s.c) != life &&
            s.c.word(MASTER_LINE_LIFE) == lineLife + 1);
  s.c.memory[MASTER_MASTER_TYPE] = 0;
  for (int i = 0; i < 10; ++i) alarm_master_serve(&s.host);
  check("a controller that has gone is told of once",
        s.c.notices == std::vector<std::string>{self_test_text(SELF_TEST_CONTROLLER)});
  s.c.memory[MASTER_MASTER_TYPE] = 0xf2;
  s.c.memory[MASTER_MASTER_CONTROL] = 0;
  alarm_master_serve(&s.host);
  alarm_master_serve(&s.host);
  check("HOST-16: a line that has stopped by itself runs again", s.c.memory[MASTER_MASTER_CONTROL] == kRun);
}

void life() {
  StartedMaster s;
  unsigned least = 5000;
  const unsigned watched = s.c.watched;
  for (int i = 0; i < 100; ++i) {
    s.serve();
    least = std::min(least, s.c.word(MASTER_HOST_ALIVE));
  }
  check("HOST-12: the host says in every pass that it lives", least == 5000 && s.c.watched == watched + 100);
  const unsigned probes = s.c.probes;
  s.pass(5000);
  check("HOST-17: it looks four times in that time whether the line moves",
        s.c.probes >= probes + 3 && s.c.probes <= probes + 5);
  s.c.unanswered = 1000000;
  const unsigned before = s.c.watched;
  s.pass(3000);
  check("HOST-17: a line that does not answer moves all the same", s.c.watched > before + 2500);
  s.c.requestHangs = true;
  s.pass(3000);
  const unsigned hung = s.c.watched;
  s.pass(5000);
  check("HOST-17: the watchdog is left alone when the line stands still", s.c.watched == hung);
  s.c.requestHangs = false;
  s.pass(5000);
  check("HOST-17: and served again when it moves", s.c.watched > hung);
  s.c.clockRuns = false;
  s.serve();
  const unsigned stopped = s.c.watched;
  s.serve(100);
  check("HOST-17: or when the controller's clock stands still", s.c.watched == stopped);
}

void inputs() {
  StartedMaster s;
  s.c.inputs = BOARD_MAINS_FAILED | BOARD_BATTERY_LOW | BOARD_EARTH_FAULT;
  s.pass(40);
  check("HOST-12: mains, battery and earth are told",
        s.c.memory[MASTER_HOST_FAULTS] ==
            (MASTER_MAINS_FAILED_MASK | MASTER_BATTERY_LOW_MASK | MASTER_EARTH_FAULT_MASK));
  s.c.inputs = BOARD_BATTERY_LOW;
  s.pass(40);
  check("and their ends", s.c.memory[MASTER_HOST_FAULTS] == MASTER_BATTERY_LOW_MASK);
}
}  // namespace

void testMaster() {
  start();
  mistakes();
  storage();
  limits();
  restarts();
  life();
  inputs();
}

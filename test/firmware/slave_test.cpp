// The host program of an alarm slave against a fake controller.
#include <algorithm>

#include "fake.h"

extern "C" {
#include "alarm-slave.h"
#include "alarm_slave.h"
}

namespace {
constexpr uint8_t kMessages[2][8] = {{1, 2, 3, 4, 5, 6, 7, 8}, {9, 10, 11, 12, 13, 14, 15, 16}};

struct SlaveController : board {
  bool clockRuns = true;
  bool byWrite = false;  // events are acknowledged by write
  uint8_t late = 0;      // the bit of a message that comes behind the host's next look at what has come
  uint32_t us = 0;
  bool detectorOff = false;  // somebody saw the detector without its enable

  SlaveController() { reset(); }
  void reset() {
    memory.fill(0);
    memory[ESC_ESC_TYPE] = 0xf1;
    memory[ESC_RAM_SIZE] = 1;
    memory[ESC_ALARM_ENABLE] = 1;
    setWord(ESC_DETECTOR_DEBOUNCE, 1000), setWord(ESC_DETECTOR_OFF_TIME, 2000);
    std::copy(kMessages[0], kMessages[0] + 8, &memory[ESC_ALARM_BROADCAST]);
    std::copy(kMessages[1], kMessages[1] + 8, &memory[ESC_ALARM_MESSAGE]);
  }
  uint8_t readByte(uint16_t address) override {
    const uint8_t value = board::readByte(address);
    if (address != ESC_ALARM_MESSAGES) return value;
    if (!byWrite) memory[address] = 0;
    if (late == 1) ++memory[ESC_ALARM_BROADCAST];
    if (late == 2) ++memory[ESC_ALARM_MESSAGE];
    memory[address] = static_cast<uint8_t>(memory[address] | late), late = 0;
    return value;
  }
  void writeByte(uint16_t address, uint8_t value) override {
    board::writeByte(address, byWrite && address == ESC_ALARM_MESSAGES ? 0 : value);
    if (address == ESC_ALARM_ENABLE && value != 1) detectorOff = true;
  }
  void wait(uint32_t time) override {
    for (us += time; us >= 1000; us -= 1000) {
      const unsigned left = word(ESC_HOST_ALIVE);
      if (clockRuns && left > 0) setWord(ESC_HOST_ALIVE, left - 1);
    }
  }
};

constexpr alarm_slave_parameters kGood{7, 12340, 2000, 5000};

void start() {
  SlaveController c;
  alarm_slave host;
  check("ALARM-08: a slave starts", alarm_slave_start(&host, &c, &kGood) == SELF_TEST_GOOD);
  check("its controller gets the parameters",
        c.word(ESC_STATION_ALIAS) == 7 && c.word(ESC_DETECTOR_DEBOUNCE) == 1234 &&
            c.word(ESC_DETECTOR_OFF_TIME) == 2000 && c.memory[ESC_SELF_TEST] == 1 &&
            c.memory[ESC_ALARM_ENABLE] == 1);
  check("ALARM-11: and the promise to live", c.word(ESC_HOST_ALIVE) == 5000);
  const int selfTest = c.lastWrite(ESC_SELF_TEST);
  check("the self-test is told behind node ID and epoch",
        c.lastWrite(ESC_STATION_ALIAS + 1) < selfTest && c.lastWrite(ESC_ALARM_EPOCH) < selfTest);
  check("user RAM is left as zeros", c.memory[ESC_USER_RAM] == 0 && c.memory[ESC_USER_RAM + 127] == 0);
  uint8_t last = host.epoch;
  bool differs = true;
  for (int i = 1; i <= 600; ++i) {
    if (i % 2) c.reset();
    differs = differs && alarm_slave_start(&host, &c, &kGood) == SELF_TEST_GOOD && host.epoch != last &&
              host.epoch != 0 && c.memory[ESC_ALARM_EPOCH] == host.epoch;
    last = host.epoch;
  }
  check("ALARM-13: the epoch is another one after each start", differs);
  check("ALARM-09: no start switches the detector off", !c.detectorOff);
}

// What is wrong is told; the detector is on all the same, and the host says that it lives.
void goesOn(
    const char* name, enum self_test expected, const alarm_slave_parameters& parameters,
    const std::function<void(SlaveController&)>& spoil = [](SlaveController&) {}) {
  SlaveController c;
  spoil(c);
  alarm_slave host;
  const enum self_test got = alarm_slave_start(&host, &c, &parameters);
  for (int i = 0; i < 20; ++i) alarm_slave_serve(&host);
  check(std::string(name) + ", but the detector goes on: " + self_test_text(expected),
        got == expected && c.memory[ESC_SELF_TEST] == expected && c.memory[ESC_ALARM_ENABLE] == 1 &&
            !c.detectorOff && c.word(ESC_HOST_ALIVE) > 0 && host.epoch != 0 && c.watched > 0);
}

void untouched(const char* name, const std::function<void(SlaveController&)>& spoil) {
  SlaveController c;
  spoil(c);
  alarm_slave host;
  const enum self_test got = alarm_slave_start(&host, &c, &kGood);
  for (int i = 0; i < 20; ++i) alarm_slave_serve(&host);
  check(std::string(name) + ": nothing is written, and the watchdog is left alone",
        got == SELF_TEST_CONTROLLER && c.writes.empty() && c.watched == 0);
}

void mistakes() {
  goesOn("node ID 0", SELF_TEST_NODE_ID, {0, 100, 10, 5000});
  goesOn("node ID of all", SELF_TEST_NODE_ID, {0xffff, 100, 10, 5000});
  goesOn("node ID of 9 bits in a controller of 8", SELF_TEST_NODE_ID, {0x101, 100, 10, 5000},
         [](auto& c) { c.stuck[ESC_STATION_ALIAS + 1] = 0xff; });
  goesOn("debounce too long", SELF_TEST_DEBOUNCE, {7, 655351, 10, 5000});
  goesOn("no off time", SELF_TEST_OFF_TIME, {7, 100, 0, 5000});
  goesOn("a promise too short", SELF_TEST_ALIVE, {7, 100, 10, 9});
  for (int bit = 0; bit < 8; ++bit)
    goesOn("a bit of the RAM is stuck", SELF_TEST_MEMORY, kGood,
           [&](auto& c) { c.stuck[ESC_USER_RAM + 16 * bit] = static_cast<uint8_t>(1 << bit); });
  for (int line = 0; line < 7; ++line)
    goesOn("an address line of the RAM is dead", SELF_TEST_MEMORY, kGood, [&](auto& c) {
      c.aliased = {ESC_USER_RAM, 128, static_cast<uint16_t>(1 << line)};
    });
  goesOn("a parameter is not kept", SELF_TEST_MEMORY, kGood,
         [](auto& c) { c.stuck[ESC_DETECTOR_OFF_TIME] = 0xff; });
  goesOn("the memory cannot be read", SELF_TEST_STORE, kGood, [](auto& c) { c.loadFails = -1; });
  goesOn("the memory cannot be read back", SELF_TEST_STORE, kGood,
         [](auto& c) { c.storeFails = 0, c.loadFails = 0, c.storeKeeps = false; });
  goesOn("the memory cannot be written", SELF_TEST_STORE, kGood, [](auto& c) { c.storeFails = -1; });
  goesOn("neither memory nor random numbers work", SELF_TEST_STORE, kGood,
         [](auto& c) { c.loadFails = -1, c.randomFails = -1; });
  untouched("another controller", [](auto& c) { c.memory[ESC_ESC_TYPE] = 0x11; });
  untouched("no controller, all ones", [](auto& c) { c.memory.fill(0xff); });
  untouched("no controller, all zeros", [](auto& c) { c.memory.fill(0); });
  untouched("another RAM", [](auto& c) { c.memory[ESC_RAM_SIZE] = 8; });
  check("a number that is no result has a text too",
        std::string(self_test_text(static_cast<enum self_test>(200))).size() > 10);
}

// What is no parameter leaves what the controller has.
void defaults() {
  SlaveController c;
  alarm_slave host;
  const alarm_slave_parameters none{0, 655351, 0, 0};
  alarm_slave_start(&host, &c, &none);
  check("ALARM-13: what is no parameter leaves the controller's setting",
        c.word(ESC_STATION_ALIAS) == 0 && c.word(ESC_DETECTOR_DEBOUNCE) == 1000 &&
            c.word(ESC_DETECTOR_OFF_TIME) == 2000 && c.word(ESC_HOST_ALIVE) == 10);
}

// An epoch without memory is never the one that the controller has, whatever is drawn.
void epochs() {
  for (const bool random : {true, false}) {
    SlaveController c;
    c.storeFails = -1;
    c.randomFails = random ? 0 : -1;
    alarm_slave host;
    bool differs = true;
    for (int i = 0; i < 2000; ++i) {
      const uint8_t before = c.memory[ESC_ALARM_EPOCH];
      alarm_slave_start(&host, &c, &kGood);
      differs = differs && host.epoch != before && host.epoch != 0;
    }
    check(random ? "ALARM-13: a random epoch is another one" : "ALARM-13: so is one without random numbers",
          differs);
  }
  SlaveController c;
  alarm_slave host;
  c.memory[ESC_ALARM_EPOCH] = 6;  // a random one of before
  c.stored = 5;
  alarm_slave_start(&host, &c, &kGood);
  check("ALARM-13: a stored number that the controller has already is left out",
        host.epoch == 7 && c.stored == 7);
  c.stored = 0xffffffff;
  alarm_slave_start(&host, &c, &kGood);
  check("ALARM-13: numbers begin anew when all have been used",
        host.epoch == 1 && host.self_test == SELF_TEST_GOOD);
}

void accepted(const char* name, const alarm_slave_parameters& parameters) {
  SlaveController c;
  alarm_slave host;
  check(std::string("still allowed: ") + name,
        alarm_slave_start(&host, &c, &parameters) == SELF_TEST_GOOD && c.memory[ESC_ALARM_ENABLE] == 1 &&
            c.word(ESC_STATION_ALIAS) == parameters.node_id &&
            c.word(ESC_DETECTOR_DEBOUNCE) == parameters.debounce_us / 10 &&
            c.word(ESC_DETECTOR_OFF_TIME) == parameters.off_time_ms &&
            c.word(ESC_HOST_ALIVE) == parameters.alive_ms);
}

void limits() {
  accepted("the least of all", {1, 0, 1, 10});
  accepted("the most of all", {0xfffe, 655350, 65535, 65535});
}

void messages() {
  SlaveController c;
  alarm_slave host;
  alarm_slave_start(&host, &c, &kGood);
  alarm_slave_serve(&host);
  check("without a message nothing is taken", host.broadcasts == 0 && host.messages == 0);
  c.memory[ESC_ALARM_MESSAGES] = 1;
  alarm_slave_serve(&host);
  check("ALARM-07: a message to all is taken",
        host.broadcasts == 1 && host.messages == 0 &&
            std::equal(kMessages[0], kMessages[0] + 8, host.last_broadcast));
  c.memory[ESC_ALARM_MESSAGES] = 2;
  alarm_slave_serve(&host);
  check("ALARM-07: a message to this slave is taken",
        host.broadcasts == 1 && host.messages == 1 &&
            std::equal(kMessages[1], kMessages[1] + 8, host.last_message));
  c.memory[ESC_ALARM_MESSAGES] = 3;
  alarm_slave_serve(&host);
  check("both at once too", host.broadcasts == 2 && host.messages == 2);
  for (bool byWrite : {false, true})
    for (uint8_t told : {1, 2})
      for (uint8_t late : {1, 2}) {
        SlaveController d;
        d.byWrite = byWrite, d.memory[0x014e] = byWrite;
        alarm_slave other;
        alarm_slave_start(&other, &d, &kGood);
        d.memory[ESC_ALARM_MESSAGES] = told, d.late = late;
        for (int i = 0; i < 3; ++i) alarm_slave_serve(&other);
        // Without acknowledge by write the late one is told once more.
        const unsigned both[2] = {other.broadcasts, other.messages};
        const bool taken = told == late ? both[told - 1] == (byWrite ? 1u : 2u) && both[2 - told] == 0
                                        : both[0] == 1 && both[1] == 1;
        check("ALARM-07, B-104: a message behind the look at what has come",
              taken && d.memory[ESC_ALARM_MESSAGES] == 0 &&
                  (late == 1 ? other.last_broadcast[0] == d.memory[ESC_ALARM_BROADCAST]
                             : other.last_message[0] == d.memory[ESC_ALARM_MESSAGE]));
      }
  c.setWord(ESC_SLAVE_STATE, PROTOCOL_SLAVE_ALARM | PROTOCOL_SLAVE_TEST_ALARM);
  check("the status is that of the controller", alarm_slave_status(&host) == 0x0201);
}

void life() {
  SlaveController c;
  alarm_slave host;
  alarm_slave_start(&host, &c, &kGood);
  unsigned least = 5000;
  for (int i = 0; i < 100; ++i) {
    alarm_slave_serve(&host);
    least = std::min(least, c.word(ESC_HOST_ALIVE));
  }
  check("ALARM-11: the host says in every pass that it lives", least == 5000 && c.watched == 100);
  c.clockRuns = false;
  alarm_slave_serve(&host);
  const unsigned watched = c.watched;
  for (int i = 0; i < 100; ++i) alarm_slave_serve(&host);
  check("ALARM-13: the watchdog is left alone while the controller's clock stands still",
        c.watched == watched);
  c.clockRuns = true;
  for (int i = 0; i < 3; ++i) alarm_slave_serve(&host);
  check("ALARM-13: and served again when it goes on", c.watched > watched);

  // A reset of the detector takes the supply away for off_time_ms, and that is no fault.
  c.setWord(ESC_SLAVE_STATE, PROTOCOL_SLAVE_UNWATCHED);
  const unsigned before = c.watched;
  for (int i = 0; i < 3000; ++i) alarm_slave_serve(&host);
  check("ALARM-13: the watchdog is served while a detector is reset", c.watched == before + 3000);
  for (int i = 0; i < 100; ++i) alarm_slave_serve(&host);
  check("ALARM-13: but not when its supply stays off", c.watched <= before + 3001);
  c.setWord(ESC_SLAVE_STATE, 0);
  const unsigned after = c.watched;
  alarm_slave_serve(&host);
  check("and again when it is back", c.watched == after + 1);
  c.memory[ESC_ALARM_ENABLE] = 0;
  alarm_slave_serve(&host);
  check("ALARM-13: a detector that is off by itself is switched on", c.memory[ESC_ALARM_ENABLE] == 1);
}

void resets() {
  SlaveController c;
  alarm_slave host;
  alarm_slave_start(&host, &c, &kGood);
  const uint8_t epoch = host.epoch;
  c.reset();
  alarm_slave_serve(&host);
  check("ALARM-13: a controller that was reset is set up again, in another epoch",
        c.memory[ESC_SELF_TEST] == 1 && c.word(ESC_STATION_ALIAS) == 7 && host.epoch == epoch + 1 &&
            c.memory[ESC_ALARM_EPOCH] == host.epoch);
  c.memory[ESC_ALARM_EPOCH] = 99;
  alarm_slave_serve(&host);
  check("ALARM-13: one with another epoch, too",
        host.epoch == epoch + 2 && c.memory[ESC_ALARM_EPOCH] == host.epoch && c.memory[ESC_SELF_TEST] == 1);
  c.memory[ESC_ESC_TYPE] = 0;
  for (int i = 0; i < 10; ++i) alarm_slave_serve(&host);
  check("a controller that has gone is told of once, and the watchdog is left alone",
        c.notices == std::vector<std::string>{self_test_text(SELF_TEST_CONTROLLER)} && c.watched == 0);
  c.reset();
  alarm_slave_serve(&host);
  check("one that comes back is set up", host.self_test == SELF_TEST_GOOD && c.memory[ESC_SELF_TEST] == 1);

  SlaveController deaf;
  deaf.stuck[ESC_SELF_TEST] = 0xff;
  alarm_slave_start(&host, &deaf, &kGood);
  const uint32_t stored = deaf.stored;
  for (int i = 0; i < 1000; ++i) alarm_slave_serve(&host);
  check("a self-test register that does not hold does not wear out the memory", deaf.stored == stored);
}
}  // namespace

void testSlave() {
  start();
  mistakes();
  defaults();
  epochs();
  limits();
  messages();
  life();
  resets();
}

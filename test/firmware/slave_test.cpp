// The host program of an alarm slave against a fake controller.
#include "fake.h"

extern "C" {
#include "alarm-slave.h"
#include "alarm_slave.h"
}

namespace {
constexpr uint8_t kMessages[2][8] = {{1, 2, 3, 4, 5, 6, 7, 8}, {9, 10, 11, 12, 13, 14, 15, 16}};

struct SlaveController : board {
  SlaveController() { reset(); }
  void reset() {
    memory.fill(0);
    memory[ESC_ESC_TYPE] = 0xf1;
    memory[ESC_RAM_SIZE] = 1;
    std::copy(kMessages[0], kMessages[0] + 8, &memory[ESC_ALARM_BROADCAST]);
    std::copy(kMessages[1], kMessages[1] + 8, &memory[ESC_ALARM_MESSAGE]);
  }
  uint8_t readByte(uint16_t address) override {
    const uint8_t value = board::readByte(address);
    if (address == ESC_ALARM_MESSAGES) memory[address] = 0;
    return value;
  }
};

constexpr alarm_slave_parameters kGood{7, 12340, 2000};

void start() {
  SlaveController c;
  alarm_slave host;
  check("ALARM-08: a slave starts", alarm_slave_start(&host, &c, &kGood) == SELF_TEST_GOOD);
  check("its controller gets the parameters",
        c.word(ESC_STATION_ALIAS) == 7 && c.word(ESC_DETECTOR_DEBOUNCE) == 1234 &&
            c.word(ESC_DETECTOR_OFF_TIME) == 2000 && c.memory[ESC_SELF_TEST] == 1 &&
            c.memory[ESC_ALARM_ENABLE] == 3);
  const int selfTest = c.lastWrite(ESC_SELF_TEST);
  check("the self-test is told behind node ID and epoch, and before reports are on",
        c.lastWrite(ESC_STATION_ALIAS + 1) < selfTest && c.lastWrite(ESC_ALARM_EPOCH) < selfTest &&
            selfTest < c.lastWrite(ESC_ALARM_ENABLE));
  check("user RAM is left as zeros", c.memory[ESC_USER_RAM] == 0 && c.memory[ESC_USER_RAM + 127] == 0);
  const uint8_t first = host.epoch;
  bool rises = true;
  for (int i = 1; i <= 300; ++i) {
    c.reset();
    rises = rises && alarm_slave_start(&host, &c, &kGood) == SELF_TEST_GOOD &&
            c.memory[ESC_ALARM_EPOCH] == static_cast<uint8_t>(first + i);
  }
  check("the epoch is another one after each start", rises);
}

void refused(
    const char* name, enum self_test expected, const alarm_slave_parameters& parameters,
    const std::function<void(SlaveController&)>& spoil = [](SlaveController&) {}) {
  SlaveController c;
  spoil(c);
  alarm_slave host;
  const enum self_test got = alarm_slave_start(&host, &c, &parameters);
  const bool told = expected == SELF_TEST_CONTROLLER ? c.writes.empty() : c.memory[ESC_SELF_TEST] == expected;
  check(std::string(name) + ": " + self_test_text(expected),
        got == expected && told && c.memory[ESC_ALARM_ENABLE] == 0);
}

void mistakes() {
  refused("node ID 0", SELF_TEST_NODE_ID, {0, 100, 10});
  refused("node ID of all", SELF_TEST_NODE_ID, {0xffff, 100, 10});
  refused("node ID of 9 bits in a controller of 8", SELF_TEST_NODE_ID, {0x101, 100, 10},
          [](auto& c) { c.stuck[ESC_STATION_ALIAS + 1] = 0xff; });
  refused("debounce too long", SELF_TEST_DEBOUNCE, {7, 655351, 10});
  refused("no off time", SELF_TEST_OFF_TIME, {7, 100, 0});
  refused("another controller", SELF_TEST_CONTROLLER, kGood, [](auto& c) { c.memory[ESC_ESC_TYPE] = 0x11; });
  refused("no controller", SELF_TEST_CONTROLLER, kGood,
          [](auto& c) { c.memory.fill(0xff), c.memory[ESC_ALARM_ENABLE] = 0; });
  refused("another RAM", SELF_TEST_CONTROLLER, kGood, [](auto& c) { c.memory[ESC_RAM_SIZE] = 8; });
  for (int bit = 0; bit < 8; ++bit)
    refused("a bit of the RAM is stuck", SELF_TEST_MEMORY, kGood,
            [&](auto& c) { c.stuck[ESC_USER_RAM + 16 * bit] = static_cast<uint8_t>(1 << bit); });
  for (int line = 0; line < 7; ++line)
    refused("an address line of the RAM is dead", SELF_TEST_MEMORY, kGood, [&](auto& c) {
      c.aliased = {ESC_USER_RAM, 128, static_cast<uint16_t>(1 << line)};
    });
  refused("a parameter is not kept", SELF_TEST_MEMORY, kGood,
          [](auto& c) { c.stuck[ESC_DETECTOR_OFF_TIME] = 0xff; });
  refused("no non-volatile memory", SELF_TEST_STORE, kGood, [](auto& c) { c.storeWorks = false; });
  check("a number that is no result has a text too",
        std::string(self_test_text(static_cast<enum self_test>(200))).size() > 10);
}

void accepted(const char* name, const alarm_slave_parameters& parameters) {
  SlaveController c;
  alarm_slave host;
  check(std::string("still allowed: ") + name,
        alarm_slave_start(&host, &c, &parameters) == SELF_TEST_GOOD && c.memory[ESC_ALARM_ENABLE] == 3 &&
            c.word(ESC_STATION_ALIAS) == parameters.node_id &&
            c.word(ESC_DETECTOR_DEBOUNCE) == parameters.debounce_us / 10 &&
            c.word(ESC_DETECTOR_OFF_TIME) == parameters.off_time_ms);
}

void limits() {
  accepted("the least node ID, no debounce, the least off time", {1, 0, 1});
  accepted("the highest node ID, the longest debounce and off time", {0xfffe, 655350, 65535});
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
  c.memory[ESC_ALARM_STATUS] = 3, c.memory[ESC_ALARM_STATUS + 1] = 0x32;
  const struct alarm_slave_status s = alarm_slave_status(&host);
  check("the status is that of the controller", s.events == 3 && s.detector == 2 && s.supply && s.latched);
  const uint8_t epoch = host.epoch;
  c.reset();
  alarm_slave_serve(&host);
  check("a controller that was reset is set up again, in another epoch",
        c.memory[ESC_ALARM_ENABLE] == 3 && c.word(ESC_STATION_ALIAS) == 7 && host.epoch == epoch + 1 &&
            c.memory[ESC_ALARM_EPOCH] == host.epoch);
  c.reset();
  c.memory[ESC_ESC_TYPE] = 0;
  try {
    alarm_slave_serve(&host);
    check("a controller that has gone is fatal", false);
  } catch (const std::exception&) {
    check("a controller that has gone is fatal", c.fatal == self_test_text(SELF_TEST_CONTROLLER));
  }
}
}  // namespace

void testSlave() {
  start();
  mistakes();
  limits();
  messages();
}

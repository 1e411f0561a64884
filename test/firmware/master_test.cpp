// The host program of an alarm master against a fake controller, and commands by the ten thousand.
#include <mbedtls/md.h>

#include <deque>
#include <random>

#include "fake.h"

extern "C" {
#include "alarm-master.h"
#include "alarm-slave.h"
#include "alarm_master.h"
}

namespace {
using Message = std::vector<uint8_t>;

struct Request {
  unsigned command, adp, ado;
  Message data;
  bool operator==(const Request& o) const {
    return command == o.command && adp == o.adp && ado == o.ado && data == o.data;
  }
};

// A master whose line has `nodes` slaves.
struct MasterController : board {
  std::deque<Message> mailbox;
  std::vector<Request> requests;
  std::vector<Message> events;
  unsigned nodes = 5;
  int unanswered = 0;  // so many requests get no answer
  unsigned looks = 0;  // at the status before a request is done
  bool requestHangs = false, eventHangs = false;
  uint32_t time = 0;
  size_t buzzerOffBefore = 999;  // requests that came before the buzzer was switched off

  MasterController() { reset(); }
  void reset() {
    memory.fill(0);
    memory[MASTER_MASTER_TYPE] = 0xf2;
    memory[MASTER_SLAVES_PRESENT] = static_cast<uint8_t>(nodes);
  }

  uint8_t readByte(uint16_t address) override {
    if (address == MASTER_MASTER_STATUS) {
      if (busy_ && !requestHangs && looksLeft_-- == 0) {
        busy_ = false;
        done_ = true;
      }
      return static_cast<uint8_t>(
          (mailbox.empty() ? 0 : MASTER_MAILBOX_WAITING_MASK) | (done_ ? MASTER_REQUEST_DONE_MASK : 0) |
          (busy_ ? MASTER_REQUEST_BUSY_MASK : 0) | (eventHangs ? MASTER_HOST_EVENT_BUSY_MASK : 0));
    }
    if (address >= MASTER_MASTER_TIME && address < MASTER_MASTER_TIME + 4)
      return static_cast<uint8_t>((address == MASTER_MASTER_TIME ? ++time : time) >>
                                  (8 * (address - MASTER_MASTER_TIME)));
    if (address == MASTER_MAILBOX_LENGTH)
      return mailbox.empty() ? 0 : static_cast<uint8_t>(mailbox[0].size());
    if (address == MASTER_MAILBOX_LENGTH + 1)
      return mailbox.empty() ? 0 : static_cast<uint8_t>(mailbox[0].size() >> 8);
    if (address == MASTER_MAILBOX_DATA) {
      const uint8_t at = memory[MASTER_MAILBOX_OFFSET]++;
      return mailbox.empty() || at >= mailbox[0].size() ? 0xee : mailbox[0][at];
    }
    if (address == MASTER_REQUEST_ANSWERED) done_ = false;
    return board::readByte(address);
  }
  void writeByte(uint16_t address, uint8_t value) override {
    board::writeByte(address, value);
    if (address == MASTER_MASTER_CONTROL) {
      if (value & MASTER_BUZZER_OFF_MASK) buzzerOffBefore = requests.size();
      memory[address] = value & 3;
    }
    if (address == MASTER_MAILBOX_CONTROL && value == 1 && !mailbox.empty()) mailbox.pop_front();
    if (address == MASTER_REQUEST_CONTROL && value == 1) request();
    if (address == MASTER_HOST_EVENT_CONTROL && value == 1)
      events.emplace_back(&memory[MASTER_HOST_EVENT], &memory[MASTER_HOST_EVENT + 6]);
  }
  void wait(uint32_t us) override { time += us; }
  bool untouched() const { return requests.empty() && events.empty() && mailbox.empty(); }

 private:
  void request() {
    const Request r{
        memory[MASTER_REQUEST_COMMAND], word(MASTER_REQUEST_ADDRESS), word(MASTER_REQUEST_ADDRESS + 2),
        Message(&memory[MASTER_REQUEST_DATA], &memory[MASTER_REQUEST_DATA] + memory[MASTER_REQUEST_LENGTH])};
    requests.push_back(r);
    busy_ = true;
    done_ = false;
    looksLeft_ = looks;
    const bool answered = unanswered == 0;
    if (!answered) --unanswered;
    memory[MASTER_REQUEST_ANSWERED] = answered;
    memory[MASTER_REQUEST_COUNTER] = static_cast<uint8_t>(!answered                      ? 0
                                                          : r.command == 8               ? nodes
                                                          : r.adp >= 1 && r.adp <= nodes ? 1
                                                                                         : 0);
    memory[MASTER_REQUEST_COUNTER + 1] = 0;
  }
  bool busy_ = false, done_ = false;
  unsigned looksLeft_ = 0;
};

alarm_master_parameters good() {
  alarm_master_parameters p{7,
                            {2, 0, 0, 0, 0, 1},
                            {2, 0, 0, 0, 0, 2},
                            {192, 168, 1, 2},
                            {192, 168, 1, 3},
                            50000,
                            50001,
                            1000,
                            100,
                            2,
                            200,
                            1000,
                            {}};
  for (uint8_t i = 0; i < PROTOCOL_KEY_BYTES; ++i) p.key[i] = static_cast<uint8_t>(i + 1);
  return p;
}

void put(Message& m, uint32_t v, int bytes) {
  while (bytes-- > 0) m.push_back(static_cast<uint8_t>(v >> (8 * bytes)));
}

// A command with a right code.
Message message(uint16_t boot, uint32_t counter, uint8_t code, uint16_t node) {
  Message m;
  put(m, 0x4641, 2), put(m, 0x0103, 2), put(m, 7, 2), put(m, boot, 2), put(m, counter, 4), put(m, code, 1),
      put(m, 0, 1), put(m, node, 2);
  uint8_t digest[32];
  const auto p = good();
  mbedtls_md_hmac(mbedtls_md_info_from_type(MBEDTLS_MD_SHA256), p.key, sizeof p.key, m.data(), m.size(),
                  digest);
  m.insert(m.end(), digest, digest + 16);
  return m;
}

struct Started {
  MasterController c;
  alarm_master host;
  Started() {
    const auto p = good();
    alarm_master_start(&host, &c, &p);
    c.writes.clear();
  }
  void take(const Message& m) {
    c.mailbox.push_back(m);
    alarm_master_serve(&host);
  }
  // The end of the only command, as the server is told.
  bool ended(uint8_t code, uint8_t result, uint16_t node, uint16_t counter) const {
    return c.events.size() == 1 && c.events[0] == Message{code,
                                                          result,
                                                          static_cast<uint8_t>(node),
                                                          static_cast<uint8_t>(node >> 8),
                                                          static_cast<uint8_t>(counter),
                                                          static_cast<uint8_t>(counter >> 8)};
  }
};

void start() {
  MasterController c;
  alarm_master host;
  const auto p = good();
  check("HOST-02: a master starts", alarm_master_start(&host, &c, &p) == SELF_TEST_GOOD);
  check("its controller gets the parameters",
        c.word(MASTER_MASTER_ID) == 7 && c.word(MASTER_BOOT_NUMBER) == 1 &&
            c.word(MASTER_MASTER_PORT) == 0x50c3 && c.word(MASTER_SERVER_PORT) == 0x51c3 &&
            std::equal(p.master_mac, p.master_mac + 6, &c.memory[MASTER_MASTER_MAC]) &&
            std::equal(p.server_mac, p.server_mac + 6, &c.memory[MASTER_SERVER_MAC]) &&
            std::equal(p.master_ip, p.master_ip + 4, &c.memory[MASTER_MASTER_IP]) &&
            std::equal(p.server_ip, p.server_ip + 4, &c.memory[MASTER_SERVER_IP]) &&
            c.word(MASTER_BUS_CYCLE) == 25000 && c.word(MASTER_BUS_CYCLE + 2) == 0 &&
            c.word(MASTER_ANSWER_TIMEOUT) == 2500 && c.memory[MASTER_RETRIES] == 2 &&
            c.word(MASTER_REPORT_REPEAT) == 200 && c.word(MASTER_REPORT_HEARTBEAT) == 1000 &&
            c.memory[MASTER_MASTER_SELF_TEST] == 1);
  check("the line runs as the last thing",
        c.memory[MASTER_MASTER_CONTROL] == 3 && c.writes.back().first == MASTER_MASTER_CONTROL);
  bool rises = true;
  for (unsigned boot = 2; boot <= 300; ++boot) {
    c.reset();
    rises = rises && alarm_master_start(&host, &c, &p) == SELF_TEST_GOOD &&
            c.word(MASTER_BOOT_NUMBER) == boot && host.boot == boot;
  }
  check("the boot number never repeats", rises);
}

void refused(const char* name, enum self_test expected,
             const std::function<void(alarm_master_parameters&, MasterController&)>& spoil) {
  MasterController c;
  auto p = good();
  spoil(p, c);
  alarm_master host;
  const enum self_test got = alarm_master_start(&host, &c, &p);
  const bool told =
      expected == SELF_TEST_CONTROLLER ? c.writes.empty() : c.memory[MASTER_MASTER_SELF_TEST] == expected;
  check(std::string(name) + ": " + self_test_text(expected),
        got == expected && told && c.memory[MASTER_MASTER_CONTROL] == 0);
}

void mistakes() {
  refused("master ID 0", SELF_TEST_MASTER_ID, [](auto& p, auto&) { p.master_id = 0; });
  refused("MAC of zeros", SELF_TEST_MAC,
          [](auto& p, auto&) { std::fill(p.master_mac, p.master_mac + 6, uint8_t{0}); });
  refused("MAC of a group", SELF_TEST_MAC, [](auto& p, auto&) { p.server_mac[0] = 1; });
  refused("IP of zeros", SELF_TEST_IP,
          [](auto& p, auto&) { std::fill(p.master_ip, p.master_ip + 4, uint8_t{0}); });
  refused("IP of a group", SELF_TEST_IP, [](auto& p, auto&) { p.server_ip[0] = 224; });
  refused("IP of all", SELF_TEST_IP,
          [](auto& p, auto&) { std::fill(p.server_ip, p.server_ip + 4, uint8_t{255}); });
  refused("port 0", SELF_TEST_PORT, [](auto& p, auto&) { p.master_port = 0; });
  refused("server's port 0", SELF_TEST_PORT, [](auto& p, auto&) { p.server_port = 0; });
  refused("bus cycle too short", SELF_TEST_BUS_CYCLE, [](auto& p, auto&) { p.bus_cycle_us = 9; });
  refused("bus cycle too long", SELF_TEST_BUS_CYCLE, [](auto& p, auto&) { p.bus_cycle_us = 41944; });
  refused("time-out too short", SELF_TEST_TIMEOUT, [](auto& p, auto&) { p.answer_timeout_us = 9; });
  refused("time-out too long", SELF_TEST_TIMEOUT, [](auto& p, auto&) { p.answer_timeout_us = 2622; });
  refused("too many retries", SELF_TEST_RETRIES, [](auto& p, auto&) { p.retries = 16; });
  refused("no repetition", SELF_TEST_REPORT, [](auto& p, auto&) { p.report_repeat_ms = 0; });
  refused("repetition too slow", SELF_TEST_REPORT, [](auto& p, auto&) { p.report_repeat_ms = 4096; });
  refused("no heartbeat", SELF_TEST_REPORT, [](auto& p, auto&) { p.report_heartbeat_ms = 0; });
  refused("heartbeat too slow", SELF_TEST_REPORT, [](auto& p, auto&) { p.report_heartbeat_ms = 4096; });
  refused("key of zeros", SELF_TEST_KEY,
          [](auto& p, auto&) { std::fill(p.key, p.key + PROTOCOL_KEY_BYTES, uint8_t{0}); });
  refused("another controller", SELF_TEST_CONTROLLER,
          [](auto&, auto& c) { c.memory[MASTER_MASTER_TYPE] = 0xf1; });
  refused("no controller", SELF_TEST_CONTROLLER, [](auto&, auto& c) { c.memory[MASTER_MASTER_TYPE] = 0; });
  refused("a bit is stuck", SELF_TEST_MEMORY,
          [](auto&, auto& c) { c.stuck[MASTER_REQUEST_DATA + 5] = 0x10; });
  for (int line = 0; line < 3; ++line) {
    const auto dead = static_cast<uint16_t>(1 << line);
    refused("an address line is dead", SELF_TEST_MEMORY, [&](auto&, auto& c) {
      c.aliased = {MASTER_REQUEST_DATA, 8, dead};
    });
    refused("one of the event's is dead", SELF_TEST_MEMORY, [&](auto&, auto& c) {
      c.aliased = {MASTER_HOST_EVENT, PROTOCOL_HOST_EVENT_BYTES, dead};
    });
  }
  refused("a parameter is not kept", SELF_TEST_MEMORY,
          [](auto&, auto& c) { c.stuck[MASTER_SERVER_IP] = 0xff; });
  refused("no non-volatile memory", SELF_TEST_STORE, [](auto&, auto& c) { c.storeWorks = false; });
  refused("non-volatile memory that forgets", SELF_TEST_STORE, [](auto&, auto& c) { c.storeKeeps = false; });
  refused("no boot number left", SELF_TEST_BOOTS_USED_UP, [](auto&, auto& c) { c.stored = 0xffff; });
}

// What lies just inside: started, and in the registers as it is.
void accepted(const char* name, const std::function<void(alarm_master_parameters&)>& change,
              uint32_t stored = 0) {
  MasterController c;
  auto p = good();
  change(p);
  c.stored = stored;
  alarm_master host;
  const bool started =
      alarm_master_start(&host, &c, &p) == SELF_TEST_GOOD && c.memory[MASTER_MASTER_CONTROL] == 3;
  const uint32_t cycle = c.word(MASTER_BUS_CYCLE) | c.word(MASTER_BUS_CYCLE + 2) << 16;
  check(std::string("still allowed: ") + name,
        started && c.word(MASTER_MASTER_ID) == p.master_id && c.word(MASTER_BOOT_NUMBER) == stored + 1 &&
            cycle == 25 * p.bus_cycle_us && c.word(MASTER_ANSWER_TIMEOUT) == 25u * p.answer_timeout_us &&
            c.memory[MASTER_RETRIES] == p.retries && c.word(MASTER_REPORT_REPEAT) == p.report_repeat_ms &&
            c.word(MASTER_REPORT_HEARTBEAT) == p.report_heartbeat_ms);
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
  accepted("the shortest bus cycle", [](auto& p) { p.bus_cycle_us = 10; });
  accepted("the longest bus cycle", [](auto& p) { p.bus_cycle_us = 41943; });
  accepted("the shortest time-out", [](auto& p) { p.answer_timeout_us = 10; });
  accepted("the longest time-out", [](auto& p) { p.answer_timeout_us = 2621; });
  accepted("no retry", [](auto& p) { p.retries = 0; });
  accepted("the most retries", [](auto& p) { p.retries = 15; });
  accepted("the quickest reports", [](auto& p) { p.report_repeat_ms = p.report_heartbeat_ms = 1; });
  accepted("the slowest repetition", [](auto& p) { p.report_repeat_ms = 4095; });
  accepted("the slowest heartbeat", [](auto& p) { p.report_heartbeat_ms = 4095; });
  accepted("a key with one bit", [](auto& p) {
    std::fill(p.key, p.key + PROTOCOL_KEY_BYTES, uint8_t{0});
    p.key[PROTOCOL_KEY_BYTES - 1] = 1;
  });
  accepted(
      "the last boot number", [](auto&) {}, 0xfffe);
}

void commands() {
  // The code of this one was made with another library (Python's hmac).
  const Message known = {0x46, 0x41, 1,    3,    0,    7,    0,    1,    0,    0,    0,
                         5,    1,    0,    0xff, 0xff, 0x09, 0x39, 0xba, 0x02, 0x8c, 0x29,
                         0xf9, 0x97, 0x04, 0x08, 0x95, 0x61, 0x4f, 0x1e, 0x87, 0x24};
  Started all;
  all.take(known);
  check(
      "a clear command goes to all slaves and to their hosts",
      all.c.requests == std::vector<Request>{{8, 0, 0x0e8c, {1}}, {8, 0, 0x0e90, {1, 0, 0, 0, 0, 0, 0, 0}}});
  check("and switches the master's own signals off before", all.c.buzzerOffBefore == 0);
  check("the server is told", all.ended(1, 0, 0xffff, 5) && all.host.accepted == 1);

  Started one;
  one.take(message(1, 0, 2, 4));
  check(
      "a detector reset goes to one slave and to its host",
      one.c.requests == std::vector<Request>{{5, 4, 0x0e8c, {2}}, {5, 4, 0x0e98, {2, 0, 0, 0, 0, 0, 0, 0}}});
  check("and leaves the signals on", one.c.buzzerOffBefore == 999 && one.ended(2, 0, 4, 0));

  Started none;
  none.take(message(1, 70000, 2, 9));
  check("a node that is not there: three attempts, result 3",
        none.c.requests.size() == 3 && none.ended(2, 3, 9, 70000 & 0xffff));
  Started zero;
  zero.take(message(1, 1, 2, 0));
  check("node 0 is nobody: no datagram", zero.c.requests.empty() && zero.ended(2, 3, 0, 1));
  Started unknown;
  unknown.take(message(1, 1, 3, 4));
  check("an unknown command: result 1", unknown.c.requests.empty() && unknown.ended(3, 1, 4, 1));
  Started third;
  third.c.unanswered = 2;
  third.take(message(1, 1, 2, 4));
  check("two requests without answer, the third is good",
        third.c.requests.size() == 4 && third.ended(2, 0, 4, 1));
  Started silent;
  silent.c.unanswered = 1000;
  silent.take(message(1, 1, 1, 0xffff));
  check("a line that does not answer: result 2",
        silent.c.requests.size() == 3 && silent.ended(1, 2, 0xffff, 1));
  Started partly;
  partly.c.memory[MASTER_SLAVES_PRESENT] = 6;
  partly.take(message(1, 1, 1, 0xffff));
  check("a command that not all have taken: result 2",
        partly.c.requests.size() == 3 && partly.ended(1, 2, 0xffff, 1));
  // The master's time begins anew after 71.6 minutes: an answer that comes a little later is no time-out.
  for (const uint32_t before : {10u, 100u, 300u}) {
    Started wrapping;
    wrapping.c.time = 0u - 1000 - before;  // it waits for a command for a millisecond first
    wrapping.c.looks = 20;
    wrapping.take(message(1, 1, 2, 4));
    check("a command while the master's time wraps",
          wrapping.c.time < 100000 && wrapping.c.requests.size() == 2 && wrapping.ended(2, 0, 4, 1));
  }
  Started hanging;
  hanging.c.requestHangs = true;
  hanging.take(message(1, 1, 2, 4));
  check("a request that never ends: result 2", hanging.ended(2, 2, 4, 1));
  Started untold;
  untold.c.eventHangs = true;
  untold.take(message(1, 1, 2, 4));
  check("an end that cannot be told is counted", untold.c.events.empty() && untold.host.untold == 1);

  Started again;
  again.take(message(1, 10, 2, 4));
  const uint16_t boot = again.host.boot;
  again.c.reset();
  alarm_master_serve(&again.host);
  check("a controller that was reset is set up again, with another boot number",
        again.c.memory[MASTER_MASTER_CONTROL] == 3 && again.host.boot == boot + 1 &&
            again.c.word(MASTER_BOOT_NUMBER) == boot + 1u);
  again.take(message(boot, 11, 2, 4));
  check("commands of the boot before are refused then",
        again.host.replayed == 1 && again.c.events.size() == 1);
  again.take(message(static_cast<uint16_t>(boot + 1), 1, 2, 4));
  check("and counters begin anew", again.host.accepted == 1 && again.c.events.size() == 2);
}

// Ten thousand messages that must have no effect, then one that must.
void without_effect(const char* name, uint32_t alarm_master::*count,
                    const std::function<Message(std::mt19937&)>& make) {
  constexpr int kMessages = 10'000;
  std::mt19937 random(4);
  Started s;
  s.take(message(1, 1000, 2, 1));
  s.c.requests.clear(), s.c.events.clear(), s.c.writes.clear();
  for (int i = 0; i < kMessages; ++i) s.take(make(random));
  // Of the registers only those of the mailbox are written.
  const bool nothing = s.c.untouched() && !s.c.wrote(0, MASTER_MAILBOX_LENGTH - 1) && s.host.accepted == 1;
  check(std::string("10,000 ") + name + ": counted, without effect", nothing && s.host.*count == kMessages);
  s.take(message(1, 1001, 2, 1));
  check(std::string("a good one behind ") + name, s.host.accepted == 2 && s.ended(2, 0, 1, 1001));
}

void attacks() {
  without_effect("malformed", &alarm_master::malformed, [](std::mt19937& r) {
    Message m = message(1, 2000 + r() % 1000, 1, 0xffff);
    switch (r() % 5) {
      case 0: m.resize(r() % 32); break;  // cut off
      case 1:
        m[r() % 6] ^= static_cast<uint8_t>(1 + r() % 255);
        break;  // another beginning, or for another master
      case 2: m[13] = static_cast<uint8_t>(1 + r() % 255); break;
      case 3:
        for (auto& b : m) b = static_cast<uint8_t>(r());
        m[0] = 0x45;
        break;
      default: m.insert(m.begin() + r() % 32, static_cast<uint8_t>(r()));
    }
    return m;
  });
  without_effect("oversized", &alarm_master::malformed, [](std::mt19937& r) {
    Message m = message(1, 2000 + r() % 1000, 1, 0xffff);
    m.resize(33 + r() % 224, static_cast<uint8_t>(r()));
    return m;
  });
  without_effect("forged", &alarm_master::forged, [](std::mt19937& r) {
    Message m = message(1, 2000 + r() % 1000, 1, 0xffff);
    switch (r() % 3) {
      case 0: m[16 + r() % 16] ^= static_cast<uint8_t>(1 << r() % 8); break;  // one wrong bit in the code
      case 1:
        for (size_t i = 16; i < 32; ++i) m[i] = static_cast<uint8_t>(r());
        break;
      default: {  // one wrong bit in what it is about
        static const size_t covered[] = {6, 7, 8, 9, 10, 11, 12, 14, 15};
        m[covered[r() % 9]] ^= static_cast<uint8_t>(1 << r() % 8);
      }
    }
    return m;
  });
  without_effect("replayed", &alarm_master::replayed, [](std::mt19937& r) {
    const bool otherBoot = r() % 2;
    return message(static_cast<uint16_t>(otherBoot ? 2 + r() % 65000 : 1),
                   otherBoot ? 2000 + r() % 1000 : r() % 1001, 1, 0xffff);
  });
}
}  // namespace

void testMaster() {
  start();
  mistakes();
  limits();
  commands();
  attacks();
}

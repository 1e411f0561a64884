// An alarm master's controller as its host sees it: registers, the line behind it, and the board.
#pragma once

#include <deque>

#include "fake.h"

extern "C" {
#include "alarm-master.h"
#include "alarm-slave.h"
#include "alarm_master.h"
}

using Message = std::vector<uint8_t>;

struct Request {
  unsigned command, adp, ado;
  Message data;
  bool operator==(const Request& o) const {
    return command == o.command && adp == o.adp && ado == o.ado && data == o.data;
  }
};

// A slave as it stands in the controller's table.
struct TableSlave {
  uint16_t status = 0, node = 0;
  bool answers() const { return !(status & PROTOCOL_SLAVE_ABSENT); }
};

// A master whose line has slaves with the node IDs 1 to `nodes`.
struct MasterController : board {
  std::deque<Message> mailbox;
  std::vector<Request> requests;  // but those that only look whether the line moves
  unsigned probes = 0;
  std::vector<Message> events;
  std::vector<TableSlave> slaves;
  std::array<uint16_t, 256> expected{};
  int unanswered = 0;      // so many requests get no answer
  unsigned looks = 0;      // at the status before a request is done
  unsigned taken = 0;      // of a request to all: slaves that take it; 0: all
  uint16_t otherNode = 0;  // who really answers at every position
  bool requestHangs = false, eventHangs = false, clockRuns = true;
  uint64_t time = 0;  // us
  unsigned silenced = 0, resets = 0;
  bool stopped = false;              // the line was switched off by a write
  std::vector<uint8_t> overwritten;  // of a request that waited

  explicit MasterController(unsigned nodes = 5) {
    slaves.resize(nodes);
    for (unsigned i = 0; i < nodes; ++i) slaves[i].node = static_cast<uint16_t>(i + 1);
    reset();
  }
  void reset() {
    memory.fill(0);
    memory[MASTER_MASTER_TYPE] = 0xf2;
    memory[MASTER_MAX_SLAVES] = 128;
    memory[MASTER_SERVER_TIMEOUT] = 30;
    memory[MASTER_RETRIES] = 2;
    setWord(MASTER_BUS_CYCLE, 25000), setWord(MASTER_ANSWER_TIMEOUT, 2500);
    setWord(MASTER_REPORT_REPEAT, 200), setWord(MASTER_REPORT_HEARTBEAT, 1000);
    expected.fill(0);
    busy_ = done_ = false;
  }
  void setState(uint32_t state) {
    setWord(MASTER_MASTER_STATE, state & 0xffff), setWord(MASTER_MASTER_STATE + 2, state >> 16);
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
    if (address == MASTER_SLAVES_KNOWN) return static_cast<uint8_t>(slaves.size());
    if (address >= MASTER_SLAVE_STATE && address < MASTER_SLAVE_STATE + 8) {
      const unsigned index = memory[MASTER_SLAVE_INDEX], at = address - MASTER_SLAVE_STATE;
      const TableSlave s = index < slaves.size() ? slaves[index] : TableSlave{PROTOCOL_SLAVE_ABSENT, 0};
      return static_cast<uint8_t>(at < 2 ? s.status >> (8 * at) : at < 4 ? s.node >> (8 * (at - 2)) : 0);
    }
    if (address >= MASTER_MASTER_TIME && address < MASTER_MASTER_TIME + 8) {
      const unsigned at = address - MASTER_MASTER_TIME;
      if (at % 4 == 0) kept_ = at == 0 && clockRuns ? ++time : time;
      return static_cast<uint8_t>(kept_ >> (8 * at));
    }
    if (address == MASTER_MAILBOX_LENGTH)
      return mailbox.empty() ? 0 : static_cast<uint8_t>(mailbox[0].size());
    if (address == MASTER_MAILBOX_LENGTH + 1)
      return mailbox.empty() ? 0 : static_cast<uint8_t>(mailbox[0].size() >> 8);
    if (address == MASTER_MAILBOX_DATA) {
      const uint8_t at = memory[MASTER_MAILBOX_OFFSET]++;
      return mailbox.empty() || at >= mailbox[0].size() ? 0xee : mailbox[0][at];
    }
    if (address >= MASTER_MASTER_KEY && address < MASTER_MASTER_KEY + 16) return 0;
    if (address == MASTER_REQUEST_ANSWERED) done_ = false;
    return board::readByte(address);
  }
  void writeByte(uint16_t address, uint8_t value) override {
    if (busy_ && address >= MASTER_REQUEST_COMMAND && address < MASTER_REQUEST_DATA + 8)
      overwritten.push_back(value);
    if (address == MASTER_MASTER_CONTROL) {
      silenced += (value & MASTER_SILENCE_MASK) != 0;
      resets += (value & MASTER_RESET_ALARM_MASK) != 0;
      stopped = stopped || !(value & MASTER_LINE_RUN_MASK);
      board::writeByte(address, value & 0xf);
      return;
    }
    board::writeByte(address, value);
    if (address == MASTER_EXPECTED_NODE + 1)
      expected[memory[MASTER_SLAVE_INDEX]] = static_cast<uint16_t>(word(MASTER_EXPECTED_NODE));
    if (address == MASTER_MAILBOX_CONTROL && value == 1 && !mailbox.empty()) mailbox.pop_front();
    if (address == MASTER_REQUEST_CONTROL && value == 1) request();
    if (address == MASTER_HOST_EVENT_CONTROL && value == 1)
      events.emplace_back(&memory[MASTER_HOST_EVENT], &memory[MASTER_HOST_EVENT + 6]);
  }
  void wait(uint32_t us) override {
    if (!clockRuns) return;
    for (uint32_t ms = static_cast<uint32_t>((time + us) / 1000 - time / 1000); ms > 0; --ms)
      if (word(MASTER_HOST_ALIVE) > 0) setWord(MASTER_HOST_ALIVE, word(MASTER_HOST_ALIVE) - 1);
    time += us;
  }
  // A datagram of an earlier host is still waiting.
  void makeBusy() { busy_ = true, looksLeft_ = looks; }

 private:
  void request() {
    const uint8_t length = memory[MASTER_REQUEST_LENGTH];
    const Request r{memory[MASTER_REQUEST_COMMAND], word(MASTER_REQUEST_ADDRESS),
                    word(MASTER_REQUEST_ADDRESS + 2),
                    Message(&memory[MASTER_REQUEST_DATA], &memory[MASTER_REQUEST_DATA] + length)};
    const bool probe = r.command == PROTOCOL_ECAT_BRD;
    if (probe) ++probes;
    else requests.push_back(r);
    busy_ = true;
    done_ = false;
    looksLeft_ = looks;
    const bool answered = unanswered == 0;
    if (!answered) --unanswered;
    memory[MASTER_REQUEST_ANSWERED] = answered;
    unsigned counter = 0, present = 0;
    for (const TableSlave& s : slaves) present += s.answers();
    if (r.command == PROTOCOL_ECAT_BWR || probe) counter = taken ? taken : present;
    const unsigned position = (0x10000 - r.adp) & 0xffff;
    if ((r.command == PROTOCOL_ECAT_APRD || r.command == PROTOCOL_ECAT_APWR) && position < slaves.size() &&
        slaves[position].answers()) {
      counter = 1;
      if (r.command == PROTOCOL_ECAT_APRD && r.ado == ESC_SLAVE_STATE + 2u)
        setWord(MASTER_REQUEST_RESULT, otherNode ? otherNode : slaves[position].node);
    }
    setWord(MASTER_REQUEST_COUNTER, answered ? counter : 0);
  }
  bool busy_ = false, done_ = false;
  unsigned looksLeft_ = 0;
  uint64_t kept_ = 0;
};

inline const alarm_place* places() {
  static const alarm_place p[] = {{1, "1A", "Cellar"},
                                  {2, "1B", "Cellar"},
                                  {3, "2A", "Kitchen"},
                                  {4, "2B", "Great hall behind the kitchen"},
                                  {5, "3A", "Roof"}};
  return p;
}

inline alarm_master_parameters goodMaster() {
  alarm_master_parameters p{};
  p.master_id = 7;
  p.master_mac[0] = p.server_mac[0] = 2, p.master_mac[5] = 1, p.server_mac[5] = 2;
  const uint8_t ip[4] = {192, 168, 1, 2};
  for (int i = 0; i < 4; ++i) p.master_ip[i] = p.server_ip[i] = ip[i];
  p.server_ip[3] = 3;
  p.master_port = 50000, p.server_port = 50001;
  p.bus_cycle_us = 1000, p.answer_timeout_us = 100, p.retries = 2;
  p.report_repeat_ms = 200, p.report_heartbeat_ms = 1000, p.server_timeout_s = 30;
  for (uint8_t i = 0; i < PROTOCOL_KEY_BYTES; ++i) p.key[i] = static_cast<uint8_t>(i + 1);
  p.alive_ms = 5000;
  p.panel = {4, 20, 30, 2000, places(), 5};
  return p;
}

// A master that has started and looked at all its slaves.
struct StartedMaster {
  MasterController c;
  alarm_master host;
  explicit StartedMaster(
      unsigned nodes = 5, const std::function<void(alarm_master_parameters&)>& change = [](auto&) {})
      : c(nodes) {
    auto p = goodMaster();
    change(p);
    alarm_master_start(&host, &c, &p);
    serve(nodes / 8 + 2);
    c.writes.clear();
  }
  void serve(unsigned passes = 1) {
    for (; passes > 0; --passes) alarm_master_serve(&host);
  }
  void pass(unsigned ms) {
    for (const uint64_t end = c.time + uint64_t{ms} * 1000; c.time < end;) serve();
  }
  std::string line(int i) { return c.display.at(static_cast<size_t>(i)); }
};

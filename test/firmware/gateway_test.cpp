// The host program of a ring's gateway (ring_server) on a fake controller, between nodes and a server that
// the tests play.
#include <algorithm>
#include <cstring>
#include <deque>
#include <map>
#include <random>

extern "C" {
#include "ascon.h"
#include "node/ring_server.h"
#include "protocol.h"
#include "ring-server.h"
}

#include "ring_board.h"

namespace {
constexpr uint8_t kKey[PROTOCOL_KEY_BYTES] = {9, 8, 7, 6, 5, 4, 3, 2, 1, 0, 1, 2, 3, 4, 5, 6};
constexpr uint16_t kGateway = 0x1234;

void put(Bytes& to, size_t at, uint64_t number, unsigned bytes) {
  for (unsigned i = 0; i < bytes; ++i) to.at(at + i) = static_cast<uint8_t>(number >> 8 * (bytes - 1 - i));
}
uint64_t get(const Bytes& from, size_t at, unsigned bytes) {
  uint64_t number = 0;
  for (unsigned i = 0; i < bytes; ++i) number = number << 8 | from.at(at + i);
  return number;
}

Bytes tagOf(uint64_t life, uint8_t origin, uint64_t counter, const Bytes& message,
            const uint8_t* key = kKey) {
  Bytes nonce(PROTOCOL_NONCE_BYTES), tag(PROTOCOL_TAG_BYTES);
  put(nonce, PROTOCOL_NONCE_LIFE_AT, life, 8);
  nonce[PROTOCOL_NONCE_ORIGIN_AT] = origin;
  put(nonce, PROTOCOL_NONCE_COUNTER_AT, counter, 4);
  ascon_tag(tag.data(), key, nonce.data(), message.data(), message.size());
  return tag;
}

// A controller of preset ring-server whose frames and datagrams leave at once.
struct PlantBoard : RingBoard {
  bool sends = false;  // the controller is busy with a datagram
  std::deque<Bytes> incoming;
  std::vector<Bytes> datagrams;

  uint8_t readByte(uint16_t a) override {
    if (a == NODE_PLANT_STATUS)
      return static_cast<uint8_t>((sends ? NODE_PLANT_SENDING_MASK : 0) |
                                  (incoming.empty() ? 0 : NODE_PLANT_WAITING_MASK));
    if (isIn(a, NODE_PLANT_RECEIVED_LENGTH, 2)) {
      const size_t length = incoming.empty() ? 0 : incoming.front().size();
      return static_cast<uint8_t>(length >> 8 * (a - NODE_PLANT_RECEIVED_LENGTH));
    }
    if (isIn(a, NODE_PLANT_RECEIVED_DATA, 2048)) {
      const size_t at = a - NODE_PLANT_RECEIVED_DATA;
      return incoming.empty() || at >= incoming.front().size() ? 0xee : incoming.front()[at];
    }
    return RingBoard::readByte(a);
  }
  void writeByte(uint16_t a, uint8_t value) override {
    RingBoard::writeByte(a, value);
    if (a != NODE_PLANT_COMMAND) return;
    if ((value & NODE_PLANT_RELEASE_MASK) && !incoming.empty()) incoming.pop_front();
    if (value & NODE_PLANT_SEND_MASK) {
      const uint8_t* first = &memory[NODE_PLANT_SEND_DATA];
      datagrams.emplace_back(first, first + word(NODE_PLANT_SEND_LENGTH));
    }
  }
};

// The gateway on its board, and both sides of it.
struct Bench {
  PlantBoard at;
  ring_server server{};
  ring_server_parameters parameters{};
  uint64_t serverLife = 0x1111222233334444, turn = 0;

  Bench() {
    ring_node_parameters& n = parameters.node;
    n.address = 1, n.relay = true, n.kbps = 2000, n.core_mhz = 50, n.pd_ms = 100;
    plant_config& p = parameters.plant;
    p.mac[0] = 2, p.server_mac[5] = 1, p.ip[0] = 10, p.server_ip[0] = 10, p.udp_port = 5000,
    p.server_port = 6000;
    ring_reports_config& r = parameters.reports;
    r.gateway = kGateway, r.repeat_ms = 20, r.heartbeat_ms = 50, r.silent_after_ms = 500;
    std::copy(std::begin(kKey), std::end(kKey), r.key);
  }
  void start() { ring_server_start(&server, &at, &parameters); }
  void run(uint32_t ms) {
    for (uint32_t i = 0; i < 2 * ms; ++i) {
      at.now += 500;
      ring_server_serve(&server);
    }
  }

  const Bytes& last() const { return at.datagrams.back(); }
  uint64_t lifeOf(const Bytes& report) const { return get(report, PROTOCOL_RING_REPORT_LIFE_AT, 8); }
  static bool isTagged(const Bytes& d) {
    const Bytes message(d.begin(), d.end() - PROTOCOL_TAG_BYTES), tag(d.end() - PROTOCOL_TAG_BYTES, d.end());
    return tagOf(get(d, PROTOCOL_RING_REPORT_LIFE_AT, 8), PROTOCOL_OF_MASTER,
                 get(d, PROTOCOL_RING_REPORT_COUNTER_AT, 4), message) == tag;
  }
  struct Part {
    unsigned type, source, pipe, number, life, flags, total, offset;
    Bytes data;
  };
  static std::vector<Part> partsOf(const Bytes& d) {
    std::vector<Part> parts;
    size_t at = PROTOCOL_RING_REPORT_BYTES;
    const auto field = [&](int offset, unsigned bytes) {
      return static_cast<unsigned>(get(d, at + static_cast<size_t>(offset), bytes));
    };
    for (unsigned n = d.at(PROTOCOL_RING_REPORT_PARTS_AT); n > 0; --n) {
      Part p{field(PROTOCOL_RING_PART_HEAD_TYPE_AT, 1),
             field(PROTOCOL_RING_PART_HEAD_SOURCE_AT, 1),
             field(PROTOCOL_RING_PART_HEAD_PIPE_AT, 1),
             field(PROTOCOL_RING_PART_HEAD_NUMBER_AT, 1),
             field(PROTOCOL_RING_PART_HEAD_LIFE_AT, 1),
             field(PROTOCOL_RING_PART_HEAD_FLAGS_AT, 1),
             field(PROTOCOL_RING_PART_HEAD_TOTAL_AT, 2),
             field(PROTOCOL_RING_PART_HEAD_OFFSET_AT, 2),
             {}};
      const auto from = d.begin() + static_cast<std::ptrdiff_t>(at) + PROTOCOL_RING_PART_HEAD_BYTES;
      p.data.assign(from, from + field(PROTOCOL_RING_PART_HEAD_LENGTH_AT, 2));
      at += PROTOCOL_RING_PART_HEAD_BYTES + p.data.size();
      parts.push_back(p);
    }
    return parts;
  }

  // The answer of the server to a report; it has all before `stored`.
  Bytes answer(const Bytes& report, uint64_t stored, const uint8_t* key = kKey) {
    Bytes a(PROTOCOL_ANSWER_TAG_AT);
    put(a, PROTOCOL_ANSWER_MAGIC_AT, PROTOCOL_MAGIC, 2),
        put(a, PROTOCOL_ANSWER_VERSION_AT, PROTOCOL_VERSION, 1);
    put(a, PROTOCOL_ANSWER_KIND_AT, PROTOCOL_KIND_ANSWER, 1), put(a, PROTOCOL_ANSWER_MASTER_AT, kGateway, 2);
    put(a, PROTOCOL_ANSWER_LIFE_AT, lifeOf(report), 8), put(a, PROTOCOL_ANSWER_SERVER_AT, serverLife, 8);
    put(a, PROTOCOL_ANSWER_TURN_AT, ++turn, 4);
    put(a, PROTOCOL_ANSWER_ECHO_AT, get(report, PROTOCOL_RING_REPORT_COUNTER_AT, 4), 4);
    put(a, PROTOCOL_ANSWER_NUMBER_AT, stored, 4);
    const Bytes tag = tagOf(serverLife, PROTOCOL_OF_SERVER, turn, a, key);
    a.insert(a.end(), tag.begin(), tag.end());
    return a;
  }
  static uint64_t endOf(const Bytes& report) {
    return get(report, PROTOCOL_RING_REPORT_NUMBER_AT, 4) + report[PROTOCOL_RING_REPORT_PARTS_AT];
  }
  // The server takes all that the last report has.
  void acknowledge() { at.incoming.push_back(answer(last(), endOf(last()))); }
  // Until the server has all there is.
  void settle() {
    for (int i = 0;
         i < 50 && (server.reports.count > 0 || get(last(), PROTOCOL_RING_REPORT_SERVER_AT, 8) == 0); ++i)
      acknowledge(), run(5);
  }
  Bytes urgent(uint64_t counter, uint8_t destination, const Bytes& data) {
    return order(counter, destination, data, kKey, PROTOCOL_RING_FLAG_URGENT);
  }
  Bytes order(uint64_t counter, uint8_t destination, const Bytes& data, const uint8_t* key = kKey,
              uint8_t flags = 0) {
    Bytes o(PROTOCOL_RING_SEND_BYTES);
    put(o, PROTOCOL_RING_SEND_FLAGS_AT, flags, 1);
    put(o, PROTOCOL_RING_SEND_MAGIC_AT, PROTOCOL_MAGIC, 2),
        put(o, PROTOCOL_RING_SEND_VERSION_AT, PROTOCOL_VERSION, 1);
    put(o, PROTOCOL_RING_SEND_KIND_AT, PROTOCOL_KIND_SEND, 1),
        put(o, PROTOCOL_RING_SEND_MASTER_AT, kGateway, 2);
    put(o, PROTOCOL_RING_SEND_LIFE_AT, lifeOf(last()), 8),
        put(o, PROTOCOL_RING_SEND_SERVER_AT, serverLife, 8);
    put(o, PROTOCOL_RING_SEND_TURN_AT, ++turn, 4), put(o, PROTOCOL_RING_SEND_COUNTER_AT, counter, 4);
    put(o, PROTOCOL_RING_SEND_DESTINATION_AT, destination, 1);
    put(o, PROTOCOL_RING_SEND_LENGTH_AT, data.size(), 2);
    o.insert(o.end(), data.begin(), data.end());
    const Bytes tag = tagOf(serverLife, PROTOCOL_OF_SERVER, turn, o, key);
    o.insert(o.end(), tag.begin(), tag.end());
    return o;
  }
  void orders(const Bytes& o) { at.incoming.push_back(o), run(2); }
  uint64_t taken() const { return get(last(), PROTOCOL_RING_REPORT_TAKEN_AT, 4); }

  // All parts of a kind that any report has had, each time.
  std::vector<Part> everTold(unsigned type) const {
    std::vector<Part> found;
    for (const Bytes& d : at.datagrams)
      for (const Part& p : partsOf(d))
        if (p.type == type) found.push_back(p);
    return found;
  }

  // Nodes of the ring.
  void hello(uint8_t node, uint8_t ports = 0x44, uint8_t type = 7) {
    at.comes({false, 0, false, node, RING_HELLO, 0, true}, {3, 0, ports, 0, 0, 0, type, 1});
  }
  void shortOf(uint8_t node, uint8_t number, const Bytes& data, uint8_t pipe = 0) {
    Bytes bytes{number, 3};
    bytes.insert(bytes.end(), data.begin(), data.end());
    at.comes({false, 1, false, node, RING_SHORT, pipe, true}, bytes);
  }
  // One of 2 KiB.
  void longOf(uint8_t node, uint8_t number, const Bytes& message) {
    Bytes open{number, 3, 0x07, 0xff};
    open.resize(8);
    put(open, 4, ring_crc32(message.data(), 2048), 4);
    at.comes({false, 1, false, node, RING_OPEN, 0, true}, open);
    for (unsigned i = 0; i < 256; ++i) {
      at.comes({false, 1, true, node, static_cast<uint8_t>(i), 0, i == 255},
               Bytes(message.begin() + 8 * i, message.begin() + 8 * i + 8));
      if (i % 32 == 31) run(1);
    }
  }
  // How many frames with this code have left for a node.
  unsigned told(uint8_t node, uint8_t code) const {
    unsigned count = 0;
    for (const ring_frame& f : at.frames) {
      const ring_id id = ring_id_of(f.id);
      if (!id.is_data && id.destination == node && id.number == code) ++count;
    }
    return count;
  }
};

void testReports() {
  Bench b;
  b.start(), b.run(200);
  check("GW-04: a gateway reports before it knows the server, with a right tag",
        !b.at.datagrams.empty() && Bench::isTagged(b.last()) &&
            get(b.last(), PROTOCOL_RING_REPORT_SERVER_AT, 8) == 0 && b.lifeOf(b.last()) != 0);
  b.settle();
  check("GW-04: behind an answer it knows the server's life",
        get(b.last(), PROTOCOL_RING_REPORT_SERVER_AT, 8) == b.serverLife);
  size_t before = b.at.datagrams.size();
  b.run(500);
  check("GW-04: without news it reports after each heartbeat",
        b.at.datagrams.size() - before >= 9 && b.at.datagrams.size() - before <= 11);
  b.hello(5), b.hello(6), b.run(120);
  const auto parts = Bench::partsOf(b.last());
  check("GW-04: a node that is there is a part, with its HELLO",
        parts.size() == 2 && parts[0].type == PROTOCOL_RING_PART_NODE && parts[0].source == 5 &&
            parts[0].data.size() == RING_SERVER_NODE_BYTES && parts[0].data[0] == 1 &&
            parts[0].data[1] == 3 && parts[1].source == 6);
  before = b.at.datagrams.size();
  b.run(200);
  const size_t repeats = b.at.datagrams.size() - before;
  check("GW-04: what is not acknowledged is reported again", repeats >= 9 && repeats <= 11);
  b.settle();
  b.run(4000);
  unsigned lost = 0;
  for (const auto& p : Bench::partsOf(b.last()))
    lost += p.type == PROTOCOL_RING_PART_NODE && p.data == Bytes{0};
  check("GW-04: a node that is lost is a part", lost == 2);
  bool tagged = true;
  uint64_t counter = 0;
  for (const Bytes& d : b.at.datagrams) {
    tagged = tagged && Bench::isTagged(d) && get(d, PROTOCOL_RING_REPORT_COUNTER_AT, 4) == counter + 1;
    counter = get(d, PROTOCOL_RING_REPORT_COUNTER_AT, 4);
  }
  check("GW-04: no counter comes twice, all tags are right", tagged);
}

void testBreak() {
  Bench b;
  b.start();
  const auto broken = [&] {
    for (uint8_t n = 2; n <= 5; ++n) b.hello(n, n == 3 ? 0x04 : n == 4 ? 0x40 : 0x44);
  };
  broken(), b.run(120);
  const auto find = [&](unsigned type) {
    for (const auto& p : Bench::partsOf(b.last()))
      if (p.type == type) return p.data;
    return Bytes{};
  };
  check("GWB-01: a break is between the nodes with a port down",
        find(PROTOCOL_RING_PART_RING) == Bytes({3, 4}));
  for (int i = 0; i < 3; ++i) b.run(1000), broken();
  b.settle();
  const auto whole = [&] {
    for (uint8_t n = 2; n <= 5; ++n) b.hello(n);
  };
  whole(), b.run(1000), whole(), b.run(1000), whole(), b.run(900);
  check("GWB-01: both up again: another break may not have been told yet",
        find(PROTOCOL_RING_PART_RING).empty());
  whole(), b.run(220);
  check("GWB-01: three HELLO later the ring is whole", find(PROTOCOL_RING_PART_RING) == Bytes({0, 0}));
  b.settle();
  b.at.memory[NODE_RING_PORTS] = NODE_RING_UP2_MASK;
  b.hello(5, 0x04), b.run(120);
  check("GWB-01: the gateway's own port counts, too", find(PROTOCOL_RING_PART_RING) == Bytes({5, 1}));
}

// Both ends of a piece of the ring are mended within the same second; the piece is broken itself.
void testPieceJoins() {
  Bench b;
  b.start();
  const auto rest = [&](uint8_t ports3, uint8_t ports8) {
    b.hello(2), b.hello(3, ports3), b.hello(8, ports8), b.hello(9);
  };
  for (int i = 0; i < 4; ++i) rest(0x04, 0x40), b.run(1000), b.settle();
  rest(0x44, 0x44), b.hello(4), b.hello(7), b.run(800);
  check("GWB-01: a ring is not whole while nodes that have joined may still tell of a break", [&] {
    const auto all = b.everTold(PROTOCOL_RING_PART_RING);
    return !all.empty() && std::all_of(all.begin(), all.end(),
                                       [](const Bench::Part& p) { return p.data == Bytes({3, 8}); });
  }());
  b.hello(5, 0x04), b.hello(6, 0x40), b.run(120);
  check("GWB-01: they tell of it", b.everTold(PROTOCOL_RING_PART_RING).back().data == Bytes({5, 6}));
}

// A program starts in a ring that was there before.
void testStartInRing() {
  const auto told = [](const Bench& b) {
    std::vector<Bytes> all;
    for (const auto& p : b.everTold(PROTOCOL_RING_PART_RING))
      if (all.empty() || all.back() != p.data) all.push_back(p.data);
    return all;
  };
  Bench broken;
  broken.start(), broken.run(900);
  check("GWB-01: behind a start nothing is told of the ring before it is known", told(broken).empty());
  broken.hello(2), broken.run(100), broken.hello(4, 0x40), broken.run(50), broken.hello(3, 0x04);
  broken.run(200);
  check("GWB-01: a break is told at once", told(broken) == std::vector<Bytes>{{3, 4}});
  broken.hello(2), broken.hello(3), broken.hello(4), broken.run(200), broken.settle();
  check("GWB-01: whole it is when each node could have told of a break",
        told(broken) == std::vector<Bytes>{{3, 4}});
  for (int i = 0; i < 3; ++i) broken.hello(2), broken.hello(3), broken.hello(4), broken.run(1000);
  check("GWB-01: and is told as such then", told(broken) == std::vector<Bytes>({{3, 4}, {0, 0}}));
  // The controller loses what it had, as with its power.
  broken.settle();
  broken.at.memory[NODE_RING_LIFE] = 0, broken.at.memory[NODE_RING_CONTROL] = 0;
  broken.at.memory[NODE_RING_ADDRESS] = 0, broken.at.memory[NODE_RING_PORTS] = 0;
  broken.run(100), broken.settle();
  broken.at.memory[NODE_RING_PORTS] = NODE_RING_UP1_MASK | NODE_RING_UP2_MASK;
  broken.hello(2), broken.hello(3), broken.hello(4), broken.run(300), broken.settle();
  check("GWB-01: behind a start of the controller own ports that come up are no break",
        told(broken) == std::vector<Bytes>({{3, 4}, {0, 0}}));
  broken.hello(4, 0x40), broken.hello(3, 0x04), broken.run(200), broken.settle();
  check("GWB-01: but one of which others tell",
        told(broken) == std::vector<Bytes>({{3, 4}, {0, 0}, {3, 4}}));

  // Both fibres of the gateway are cut for long; meanwhile the ring breaks elsewhere.
  Bench apart;
  apart.start();
  for (int i = 0; i < 4; ++i) apart.hello(2), apart.hello(9), apart.run(1000);
  apart.at.memory[NODE_RING_PORTS] = 0, apart.run(5000), apart.settle();
  check("GWB-01: a gateway without a port up is alone", told(apart) == std::vector<Bytes>({{0, 0}, {1, 1}}));
  apart.at.memory[NODE_RING_PORTS] = NODE_RING_UP1_MASK | NODE_RING_UP2_MASK;
  apart.hello(2), apart.hello(9), apart.run(900), apart.settle();
  check("GWB-01: who was alone does not know of a break elsewhere", told(apart).size() == 2);
  apart.hello(7, 0x04), apart.hello(8, 0x40), apart.run(200), apart.settle();
  check("GWB-01: until it is told", told(apart) == std::vector<Bytes>({{0, 0}, {1, 1}, {7, 8}}));

  Bench alone;
  alone.start(), alone.run(2900);
  check("GWB-01: without a HELLO nothing is known at first", told(alone).empty());
  alone.run(300);
  check("GWB-01: then the gateway is alone", told(alone) == std::vector<Bytes>{{1, 1}});
}

// Another node has the gateway's address.
void testConflict() {
  Bench b;
  b.start(), b.hello(3), b.run(120), b.settle();
  const auto isTold = [&] {
    return (b.last().at(PROTOCOL_RING_REPORT_STATUS_AT) & PROTOCOL_RING_STATUS_CONFLICT) != 0;
  };
  b.at.conflicts(), b.run(5);
  check("GWB-09: a conflict of addresses is told", isTold());
  b.run(9900);
  check("GWB-09: it stays for ten seconds", b.at.clears == 0 && isTold());
  check("GWB-09: it is told of the own node, too", [&] {
    for (const auto& p : b.everTold(PROTOCOL_RING_PART_NODE))
      if (p.source == 1 && (p.data.at(2) & NODE_RING_CONFLICT_MASK)) return true;
    return false;
  }());
  const uint8_t life = b.at.memory[NODE_RING_LIFE];
  b.run(200);
  check("GWB-09: then it is cleared, with another life",
        b.at.clears == 1 && !isTold() && b.at.memory[NODE_RING_LIFE] != life);
  // The other one does so, too: each time it takes twice as long, and no memory wears out.
  for (int i = 0; i < 3600; ++i) b.at.conflicts(), b.run(1000);
  check("GWB-09: again and again, ever more rarely", b.at.clears == 10);
  b.at.memory[NODE_RING_STATE] = 0, b.run(3'601'000);
  b.at.conflicts(), b.run(10'100);
  check("GWB-09: after an hour without one it begins anew", b.at.clears == 11);
}

// With the times of a board: HELLO each second, distances forgotten after 640 ms.
void testMoments() {
  Bench b;
  b.start();
  const auto distances = [&](uint8_t one, uint8_t two) {
    b.at.memory[NODE_RING_DISTANCEN(5)] = one, b.at.memory[NODE_RING_DISTANCEN(5) + 1] = two;
  };
  const auto second = [&](uint8_t one, uint8_t two, uint8_t can) {
    b.at.comes({false, 0, false, 5, RING_HELLO, 0, true}, {3, 0, 0x44, can, 0, 0, 7, 1});
    distances(one, two), b.run(640);
    distances(0, 0), b.run(360);
  };
  const auto newest = [&] {
    Bytes last;
    for (const Bytes& d : b.at.datagrams)
      for (const auto& p : Bench::partsOf(d))
        if (p.type == PROTOCOL_RING_PART_NODE && p.source == 5) last = p.data;
    return last;
  };
  for (int i = 0; i < 4; ++i) second(3, 2, 1);
  b.settle();
  const uint64_t stored = b.server.reports.oldest;
  for (int i = 0; i < 6; ++i) second(3, 2, static_cast<uint8_t>(1 | i % 4 << 4));
  check("GWB-02: a silence between two HELLO, or a frame just now, is no news",
        b.server.reports.oldest == stored && b.server.reports.count == 0);
  check("GWB-02: the distances are those that were heard last",
        newest().size() == RING_SERVER_NODE_BYTES && newest()[9] == 3 && newest()[10] == 2);
  for (int i = 0; i < 4; ++i) second(0, 2, 1);
  check("GWB-02: a distance that is not heard any more is told as such",
        b.server.reports.count == 1 && newest()[9] == 0 && newest()[10] == 2);
  b.settle();
  second(0, 2, 2);
  check("GWB-02: a port that becomes error passive is news", b.server.reports.count == 1 && newest()[4] == 2);
  b.settle();

  // A node dies while the server starts anew, and there is no place to tell of it.
  for (uint8_t n = 10; n < 100; ++n) b.hello(n);
  b.run(120);
  check("GWB-02: all places for news are taken",
        ring_reports_free(&b.server.reports) == RING_REPORTS_RESULTS);
  b.serverLife += 1;
  b.at.incoming.push_back(b.answer(b.last(), get(b.last(), PROTOCOL_RING_REPORT_NUMBER_AT, 4)));
  b.run(4000);
  b.settle();
  b.run(500), b.settle(), b.run(500), b.settle(), b.run(500), b.settle();
  check("GWB-02: it is told as lost all the same", newest() == Bytes{0});
}

void testMessages() {
  Bench b;
  b.start(), b.hello(9), b.run(120), b.settle();
  b.shortOf(9, 0, {1, 2}), b.run(5);
  const auto parts = Bench::partsOf(b.last());
  check("GW-04: a message is a part", parts.size() == 1 && parts[0].type == PROTOCOL_RING_PART_MESSAGE &&
                                          parts[0].source == 9 && parts[0].data == Bytes({1, 2}) &&
                                          parts[0].total == 2 && parts[0].life == 3);
  check("GW-04: the first one of a pipe may be a repeat", parts[0].flags == PROTOCOL_RING_FLAG_REPEAT);
  check("GW-05: it is not done before the server has it", b.told(9, RING_DONE) == 0);
  b.shortOf(9, 0, {1, 2}), b.run(5);
  check("GW-05: who asks again is told BUSY", b.told(9, RING_BUSY) == 1 && b.told(9, RING_DONE) == 0);
  const Bytes good = b.answer(b.last(), Bench::endOf(b.last()));
  for (size_t i = 0; i < good.size(); ++i) {
    Bytes bad = good;
    bad[i] ^= 1;
    b.at.incoming.push_back(bad), b.run(1);
  }
  b.at.incoming.push_back(Bytes(good.begin(), good.end() - 1)), b.run(1);
  check("GW-05: a forged answer acknowledges nothing", b.told(9, RING_DONE) == 0);
  b.at.incoming.push_back(good), b.run(2);
  check("GW-05: it is done when the server has it", b.told(9, RING_DONE) == 1);
  b.shortOf(9, 1, {3}), b.run(5);
  b.at.incoming.push_back(good), b.run(2);
  check("GW-05: an answer that comes again acknowledges nothing", b.told(9, RING_DONE) == 1);
  b.settle();
  check("GW-05: the next one is done, too", b.told(9, RING_DONE) == 2);

  // 2 KiB: two parts, in two datagrams; the life of the server changes between both.
  Bytes message(2048);
  for (size_t i = 0; i < message.size(); ++i) message[i] = static_cast<uint8_t>(i * 11);
  b.longOf(9, 2, message), b.run(3);
  auto piece = Bench::partsOf(b.last());
  bool fits = piece.size() == 1 && piece[0].total == 2048 && piece[0].offset == 0;
  Bytes whole = piece[0].data;
  b.acknowledge(), b.run(5);
  b.serverLife += 1;
  check("GW-05: half of it is not done", b.told(9, RING_DONE) == 2);
  b.acknowledge(), b.run(5);
  piece = Bench::partsOf(b.last());
  b.settle();
  for (const Bytes& d : b.at.datagrams)
    for (const auto& p : Bench::partsOf(d))
      if (p.type == PROTOCOL_RING_PART_MESSAGE && p.total == 2048 && p.offset == whole.size())
        whole.insert(whole.end(), p.data.begin(), p.data.end());
  check("GW-04: a message of 2 KiB comes whole, in two parts", fits && whole == message);
  check("GW-05: it is done when the server has both", b.told(9, RING_DONE) == 3);
}

void testFlood() {
  Bench b;
  b.start(), b.run(120);
  // The server is silent. A node flaps, others send.
  for (uint8_t i = 0; i < 60; ++i) b.hello(5, i % 2 ? 0x44 : 0x04), b.run(110);
  unsigned ofNode = 0;
  for (const auto& p : Bench::partsOf(b.last())) ofNode += p.type == PROTOCOL_RING_PART_NODE && p.source == 5;
  check("GWB-02: news of a node take one place", ofNode == 1);
  for (uint8_t n = 10; n < 100; ++n) b.shortOf(n, 0, {n}), b.run(2);
  check("GWB-02: messages leave places for other news", ring_reports_free(&b.server.reports) >= 8);
  check("GW-05: those without a place are told BUSY", [&] {
    unsigned busy = 0;
    for (uint8_t n = 10; n < 100; ++n) busy += b.told(n, RING_BUSY) > 0;
    return busy;
  }() > 40);
  b.hello(6), b.run(120);
  bool isNews = false;
  for (unsigned i = 0; i < b.server.reports.count; ++i)
    isNews =
        isNews || (b.server.reports.parts[(b.server.reports.first + i) % RING_REPORTS_PARTS].type ==
                       PROTOCOL_RING_PART_NODE &&
                   b.server.reports.parts[(b.server.reports.first + i) % RING_REPORTS_PARTS].source == 6);
  check("GWB-02: a new node is told all the same", isNews);
  check("GW-04: a server that does not answer is silent",
        ring_reports_silent(&b.server.reports, b.server.node.now_us));
  b.settle();
  check("GWB-02: the last state of the node is told in the end", [&] {
    b.run(200), b.settle();
    Bytes last;
    for (const Bytes& d : b.at.datagrams)
      for (const auto& p : Bench::partsOf(d))
        if (p.type == PROTOCOL_RING_PART_NODE && p.source == 5) last = p.data;
    return last.size() == 1 || last[3] == 0x44;
  }());
}

void testOrders() {
  Bench b;
  b.start();
  for (uint8_t n = 2; n <= 9; ++n) b.hello(n);
  b.run(120), b.settle();
  const auto sent = [&](uint8_t node) { return b.told(node, RING_SHORT); };
  b.orders(b.order(2, 3, {1}));
  check("GW-06: a message out of turn is not taken", sent(3) == 0 && b.taken() == 0);
  const uint8_t other[PROTOCOL_KEY_BYTES] = {1};
  b.orders(b.order(1, 3, {1}, other));
  const Bytes good = b.order(1, 3, {1, 2, 3});
  for (size_t i = 0; i < good.size(); ++i) {
    Bytes bad = good;
    bad[i] ^= 0x80;
    b.orders(bad);
  }
  check("GW-06: a forged one is not taken", sent(3) == 0 && b.taken() == 0);
  const uint64_t life = b.serverLife;
  b.serverLife = 77;
  b.orders(b.order(1, 3, {1}));
  b.serverLife = life;
  check("GW-06: one of another life of the server is not taken", sent(3) == 0 && b.taken() == 0);
  b.orders(good), b.run(5);
  check("GW-06: the next one is taken, and leaves", sent(3) == 1 && b.taken() == 1);
  b.orders(good), b.orders(b.order(1, 3, {9}));
  check("GW-06: what comes again is not taken again", sent(3) == 1 && b.taken() == 1);
  const auto result = [&](uint32_t counter) {
    int found = -1;
    for (const Bytes& d : b.at.datagrams)
      for (const auto& p : Bench::partsOf(d))
        if (p.type == PROTOCOL_RING_PART_RESULT && get(p.data, 0, 4) == counter) found = p.data.at(4);
    return found;
  };
  b.at.comes({false, 1, false, 3, RING_DONE, 0, true}, {0, b.server.node.life, 3, 0});
  b.run(10);
  check("GW-06: its result is told", result(1) == PROTOCOL_RING_RESULT_DELIVERED);
  b.settle();
  b.orders(b.order(2, 1, {1})), b.orders(b.order(3, 126, {1})), b.orders(b.order(4, 4, {}));
  b.orders(b.order(5, 4, Bytes(1025)));
  b.run(10);
  check("GW-06: impossible ones are refused", b.taken() == 5 && result(2) == PROTOCOL_RING_RESULT_REFUSED &&
                                                  result(3) == PROTOCOL_RING_RESULT_REFUSED &&
                                                  result(4) == PROTOCOL_RING_RESULT_REFUSED &&
                                                  result(5) == PROTOCOL_RING_RESULT_REFUSED);
  b.settle();
  const auto isBusy = [&] {
    return (b.last().at(PROTOCOL_RING_REPORT_STATUS_AT) & PROTOCOL_RING_STATUS_BUSY) != 0;
  };
  for (uint8_t i = 0; i < 2; ++i) b.orders(b.order(6 + i, static_cast<uint8_t>(2 + i), {i}));
  check("GWB-10: two places are left: nothing is told of them", b.taken() == 7 && !isBusy());
  for (uint8_t i = 2; i < 4; ++i) b.orders(b.order(6 + i, static_cast<uint8_t>(2 + i), {i}));
  check("GW-06, GWB-10: the last place is for no normal one", b.taken() == 8 && sent(5) == 0);
  bool isTold = true;
  for (const Bytes& d : b.at.datagrams)
    if (get(d, PROTOCOL_RING_REPORT_TAKEN_AT, 4) == 8)
      isTold = isTold && (d.at(PROTOCOL_RING_REPORT_STATUS_AT) & PROTOCOL_RING_STATUS_BUSY);
  check("GWB-10: with the message that takes the place before it the report tells of that", isTold);
  b.orders(b.urgent(9, 5, {3}));
  check("GW-06, GWB-10: it is for an urgent one", b.taken() == 9 && sent(5) == 1);
  b.orders(b.urgent(10, 6, {4}));
  check("GW-06: a fifth one under way is not taken", b.taken() == 9 && sent(6) == 0);
  b.at.comes({false, 1, false, 4, RING_DONE, 0, true}, {0, b.server.node.life, 3, 1});
  b.run(10);
  b.orders(b.order(10, 6, {4}));
  check("GW-06, GWB-10: the place that becomes free is the last one again", b.taken() == 9);
  b.orders(b.urgent(10, 6, {4}));
  check("GW-06: it is when another one has ended",
        b.taken() == 10 && sent(6) == 1 && result(8) == PROTOCOL_RING_RESULT_REFUSED);
  b.run(3000);
  b.settle();
  check("GW-06: what no node answers ends as not confirmed",
        result(6) == PROTOCOL_RING_RESULT_NOT_CONFIRMED && result(9) == PROTOCOL_RING_RESULT_NOT_CONFIRMED);
  check("GWB-10: places are free again", !isBusy());
}

// The server cannot write its log: it acknowledges nothing, and goes on sending messages.
void testResults() {
  Bench b;
  b.start(), b.run(120), b.settle();
  b.longOf(8, 0, Bytes(2048, 8)), b.run(5), b.longOf(9, 0, Bytes(2048, 9)), b.run(5);
  for (uint8_t n = 10; n < 50; ++n) b.shortOf(n, 0, {n}), b.run(2);
  for (uint8_t n = 3; n < 100; ++n) b.hello(n), b.run(2);
  b.run(200);
  const auto results = [](const Bytes& report) {
    std::vector<unsigned> all;
    for (const auto& p : Bench::partsOf(report))
      if (p.type == PROTOCOL_RING_PART_RESULT) all.push_back(static_cast<unsigned>(get(p.data, 0, 4)));
    return all;
  };
  std::vector<unsigned> all;
  for (unsigned i = 1; i <= RING_REPORTS_RESULTS; ++i) {
    b.orders(b.order(i, 3, {static_cast<uint8_t>(i)}));
    b.at.comes({false, 1, false, 3, RING_DONE, 0, true},
               {static_cast<uint8_t>(i - 1), b.server.node.life, 3, 0});
    b.run(5), all.push_back(i);
  }
  check("GWB-02: sixteen results are told whatever waits before them", results(b.last()) == all);
  check("GWB-02: what is told first is the same", Bench::partsOf(b.last())[0].source == 8);
  b.settle();
  check("GW-05, GWB-02: then all else comes", b.told(8, RING_DONE) == 1 && b.told(9, RING_DONE) == 1);
  std::map<uint64_t, std::pair<unsigned, Bytes>> kept;
  bool isSame = true;
  for (const Bytes& d : b.at.datagrams) {
    uint64_t number = get(d, PROTOCOL_RING_REPORT_NUMBER_AT, 4);
    for (const auto& p : Bench::partsOf(d)) {
      const auto [at, isNew] = kept.try_emplace(number++, p.source << 8 | p.type, p.data);
      isSame = isSame && (isNew || at->second == std::make_pair(p.source << 8 | p.type, p.data));
    }
  }
  check("GW-04, GWB-02: a part that has left keeps its number", isSame && kept.size() >= RING_REPORTS_PARTS);
}

// A node that is busy for ever, and others.
void testBusy() {
  Bench b;
  b.start();
  for (uint8_t n = 2; n <= 9; ++n) b.hello(n);
  b.run(120), b.settle();
  for (uint32_t i = 1; i <= 3; ++i) b.orders(b.order(i, 3, {static_cast<uint8_t>(i)}));
  b.orders(b.urgent(4, 3, {4}));
  const auto seconds = [&](int count) {
    for (int i = 0; i < 10 * count; ++i) {
      for (uint8_t pipe = 0; pipe < 4; ++pipe)
        b.at.comes({false, 1, false, 3, RING_BUSY, pipe, true}, {0, b.server.node.life, 20});
      b.run(100);
      if (b.server.reports.count > 0) b.acknowledge();
    }
  };
  const auto results = [&] {
    std::vector<unsigned> all;
    for (const auto& p : b.everTold(PROTOCOL_RING_PART_RESULT))
      all.push_back(static_cast<unsigned>(get(p.data, 0, 4)) << 8 | p.data.at(4));
    std::sort(all.begin(), all.end());
    all.erase(std::unique(all.begin(), all.end()), all.end());
    return all;
  };
  seconds(29);
  b.orders(b.order(5, 4, {5}));
  check("GW-06, GWB-10: a node may be busy for half a minute", results().empty() && b.taken() == 4);
  seconds(2);
  check("GW-06, GWB-10: then its messages end as not confirmed",
        results() == std::vector<unsigned>({0x102, 0x202, 0x302, 0x402}) && b.told(3, RING_CLOSE) == 4);
  b.orders(b.order(5, 4, {5})), b.run(5);
  check("GW-06, GWB-10: and others are taken", b.taken() == 5 && b.told(4, RING_SHORT) == 1);
  b.at.comes({false, 1, false, 4, RING_DONE, 0, true}, {0, b.server.node.life, 4, 0});
  for (uint8_t pipe = 0; pipe < 4; ++pipe)
    b.at.comes({false, 1, false, 3, RING_DONE, pipe, true}, {0, b.server.node.life, 3, 0});
  b.run(100), b.settle(), seconds(60);
  check("GW-06, GWB-10: each has one result",
        results() == std::vector<unsigned>({0x102, 0x202, 0x302, 0x402, 0x500}));
}

// A message to all of whom nobody is known.
void testToNobody() {
  Bench b;
  b.start(), b.run(120), b.settle();
  b.orders(b.order(1, 0, {1})), b.run(200);
  const auto all = b.everTold(PROTOCOL_RING_PART_RESULT);
  check("GW-06, TB-11: a message to all goes out also if nobody is known", b.told(0, RING_SHORT) == 1);
  check("GW-06, TB-11: it is not confirmed then",
        !all.empty() && all.back().data == Bytes({0, 0, 0, 1, PROTOCOL_RING_RESULT_NOT_CONFIRMED}));
}

// Numbers come to their end: the gateway begins another life before that, and loses nothing.
void testNumbers() {
  Bench b;
  b.start();
  for (uint8_t n = 2; n <= 9; ++n) b.hello(n);
  b.run(120), b.settle();
  const uint64_t first = b.lifeOf(b.last());
  b.server.reports.oldest = UINT32_MAX - 1100;  // the server has had so many
  // What the server keeps: parts by their numbers, a repeat of the last one of its node not again (GW-07).
  std::vector<std::pair<unsigned, Bytes>> kept;
  std::map<unsigned, Bench::Part> newest;
  std::map<uint64_t, uint64_t> wanted{{first, b.server.reports.oldest}};
  const auto serve = [&] {
    const Bytes report = b.last();
    const uint64_t life = b.lifeOf(report);
    uint64_t number = get(report, PROTOCOL_RING_REPORT_NUMBER_AT, 4);
    for (const auto& p : Bench::partsOf(report)) {
      if (number++ < wanted[life]) continue;
      if (p.type != PROTOCOL_RING_PART_MESSAGE) continue;
      const auto before = newest.find(p.source);
      const bool again = before != newest.end() && (p.flags & PROTOCOL_RING_FLAG_REPEAT) &&
                         before->second.number == p.number && before->second.data == p.data;
      if (!again) kept.emplace_back(p.source, p.data);
      newest[p.source] = p;
    }
    wanted[life] = std::max(wanted[life], number);
    b.at.incoming.push_back(b.answer(report, wanted[life]));
  };
  bool all = true;
  for (unsigned i = 0; i < 300; ++i) {
    for (uint8_t n = 2; n <= 9; ++n) {
      const auto tell = [&] {
        b.shortOf(n, static_cast<uint8_t>(i), {n, static_cast<uint8_t>(i), static_cast<uint8_t>(i >> 8)});
      };
      const unsigned before = b.told(n, RING_DONE);
      // As TP-12; each third answer of the server is lost.
      for (unsigned t = 0; t < 10 && b.told(n, RING_DONE) == before; ++t) {
        tell(), b.run(3);
        serve();
        if ((i + n + t) % 3 == 0) b.at.incoming.clear();
        b.run(2);
      }
      all = all && b.told(n, RING_DONE) == before + 1;
      b.at.frames.clear();
    }
    b.at.datagrams.erase(b.at.datagrams.begin(), b.at.datagrams.end() - 1);
  }
  check("GW-04, GWB-11: before numbers of parts end there is another life", b.lifeOf(b.last()) != first);
  check("GW-04, GWB-11: it numbers from 0 on",
        b.server.reports.oldest < 2500 && wanted[first] == UINT32_MAX - 999u);
  check("GW-05, GWB-11: each message is delivered", all);
  check("GW-05, GWB-11: and kept once, in order", [&] {
    if (kept.size() != 8 * 300) return false;
    for (unsigned i = 0; i < 300; ++i)
      for (uint8_t n = 2; n <= 9; ++n)
        if (kept[8 * i + n - 2u].second != Bytes({n, static_cast<uint8_t>(i), static_cast<uint8_t>(i >> 8)}))
          return false;
    return true;
  }());

  for (const bool ofReports : {true, false}) {
    Bench c;
    c.start(), c.run(120), c.settle();
    const uint64_t life = c.lifeOf(c.last());
    (ofReports ? c.server.reports.counter : c.server.reports.taken) = UINT32_MAX - 1;
    c.run(1000);
    const std::string what = ofReports ? "reports" : "messages";
    check("GW-04, GWB-11: the same holds for the counter of " + what,
          c.lifeOf(c.last()) != life && get(c.last(), PROTOCOL_RING_REPORT_COUNTER_AT, 4) < 1000 &&
              c.taken() == 0);
  }
}

// What is left in the FIFO makes no event.
void testMore() {
  Bench b;
  b.start(), b.run(120), b.settle();
  for (uint8_t n = 2; n < 80; ++n) b.hello(n);
  b.at.now += 500, ring_server_serve(&b.server);
  check("GW-04: frames left in the controller are not waited for",
        !b.at.fifo.empty() && b.server.node.due_us <= b.server.node.now_us);
}

void testStart() {
  Bench b;
  b.at.randomFails = -1;
  b.start(), b.run(300);
  check("GWB-03: without a random number there is no report, but a node",
        b.at.datagrams.empty() && b.told(0, RING_HELLO) > 0);
  b.at.randomFails = 0;
  b.run(100);
  check("GWB-03: with one there are reports", !b.at.datagrams.empty());
  Bench wrong;
  wrong.parameters.plant.server_port = 0;
  wrong.start(), wrong.run(300);
  check("GWB-04: without a right address there is no report, but a node",
        wrong.at.datagrams.empty() && wrong.told(0, RING_HELLO) > 0 &&
            wrong.at.memory[NODE_PLANT_CONTROL] == 0);
  Bench reset;
  reset.start(), reset.run(100);
  reset.at.memory[NODE_PLANT_CONTROL] = 0, reset.at.memory[NODE_PLANT_IP] = 0;
  reset.run(100);
  check("GWB-04: a controller that was reset gets its addresses again",
        reset.at.memory[NODE_PLANT_CONTROL] == 1 && reset.at.memory[NODE_PLANT_IP] == 10);
  Bench moved;
  moved.start(), moved.run(100);
  moved.parameters.plant.server_ip[3] = 7;
  moved.start(), moved.run(100);
  check("GWB-04: a program that starts sets its addresses also while the port runs",
        moved.at.memory[NODE_PLANT_SERVER_IP + 3] == 7 && moved.at.memory[NODE_PLANT_CONTROL] == 1);
  Bench storage;
  storage.at.storeFails = -1;
  storage.start(), storage.run(100);
  check("GW-04: a memory that fails is told",
        storage.last().at(PROTOCOL_RING_REPORT_STATUS_AT) & PROTOCOL_RING_STATUS_STORAGE);
}

void testNonsense() {
  Bench b;
  b.start(), b.run(120), b.settle();
  std::mt19937 random(5);
  const Bytes models[] = {b.answer(b.last(), Bench::endOf(b.last())), b.order(1, 3, Bytes(100))};
  const uint32_t before = b.server.reports.refused;
  constexpr unsigned kDatagrams = 20000;
  for (unsigned i = 0; i < kDatagrams; ++i) {
    Bytes d = models[i % 2];
    for (unsigned n = random() % 4 + 1; n > 0; --n)
      d[random() % d.size()] ^= static_cast<uint8_t>(1 + random() % 255);
    if (i % 3 == 0) d.resize(1 + random() % PLANT_MOST_BYTES);
    b.at.incoming.push_back(d), b.run(1);
  }
  check("GW-04: nonsense is refused and counted, and changes nothing",
        b.server.reports.refused - before == kDatagrams && b.taken() == 0);
  b.orders(b.order(1, 3, {1})), b.run(5);
  check("GW-04: what is right is taken behind it", b.taken() == 1);
}
}  // namespace

void testGateway() {
  testReports();
  testBreak();
  testPieceJoins();
  testStartInRing();
  testConflict();
  testMoments();
  testMessages();
  testFlood();
  testOrders();
  testResults();
  testBusy();
  testToNobody();
  testNumbers();
  testMore();
  testStart();
  testNonsense();
}

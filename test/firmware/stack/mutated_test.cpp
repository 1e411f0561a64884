// Mutated mailbox messages: good ones with bytes changed, cut off, joined, or none at all, in every state and
// in the middle of transfers. After each a good request is served, and the state is what it was.
#include <random>

#include "bench.h"

namespace {
std::vector<std::pair<int, Bytes>> seeds() {
  const auto sdo = [](Bytes b) { return std::pair<int, Bytes>{3, Bench::join({0, 0x20}, b)}; };
  const auto information = [](Bytes b) { return std::pair<int, Bytes>{3, Bench::join({0, 0x80}, b)}; };
  std::vector<std::pair<int, Bytes>> all = {sdo({0x40, 0x18, 0x10, 1, 0, 0, 0, 0}),
                                            sdo({0x50, 0x00, 0x80, 0, 0, 0, 0, 0}),
                                            sdo({0x40, 0x00, 0x20, 0, 0, 0, 0, 0}),
                                            sdo({0x60, 0, 0, 0, 0, 0, 0, 0}),
                                            sdo({0x70, 0, 0, 0, 0, 0, 0, 0}),
                                            sdo({0x2b, 0x00, 0x80, 1, 1, 2, 0, 0}),
                                            sdo({0x21, 0x00, 0x20, 0, 44, 1, 0, 0, 1, 2}),
                                            sdo({0x01, 1, 2, 3, 4, 5, 6, 7}),
                                            sdo({0x00, 1, 2, 3, 4, 5, 6, 7}),
                                            sdo({0x10, 1, 2, 3, 4, 5, 6, 7}),
                                            sdo({0x80, 0, 0, 0, 0, 0, 0, 0}),
                                            sdo({0x2f, 0x00, 0x16, 0, 0, 0, 0, 0}),
                                            sdo({0x23, 0x00, 0x16, 1, 0x10, 0, 0x10, 0x70}),
                                            sdo({0x2f, 0x00, 0x16, 0, 1, 0, 0, 0}),
                                            sdo({0x2f, 0x12, 0x1c, 0, 0, 0, 0, 0}),
                                            sdo({0x2b, 0x13, 0x1c, 1, 1, 0x1a, 0, 0}),
                                            sdo({0x31, 0x12, 0x1c, 0, 4, 0, 0, 0, 1, 0, 0, 0x16}),
                                            sdo({0x31, 0x13, 0x1c, 0, 4, 0, 0, 0, 1, 0, 1, 0x1a}),
                                            information({1, 0, 0, 0, 1, 0}),
                                            information({3, 0, 0, 0, 0x00, 0x80}),
                                            information({5, 0, 0, 0, 0x00, 0x80, 4, 0xff}),
                                            {4, {1, 0, 0, 0, 0, 0, 'a', 'p', 'p', '.', 'b', 'i', 'n'}},
                                            {4, {2, 0, 0, 0, 0, 0, 'a', 'p', 'p', '.', 'b', 'i', 'n'}},
                                            {4, Bench::join({3, 0, 1, 0, 0, 0}, Bytes(116, 0xaa))},
                                            {4, {3, 0, 1, 0, 0, 0, 1, 2}},
                                            {4, {4, 0, 1, 0, 0, 0}},
                                            {4, {5, 0, 1, 0x80, 0, 0}},
                                            {4, {6, 0, 0, 0, 0, 0}}};
  Bytes record = Bench::join({0x31, 0x00, 0x80, 0, 24, 0, 0, 0}, Bytes(24, 1));
  record[8] = 8, record[9] = 0;
  all.push_back(sdo(record));
  return all;
}

struct Mutator {
  std::mt19937 random;
  unsigned below(unsigned n) { return static_cast<unsigned>(random() % n); }
  // A message as it lies in the mailbox.
  Bytes message(const std::vector<std::pair<int, Bytes>>& seeds, unsigned box, int counter) {
    auto [type, data] = seeds[below(static_cast<unsigned>(seeds.size()))];
    if (below(8) == 0) data = Bench::join(data, seeds[below(static_cast<unsigned>(seeds.size()))].second);
    for (unsigned n = below(4); n-- > 0;)
      if (!data.empty()) {
        uint8_t& byte = data[below(static_cast<unsigned>(data.size()))];
        switch (below(4)) {
          case 0: byte = static_cast<uint8_t>(random()); break;
          case 1: byte ^= static_cast<uint8_t>(1u << below(8)); break;
          case 2: byte = below(2) ? 0xff : 0; break;
          default: byte = static_cast<uint8_t>(byte + (below(2) ? 1 : -1));
        }
      }
    if (below(10) == 0) data.resize(below(box - 5));
    unsigned length = static_cast<unsigned>(data.size());
    if (below(10) == 0) length = below(2) ? static_cast<unsigned>(random() & 0xffff) : below(box + 4);
    if (below(12) == 0) type = static_cast<int>(below(16));
    const auto head =
        static_cast<uint8_t>(below(30) == 0 ? random() : static_cast<unsigned>(type | counter << 4));
    Bytes m = {static_cast<uint8_t>(length),
               static_cast<uint8_t>(length >> 8),
               0,
               0,
               static_cast<uint8_t>(below(20) == 0 ? random() : 0),
               head};
    m = Bench::join(m, data);
    m.resize(box, below(2) ? 0xff : 0);
    return m;
  }
};

constexpr unsigned kMostAccesses = 20000;  // of one call: far more than a cycle and a message need

// A good request, whatever waits in front of its answer.
bool served(Bench& b) {
  const bool boot = b.demo.slave.state == AL_BOOT;
  const Bytes asked = boot ? Bytes{4, 0, 9, 0, 0, 0} : Bytes{0, 0x20, 0x40, 0x18, 0x10, 3, 0, 0, 0, 0};
  // The counter is another one than that of the last message, whatever that was.
  b.post(boot ? 4 : 3, asked, b.demo.slave.received_counter % 7 + 1);
  for (int i = 0; i < 20; ++i) {
    const auto m = b.fetch();
    if (boot && m.type == 4 && m.data.size() == 6 && m.data[0] == 5) return true;
    if (!boot && m.data == Bytes{0, 0x30, 0x43, 0x18, 0x10, 3, 1, 0, 0, 0}) return true;
    if (m.type == -1) return false;
  }
  return false;
}
}  // namespace

void testMutated(unsigned messages, unsigned seed) {
  const auto all = seeds();
  Mutator mutator{std::mt19937(seed)};
  const uint8_t states[] = {AL_PREOP, AL_SAFEOP, AL_OP, AL_BOOT};
  bool ok = true;
  std::string why;
  unsigned done = 0;
  while (ok && done < messages) {
    const uint8_t state = states[mutator.below(4)];
    Bench b;
    ok = b.to(state);
    for (unsigned burst = 0; ok && burst < 200 && done < messages; ++burst, ++done) {
      if (state == AL_OP && mutator.below(4) == 0) b.outputs({1, 2, 3});
      if (mutator.below(10) == 0) slave_emergency(&b.demo.slave, 0x1234, 0, nullptr);
      if (mutator.below(20) == 0) b.c.setActivate(1, static_cast<uint8_t>(b.c.memory[0x080e] ^ 2));
      if (mutator.below(50) == 0) b.program.busy = 2;
      if (mutator.below(50) == 0) b.program.busyOpening = 2;
      if (mutator.below(50) == 0) b.program.busyReading = 2;
      const Bytes m = mutator.message(all, b.boxBytes, b.demo.slave.received_counter % 7 + 1);
      b.c.write(0, m);
      const unsigned before = b.c.accesses;
      b.serve(1);
      const bool endless = b.c.accesses - before > kMostAccesses;
      // Sometimes the master leaves the answer where it is, reads one, or goes on with the transfer.
      const bool checked = mutator.below(3) > 0;
      if (mutator.below(20) == 0) b.c.frame = mutator.below(3000);
      const int drained = checked ? 20 : static_cast<int>(mutator.below(3));
      for (int i = 0; i < drained && b.fetch(1).type >= 0; ++i) {
      }
      if (checked) b.c.frame = 0, b.serve(10);
      for (int i = 0; checked && i < 20 && b.fetch(1).type >= 0; ++i) {
      }
      const bool good = !checked || served(b);
      const bool stays = b.is(state) && b.demo.slave.state == state;
      ok = !endless && good && stays && !b.c.out;
      if (!ok) {
        why = std::string(endless ? " hangs"
                          : !good ? " leaves a good request unserved"
                          : stays ? " accesses memory"
                                  : " changes the state") +
              " in state " + std::to_string(state) + ", message " + std::to_string(done) + ":";
        for (uint8_t byte : m) why += (why.size() % 3 == 0 ? " " : "") + std::to_string(byte) + ",";
      }
    }
  }
  check("ST-45: " + std::to_string(done) + " mutated messages, seed " + std::to_string(seed) + why, ok);
}

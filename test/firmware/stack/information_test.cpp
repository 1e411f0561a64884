// SDO information: lists and descriptions.
#include <algorithm>

#include "bench.h"

namespace {
const std::vector<unsigned> kAll = {0x1000, 0x1001, 0x1008, 0x1018, 0x1600, 0x1a00, 0x1a01,
                                    0x1c00, 0x1c12, 0x1c13, 0x1c32, 0x1c33, 0x2000, 0x2001,
                                    0x6000, 0x6001, 0x6010, 0x7000, 0x7010, 0x8000};

Bytes question(int opcode, const Bytes& body) {
  return Bench::join({0, 0x80, static_cast<uint8_t>(opcode), 0, 0, 0}, body);
}

// A list put together from its fragments; empty if one of them is wrong.
std::vector<unsigned> list(Bench& b, uint8_t kind) {
  std::vector<unsigned> found;
  b.post(3, question(1, {kind, 0}));
  for (unsigned expected = 1000;;) {
    const auto m = b.fetch();
    if (m.type != 3 || m.data.size() < 6 || m.data.size() + 6 > b.device.send.length || m.data[1] != 0x80)
      return {};
    const auto left = static_cast<unsigned>(Bench::number(m.data, 4, 2));
    const bool first = expected == 1000;
    if ((m.data[2] & 0x7f) != 2 || (m.data[2] >> 7) != (left > 0) || (!first && left != expected - 1))
      return {};
    if (first && Bench::number(m.data, 6, 2) != kind) return {};
    for (size_t at = first ? 8 : 6; at < m.data.size(); at += 2)
      found.push_back(static_cast<unsigned>(Bench::number(m.data, at, 2)));
    if (left == 0) return found;
    expected = left;
  }
}

void lists() {
  Bench b;
  b.to(AL_PREOP);
  check("ST-27: lengths of the lists",
        b.ask(3, question(1, {0, 0})).data == question(2, {0, 0, 20, 0, 2, 0, 3, 0, 0, 0, 0, 0}));
  check("ST-27: all objects", list(b, 1) == kAll);
  check("ST-27: those for RxPDOs and TxPDOs",
        list(b, 2) == std::vector<unsigned>({0x7000, 0x7010}) &&
            list(b, 3) == std::vector<unsigned>({0x6000, 0x6001, 0x6010}));
  check("ST-27: none to store or to set",
        list(b, 4).empty() && b.ask(3, question(1, {4, 0})).data == question(2, {4, 0}));
  // In mailboxes of all lengths, the list has all numbers of fragments.
  bool ok = true;
  for (uint16_t length = 32; length <= 64; ++length) {
    Bench d;
    d.device.send.length = length;
    d.c.setSyncManager(0, 0x1000, 128, 0x26), d.c.setSyncManager(1, 0x1080, length, 0x22);
    d.request(AL_PREOP);
    ok = ok && list(d, 1) == kAll && list(d, 1) == kAll;
  }
  check("ST-27: in fragments", ok);
}

std::string name(const Bytes& b, size_t at) {
  return std::string(b.begin() + static_cast<long>(at), b.end());
}

// 64 bits with a range do not fit the shortest mailbox.
void longRange() {
  Bench d;
  const object_range range{0, 5};
  const object_entry entries[] = {{0x1b, 64, 0x3f, 0, "n", &range}};
  const object only[] = {{0x2000, 0x1b, OBJECT_VARIABLE, 0, entries, ""}};
  d.device.objects = only, d.device.object_count = 1;
  for (uint16_t length = 32; length <= 48; ++length) {
    d.device.send.length = length;
    d.c.setSyncManager(0, 0x1000, 128, 0x26), d.c.setSyncManager(1, 0x1080, length, 0x22);
    d.request(AL_PREOP);
    const Bytes m = d.ask(3, question(5, {0, 0x20, 0, 0x60})).data;
    const bool fits = length >= 38;
    check("ST-28: a range where it fits",
          m.size() == (fits ? 32u : 16u) + (length > 38 || !fits) && m[9] == (fits ? 0x60 : 0));
    d.request(AL_INIT);
  }
}

void descriptions() {
  Bench b;
  b.to(AL_PREOP);
  Bytes m = b.ask(3, question(3, {0x00, 0x80})).data;
  check("ST-28: a record", Bytes(m.begin(), m.begin() + 12) == question(4, {0x00, 0x80, 0x2a, 0, 8, 9}) &&
                               name(m, 12) == "Parameters");
  m = b.ask(3, question(3, {0x00, 0x10})).data;
  check("ST-28: a variable", Bytes(m.begin(), m.begin() + 12) == question(4, {0x00, 0x10, 7, 0, 0, 7}) &&
                                 name(m, 12) == "Device type");
  m = b.ask(3, question(3, {0x12, 0x1c})).data;
  check("ST-28: an array", Bytes(m.begin(), m.begin() + 12) == question(4, {0x12, 0x1c, 6, 0, 1, 8}));
  m = b.ask(3, question(5, {0x00, 0x80, 3, 7})).data;
  check("ST-28: an entry",
        Bytes(m.begin(), m.begin() + 16) == question(6, {0x00, 0x80, 3, 7, 5, 0, 8, 0, 0x3f, 0}) &&
            name(m, 16) == "Filter in ms");
  m = b.ask(3, question(5, {0x00, 0x80, 4, 0xff})).data;
  check("ST-28: with its range",
        Bytes(m.begin(), m.begin() + 24) == question(6, {0x00, 0x80, 4, 0x67, 4, 0, 32, 0, 0x3f, 0, 0x18,
                                                         0xfc, 0xff, 0xff, 0xe8, 3, 0, 0}) &&
            name(m, 24) == "Offset");
  m = b.ask(3, question(5, {0x00, 0x70, 2, 0xff})).data;
  check("ST-28: one without range, mappable",
        Bytes(m.begin(), m.begin() + 16) == question(6, {0x00, 0x70, 2, 7, 1, 0, 1, 0, 0x7f, 0}) &&
            name(m, 16) == "Lamp");
  const auto is = [&](const char* what, uint32_t code, const Bytes& asked) {
    check(std::string("ST-29: ") + what, b.ask(3, asked).data == question(7, Bench::little(code, 4)));
  };
  is("no such object", 0x06020000, question(3, {0x01, 0x80}));
  is("no entry of no object", 0x06020000, question(5, {0x01, 0x80, 0, 0}));
  is("no such entry", 0x06090011, question(5, {0x00, 0x80, 9, 0}));
  b.gap(0x1c32, 3);
  is("a gap", 0x06090011, question(5, {0x32, 0x1c, 3, 0}));
  is("no such list", 0x06090030, question(1, {6, 0}));
  is("an unknown question", 0x05040001, question(9, {0, 0}));
  is("an answer", 0x05040001, question(2, {0, 0}));
  is("half a question for an entry", 0x05040001, question(5, {0x00, 0x80}));
  Bench d;
  d.device.send.length = 32;
  d.c.setSyncManager(0, 0x1000, 128, 0x26), d.c.setSyncManager(1, 0x1080, 32, 0x22);
  d.request(AL_PREOP);
  m = d.ask(3, question(5, {0x00, 0x80, 8, 0})).data;
  check("ST-28: a name is cut off", m.size() == 26 && name(m, 16) == "Serial num");
}
}  // namespace

void testInformation() {
  lists();
  longRange();
  descriptions();
}

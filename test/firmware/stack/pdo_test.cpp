// Mapping and assignment of PDOs, and the process data that follow from them.
#include "bench.h"

namespace {
// The way of a master: count 0, entries, count.
uint32_t map(Bench& b, uint16_t index, const std::vector<uint32_t>& entries, int bytes = 4) {
  if (const uint32_t code = b.download(index, 0, {0})) return code;
  for (size_t i = 0; i < entries.size(); ++i)
    if (const uint32_t code = b.download(index, static_cast<int>(i + 1), Bench::little(entries[i], bytes)))
      return code;
  return b.download(index, 0, {static_cast<uint8_t>(entries.size())});
}
uint32_t mapAtOnce(Bench& b, uint16_t index, const std::vector<uint32_t>& entries, int bytes = 4) {
  Bytes data = {static_cast<uint8_t>(entries.size()), 0};
  for (uint32_t e : entries) data = Bench::join(data, Bench::little(e, bytes));
  return b.download(index, 0, data, true);
}

void change() {
  for (bool atOnce : {false, true}) {
    const auto set = atOnce ? mapAtOnce : map;
    Bench b;
    b.to(AL_PREOP);
    const bool ok = set(b, 0x1600, {0x70100010, 0x70000201, 0x00000003, 0x70000110, 0x00000004}, 4) == 0 &&
                    set(b, 0x1a00, {0x60100010, 0x60000110}, 4) == 0 && set(b, 0x1c13, {0x1a00}, 2) == 0;
    check("ST-31: a mapping is changed", ok);
    b.process(5, 4);
    b.request(AL_SAFEOP);
    check("ST-06, ST-33: the length of the SyncManagers follows",
          b.is(AL_SAFEOP) && b.demo.slave.output_bytes == 5);
    b.outputs({0x34, 0x12, 0xf1, 0xde, 0xf0}), b.serve(), b.request(AL_OP);
    check("ST-33: outputs go where the mapping says, bit by bit",
          b.is(AL_OP) && b.demo.objects.object_7010 == 0x1234 && b.demo.objects.object_7000_02 == 1 &&
              b.demo.objects.object_7000_01 == 0x0def);
    b.demo.objects.object_6010 = -2, b.demo.objects.object_6000_01 = 0xabcd;
    b.outputs(Bytes(5)), b.serve();
    check("ST-33: inputs come from there", b.inputs() == Bytes({0xfe, 0xff, 0xcd, 0xab}));
  }
  Bench b;
  b.to(AL_OP);
  b.demo.objects.object_6000_01 = 0x1122, b.demo.objects.object_6001 = 0x3344;
  b.outputs({0x78, 0x56, 0xff}), b.serve();
  check("ST-32, ST-33: padding is nobody's; PDOs stand in their order",
        b.inputs() == Bytes({0x22, 0x11, 0x44, 0x33}) && b.demo.objects.object_7000_01 == 0x5678 &&
            b.demo.objects.object_7000_02 == 1);
  Bench none;
  none.to(AL_PREOP);
  check("ST-31: nothing assigned", map(none, 0x1c12, {}, 2) == 0 && map(none, 0x1c13, {}, 2) == 0);
  none.process(0, 0), none.request(AL_SAFEOP);
  none.request(AL_OP);
  check("ST-06: needs no SyncManagers, and OP no outputs", none.is(AL_OP));
  Bench on;
  on.to(AL_PREOP);
  map(on, 0x1c13, {}, 2);
  on.process(3, 4), on.request(AL_SAFEOP);
  check("ST-06: and must have none", on.error(AL_PREOP, 0x001e));
}

void refused() {
  struct Row {
    const char* what;
    uint16_t index;
    std::vector<uint32_t> entries;
    int bytes;
    uint32_t code;
  };
  const std::vector<Row> table = {
      {"an input in an RxPDO", 0x1600, {0x60000110}, 4, 0x06040041},
      {"an output in a TxPDO", 0x1a00, {0x70000110}, 4, 0x06040041},
      {"what is not mappable", 0x1600, {0x80000110}, 4, 0x06040041},
      {"another number of bits", 0x1600, {0x70000108}, 4, 0x06040041},
      {"padding of no bits", 0x1600, {0x00000000}, 4, 0x06040041},
      {"no object", 0x1600, {0x71000110}, 4, 0x06020000},
      {"no entry", 0x1600, {0x70000310}, 4, 0x06090011},
      {"too many bits", 0x1600, {0xff, 0xff, 0xff}, 4, 0x06040042},
      {"a TxPDO for outputs", 0x1c12, {0x1a00}, 2, 0x06040041},
      {"no PDO", 0x1c13, {0x1a02}, 2, 0x06040041},
      {"the same PDO twice", 0x1c13, {0x1a01, 0x1a01}, 2, 0x06040043},
  };
  for (const Row& row : table)
    for (bool atOnce : {false, true}) {
      Bench b;
      b.to(AL_PREOP);
      const auto objects = b.demo.objects;
      const uint32_t got = (atOnce ? mapAtOnce : map)(b, row.index, row.entries, row.bytes);
      char code[32];
      std::snprintf(code, sizeof code, ", 0x%08x", got);
      check(std::string("ST-25, ST-32: ") + row.what + code, got == row.code);
      if (atOnce)
        check("ST-21, ST-23: what is refused as a whole leaves no trace",
              b.program.written.empty() && std::memcmp(&objects, &b.demo.objects, sizeof objects) == 0);
      else check("ST-31: what cannot be counted stays 0", b.upload(row.index, 0) == Bytes{0});
    }
  Bench counted;
  counted.to(AL_PREOP);
  counted.demo.objects.object_1600_02 = 0x71000110;
  counted.program.written.clear();
  check("ST-31: a count that cannot be leaves the one before",
        counted.download(0x1600, 0, {2}) == 0x06020000 && counted.upload(0x1600, 0) == Bytes{3} &&
            counted.program.written.empty());
  Bench b;
  b.to(AL_PREOP);
  check("ST-25: PDOs that are too long together",
        map(b, 0x1a00, std::vector<uint32_t>(8, 0xff)) == 0 && map(b, 0x1a01, {0xff}) == 0 &&
            map(b, 0x1c13, {0x1a00, 0x1a01}, 2) == 0x06040042 && map(b, 0x1c13, {0x1a00}, 2) == 0);
  Bench d;
  d.to(AL_PREOP);
  check("ST-31: a count without entries of its own keeps those that were",
        map(d, 0x1600, {}) == 0 && d.download(0x1600, 0, {3}) == 0 &&
            d.upload(0x1600, 0, true).data.size() == 14);
  d.process(), d.request(AL_SAFEOP);
  check("ST-31: only in PREOP",
        d.download(0x1600, 0, {0}) == 0x08000022 && mapAtOnce(d, 0x1c12, {}, 2) == 0x08000022);
  check("ST-34: an output in SAFEOP", d.download(0x7000, 1, {1, 2}) == 0);
  d.outputs({0, 0, 0}), d.serve(), d.request(AL_OP);
  check("ST-34: a mapped output in OP",
        d.download(0x7000, 1, {1, 2}) == 0x06010006 && d.download(0x7010, 0, {1, 2}) == 0);
}
}  // namespace

void testPdo() {
  change();
  refused();
}

// SDOs: every way of a transfer, and the table of abort codes (ST-25), typed from the rules.
#include "bench.h"

namespace {
Bytes text(const std::string& s, size_t bytes) {
  Bytes b(s.begin(), s.end());
  b.resize(bytes);
  return b;
}
Bytes long300(int seed) {
  Bytes b;
  for (int i = 0; i < 300; ++i) b.push_back(static_cast<uint8_t>(i * 7 + seed));
  return b;
}

void transfers() {
  Bench b;
  b.to(AL_PREOP);
  check("ST-19: uploads of 1, 2, 4 and 8 bytes",
        b.upload(0x8000, 3) == Bytes{3} && b.upload(0x8000, 2) == Bytes{0xff, 0xff} &&
            b.upload(0x1018, 2) == Bytes{3, 0, 0, 0} && b.upload(0x8000, 8) == Bytes(8));
  const std::string name = "flyframe, I/O device with eight parameters";
  check("ST-19: a text", b.upload(0x1008, 0) == text(name, name.size()));
  check("ST-19: an upload in segments", b.upload(0x2000, 0) == text("flyframe", 300));
  const Bytes raw = b.sdo({0x40, 0x00, 0x80, 3, 0, 0, 0, 0});
  check("ST-19: expedited tells its size", raw == Bytes({0, 0x30, 0x4f, 0x00, 0x80, 3, 3, 0, 0, 0}));
  check("ST-19: an expedited download",
        b.download(0x8000, 1, {0x34, 0x12}) == 0 && b.demo.objects.object_8000_01 == 0x1234);
  check("ST-19: one that does not tell its size",
        b.download(0x8000, 3, {77}, false, Bench::unsized) == 0 && b.demo.objects.object_8000_03 == 77);
  check("ST-19: a normal download", b.download(0x8000, 8, {1, 2, 3, 4, 5, 6, 7, 8}) == 0 &&
                                        b.demo.objects.object_8000_08 == 0x0807060504030201);
  check("ST-19: a short one may be normal, too",
        b.download(0x8000, 1, {5, 6}, false, Bench::normal) == 0 && b.demo.objects.object_8000_01 == 0x0605);
  check("ST-19: a download in segments",
        b.download(0x2000, 0, long300(1)) == 0 && b.upload(0x2000, 0) == long300(1));
  check("ST-20: segments of less than 7 bytes",
        b.download(0x2000, 0, long300(2), false, Bench::segmented) == 0 && b.upload(0x2000, 0) == long300(2));
  check("ST-20: a last segment of one byte, up and down", [&] {
    bool ok = true;
    for (size_t n : {112u + 119u + 1u, 112u + 119u, 112u + 119u + 6u, 112u + 119u + 7u, 113u, 112u, 111u}) {
      Bytes d = long300(3);
      d.resize(n);
      ok = ok && b.download(0x2000, 0, d) == 0;
      d.resize(300);
      ok = ok && b.upload(0x2000, 0) == d;
    }
    return ok;
  }());
  check("ST-19, ST-20: uploads through mailboxes of all lengths", [] {
    bool ok = true;
    for (uint16_t length = 32; length <= 128; ++length) {
      Bench d;
      d.device.send.length = length;
      d.c.setSyncManager(0, 0x1000, 128, 0x26), d.c.setSyncManager(1, 0x1080, length, 0x22);
      d.request(AL_PREOP);
      d.download(0x2000, 0, long300(5));
      ok = ok && d.upload(0x2000, 0) == long300(5) && d.upload(0x1008, 0).data.size() == 42;
    }
    return ok;
  }());
  check("ST-24: a shorter text is filled up",
        b.download(0x2000, 0, {'h', 'i'}) == 0 && b.upload(0x2000, 0) == text("hi", 300) &&
            b.download(0x2000, 0, {}, false, Bench::normal) == 0 && b.upload(0x2000, 0) == Bytes(300));
  check("ST-19: negative, floating and small numbers",
        b.download(0x8000, 4, {0x18, 0xfc, 0xff, 0xff}) == 0 && b.demo.objects.object_8000_04 == -1000 &&
            b.download(0x8000, 5, {0, 0, 0x20, 0x41}) == 0 && b.demo.objects.object_8000_05 == 10.0f &&
            b.download(0x8000, 7, {3}) == 0 && b.demo.objects.object_8000_07 == 3);
}

void whole() {
  Bench b;
  b.to(AL_PREOP);
  b.download(0x2000, 0, long300(1));
  const auto unchanged = [&] { return b.upload(0x2000, 0) == long300(1); };
  const Bytes begin = {0x21, 0x00, 0x20, 0, 44, 1, 0, 0, 9, 9, 9};
  b.sdo(begin);
  check("ST-21: a transfer that is left is without effect", unchanged());
  b.sdo(begin), b.ask(3, {0, 0x20, 0x80, 0x00, 0x20, 0, 0, 0, 0, 0});
  check("ST-21: one that is aborted, too, and the abort is not answered",
        b.abortOf(b.sdo({0x01, 1, 2, 3, 4, 5, 6, 7})) == 0x05040001 && unchanged());
  b.sdo(begin);
  check("ST-21: a wrong toggle bit ends it",
        b.abortOf(b.sdo({0x10, 1, 2, 3, 4, 5, 6, 7})) == 0x05030000 &&
            b.abortOf(b.sdo({0x00, 1, 2, 3, 4, 5, 6, 7})) == 0x05040001 && unchanged());
  b.sdo({0x40, 0x00, 0x20, 0, 0, 0, 0, 0});
  b.demo.objects.object_2000[100] = 'X';
  const Bytes next = b.sdo({0x60, 0, 0, 0, 0, 0, 0, 0});
  check("ST-21: an upload is of one moment", next[3 + 100] == long300(1)[100]);
  Bench d;
  d.to(AL_PREOP);
  d.download(0x2000, 0, long300(1));
  d.sdo(begin);
  d.request(AL_INIT), d.mailboxes(), d.request(AL_PREOP);
  check("ST-21: INIT ends a transfer",
        d.abortOf(d.sdo({0x01, 1, 2, 3, 4, 5, 6, 7})) == 0x05040001 && d.upload(0x2000, 0) == long300(1));
}

// 0x8000: UINT, UINT, USINT, DINT, REAL, BOOL, BIT2, ULINT.
const Bytes kParameters = {
    1,    2,    3,    4,    50,   0xe8, 3,    0,   0, 0, 0, 0x80, 0x3f, 0x01 | 2 << 1 | 0x15 << 3,
    0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x02};

void complete() {
  Bench b;
  b.to(AL_PREOP);
  check("ST-22: complete upload with subindex 0 as 16 bit",
        b.upload(0x1018, 0, true) == Bytes{4, 0, 0, 0, 0, 0, 3, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0});
  check("ST-22: from subindex 1",
        b.upload(0x1018, 1, true) == Bytes{0, 0, 0, 0, 3, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0});
  check("ST-22: bits lie one behind the other",
        b.download(0x8000, 1, kParameters, true) == 0 && b.demo.objects.object_8000_01 == 0x0201 &&
            b.demo.objects.object_8000_02 == 0x0403 && b.demo.objects.object_8000_03 == 50 &&
            b.demo.objects.object_8000_04 == 1000 && b.demo.objects.object_8000_05 == 1.0f &&
            b.demo.objects.object_8000_06 == 1 && b.demo.objects.object_8000_07 == 2 &&
            b.demo.objects.object_8000_08 == 0x4000000000000015);
  check("ST-22: and come back the same", b.upload(0x8000, 1, true) == kParameters);
  b.gap(0x1c32, 3);
  check("ST-22: a gap has no place",
        b.upload(0x1c32, 0, true) == Bytes{5, 0, 1, 0, 0, 0, 0, 0, 3, 0, 0, 0, 0, 0});
  check("ST-22: as many entries as a writable subindex 0 says",
        b.upload(0x1600, 0, true) == Bytes{3, 0, 0x10, 1, 0, 0x70, 1, 2, 0, 0x70, 7, 0, 0, 0} &&
            b.upload(0x1a00, 1, true) == Bytes{0x10, 1, 0, 0x60});
  check("ST-22: the count comes with its value",
        b.download(0x8000, 0, Bench::join({8, 0}, kParameters), true) == 0 &&
            b.download(0x8000, 0, Bench::join({7, 0}, kParameters), true) == 0x06090030);
  Bytes wrong = kParameters;
  wrong[0] = 0x77, wrong[4] = 101;
  b.program.written.clear();
  check("ST-23: one wrong entry and nothing is written", b.download(0x8000, 1, wrong, true) == 0x06090031 &&
                                                             b.upload(0x8000, 1, true) == kParameters &&
                                                             b.program.written.empty());
  check("ST-23: nor with a read-only entry", b.download(0x1018, 1, Bytes(16), true) == 0x06010002);
  check("ST-23: nor with a count that cannot be",
        b.download(0x1600, 0, Bench::join({9, 0}, Bytes(32)), true) == 0x06090031 &&
            b.upload(0x1600, 0) == Bytes{3});
  check("ST-22: too long and too short", b.download(0x8000, 1, Bytes(21), true) == 0x06070013 &&
                                             b.download(0x8000, 1, Bytes(25), true) == 0x06070012);
  wrong = kParameters;
  b.request(AL_PREOP), b.process(), b.request(AL_SAFEOP);
  check("ST-23: nor with one that cannot be written now", b.download(0x8000, 1, wrong, true) == 0x08000022);
}

void aborts() {
  struct Row {
    uint32_t code;
    const char* what;
    std::function<uint32_t(Bench&)> act;
  };
  const auto command = [](uint8_t c) {
    return [c](Bench& b) { return b.abortOf(b.sdo({c, 0x00, 0x80, 1, 0, 0, 0, 0})); };
  };
  const auto up = [](uint16_t index, int sub, bool complete = false) {
    return [=](Bench& b) { return b.upload(index, sub, complete).abort; };
  };
  const auto down = [](uint16_t index, int sub, const Bytes& data, bool complete = false,
                       Bench::Way way = Bench::automatic) {
    return [=](Bench& b) { return b.download(index, sub, data, complete, way); };
  };
  const std::vector<Row> table = {
      {0x05040001, "an unknown command", command(0xa0)},
      {0x05040001, "another unknown command", command(0xe0)},
      {0x05040001, "an upload segment of nothing", command(0x60)},
      {0x05040001, "a download segment of nothing", command(0x00)},
      {0x06010000, "complete access from subindex 2", up(0x8000, 2, true)},
      {0x06010000, "complete access to a variable", up(0x1000, 0, true)},
      {0x06010000, "complete download to a variable", down(0x2000, 0, {1}, true)},
      {0x06010002, "a constant", down(0x1000, 0, {1, 2, 3, 4})},
      {0x06010002, "the number of entries", down(0x8000, 0, {8})},
      {0x06010002, "an input", down(0x6000, 1, {1, 2})},
      {0x06010003, "a mapping that counts", down(0x1600, 1, {0x10, 1, 0, 0x70})},
      {0x06010003, "an assignment that counts", down(0x1c12, 1, {0, 0x16})},
      {0x06010003, "a mapping that counts, completely", down(0x1a00, 1, {0x10, 1, 0, 0x60}, true)},
      {0x06020000, "upload of no object", up(0x3000, 0)},
      {0x06020000, "download of no object", down(0x3000, 0, {1})},
      {0x06020000, "complete upload of no object", up(0xffff, 0, true)},
      {0x06070010, "more than was announced",
       [](Bench& b) {
         return b.abortOf(b.sdo({0x21, 0x00, 0x20, 0, 2, 0, 0, 0, 1, 2, 3}));
       }},
      {0x06070012, "too long, expedited", down(0x8000, 1, {1, 2, 3})},
      {0x06070012, "too long, normal", down(0x8000, 8, Bytes(9))},
      {0x06070012, "far too long",
       [](Bench& b) {
         return b.abortOf(b.sdo({0x21, 0x00, 0x20, 0, 255, 255, 255, 255}));
       }},
      {0x06070012, "segments beyond the size",
       [](Bench& b) {
         b.sdo({0x21, 0x00, 0x20, 0, 3, 0, 0, 0});
         return b.abortOf(b.sdo({0x00, 1, 2, 3, 4, 5, 6, 7}));
       }},
      {0x06070013, "too short, expedited", down(0x8000, 1, {1})},
      {0x06070013, "too short, normal", down(0x8000, 8, Bytes(7))},
      {0x06070013, "the last segment too early",
       [](Bench& b) {
         b.sdo({0x21, 0x00, 0x20, 0, 30, 0, 0, 0});
         return b.abortOf(b.sdo({0x01, 1, 2, 3, 4, 5, 6, 7}));
       }},
      {0x06090011, "a subindex beyond", up(0x8000, 9)},
      {0x06090011, "a gap",
       [](Bench& b) {
         b.gap(0x1c32, 3);
         return b.upload(0x1c32, 3).abort;
       }},
      {0x06090011, "subindex 1 of a variable", up(0x1000, 1)},
      {0x06090011, "download to a gap",
       [](Bench& b) {
         b.gap(0x8000, 1);
         return b.download(0x8000, 1, {1, 0});
       }},
      {0x06090031, "above the range", down(0x8000, 3, {101})},
      {0x06090032, "below the range", down(0x8000, 3, {0})},
      {0x06090031, "above a signed range", down(0x8000, 4, {0xe9, 3, 0, 0})},
      {0x06090032, "below a signed range", down(0x8000, 4, {0x17, 0xfc, 0xff, 0xff})},
      {0x06090031, "a BOOL of 2", down(0x8000, 6, {2})},
      {0x06090031, "a BIT2 of 4", down(0x8000, 7, {4})},
      {0x06090031, "a mapping of more than there is room for", down(0x1600, 0, {9})},
      {0x08000022, "a mapping in SAFEOP",
       [](Bench& b) {
         b.process(), b.request(AL_SAFEOP);
         return b.download(0x1600, 0, {0});
       }},
      {0x06010006, "a mapped output in OP",
       [](Bench& b) {
         b.to(AL_OP);
         return b.download(0x7000, 1, {1, 2});
       }},
      {0x05030000, "an upload segment twice",
       [](Bench& b) {
         b.sdo({0x40, 0x00, 0x20, 0, 0, 0, 0, 0}), b.sdo({0x60, 0, 0, 0, 0, 0, 0, 0});
         return b.abortOf(b.sdo({0x60, 0, 0, 0, 0, 0, 0, 0}));
       }},
  };
  for (const Row& row : table) {
    Bench b;
    b.to(AL_PREOP);
    const uint32_t got = row.act(b);
    char code[32];
    std::snprintf(code, sizeof code, ", 0x%08x", got);
    check(std::string("ST-25: ") + row.what + code,
          got == row.code && b.upload(0x1018, 3) == Bytes{1, 0, 0, 0});
  }
  // What nobody may read is not in the demonstration.
  Bench b;
  object_entry entries[] = {{5, 8, 0x38, 0, "", nullptr}};
  const object only[] = {{0x2000, 5, OBJECT_VARIABLE, 0, entries, ""}};
  b.device.objects = only, b.device.object_count = 1;
  b.to(AL_PREOP);
  check("ST-25: nobody may read it", b.upload(0x2000, 0).abort == 0x06010001);
  entries[0].access = 0x3c;
  check("ST-25: nor in this state", b.upload(0x2000, 0).abort == 0x08000022);
}

void program() {
  Bench b;
  b.to(AL_PREOP);
  b.program.refuseWrite = 0x08000021;
  check("ST-26: the program refuses a value", b.download(0x8000, 1, {1, 0}) == 0x08000021 &&
                                                  b.demo.objects.object_8000_01 == 0 &&
                                                  b.program.written.empty());
  b.program.refuseWrite = 0;
  b.download(0x8000, 1, {1, 0});
  b.download(0x8000, 1, kParameters, true);
  check("ST-26: and learns what was written",
        b.program.written == std::vector<uint32_t>{0x800001, 0x800001, 0x800002, 0x800003, 0x800004, 0x800005,
                                                   0x800006, 0x800007, 0x800008});
  b.program.reads.clear();
  b.upload(0x6010, 0), b.upload(0x1018, 1, true);
  check("ST-26: and what is read",
        b.program.reads == std::vector<uint32_t>{0x601000, 0x101801, 0x101802, 0x101803, 0x101804});
}

// The highest subindex that there is.
void most() {
  Bench b;
  std::vector<object_entry> entries(256, {5, 8, 0x3f, 0, "", nullptr});
  entries[0].access = 7;
  const object only[] = {{0x2000, 0x2a, OBJECT_RECORD, 255, entries.data(), ""}};
  b.device.objects = only, b.device.object_count = 1;
  b.demo.objects.object_1000 = 255;
  b.to(AL_PREOP);
  check("ST-45: complete access to 255 entries ends", b.upload(0x2000, 0, true).data.size() == 257);
  check("ST-25: no type of synchronization", [] {
    Bench d;
    d.to(AL_PREOP);
    return d.download(0x1c32, 1, {0x34, 0x12}) == 0x06090030 && d.download(0x1c33, 1, {2, 0}) == 0x06090030 &&
           d.download(0x1c33, 1, {0x22, 0}) == 0 && d.download(0x1c32, 1, {0, 0}) == 0;
  }());
}

void states() {
  for (uint8_t state : {AL_PREOP, AL_SAFEOP, AL_OP}) {
    Bench b;
    b.to(state);
    check("ST-19: SDOs in each state", b.download(0x8000, 1, {7, 0}) == 0 &&
                                           b.upload(0x8000, 1) == Bytes{7, 0} &&
                                           b.download(0x2000, 0, long300(4)) == 0 && b.is(state));
  }
}
}  // namespace

void testSdo() {
  transfers();
  whole();
  complete();
  aborts();
  program();
  most();
  states();
}

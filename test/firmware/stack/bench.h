// The stack with the demonstration's dictionary on a fake controller, and what a master says to it. The
// master's half of the mailbox protocols is written from ETG.1000.6 as the rules tell it, not from the stack.
#pragma once

#include <cstring>
#include <string>

#include "controller.h"

extern "C" {
#include "slave-demo.objects.h"
}

// The device's program, which a test can make refuse, be busy, or fail.
struct Program {
  std::vector<int> entered;
  uint16_t refuseState = 0, refuseCode = 0;
  uint32_t refuseWrite = 0;
  std::vector<uint32_t> written, reads;  // index << 8 | subindex
  unsigned cycles = 0, validCycles = 0;
  bool lastValid = false;
  const uint16_t* output = nullptr;  // the first of the outputs
  int lastOutput = -1;              // as the last cycle had it
  // Files: one, `content`; while `busy` is above 0 packets are refused.
  std::string name = "app.bin", opened;
  uint32_t password = 0, openError = 0, fileError = 0;
  Bytes content;
  int busy = 0;
  unsigned closedWell = 0, closedBadly = 0, opens = 0;
  int busyOpening = 0, busyReading = 0;
};

class Bench {
 public:
  Bench();
  static constexpr unsigned kBox = 128, kBoot = 256;

  Controller c;
  slave_demo demo{};
  Program program;
  slave_application application{};
  slave_device device = slave_demo_device;  // a copy, for tests that want another one

  // As the generated function does, with `device`, and each memory by itself, so that ASan sees its end.
  void start();
  void gap(uint16_t index, uint8_t subindex);  // takes an entry out of the dictionary
  void serve(int times = 3) {
    for (int i = 0; i < times; ++i) slave_serve(&demo.slave);
  }
  // ---- states ----
  void mailboxes(unsigned length = kBox);
  void bootMailboxes();
  void process(unsigned outputs = 3, unsigned inputs = 4);
  unsigned request(uint16_t control);  // AL control; the AL status that follows
  bool to(uint8_t state);              // INIT to that state, with the right settings
  bool error(unsigned state, unsigned code) { return c.status() == (state | 0x10) && c.code() == code; }
  bool is(unsigned state) { return c.status() == state && c.code() == 0; }
  void outputs(const Bytes& data) { c.write(2, data); }
  Bytes inputs() {
    Bytes b;
    return c.read(3, b) ? b : Bytes{};
  }

  // ---- mailbox: a message without header; counters are right unless given ----
  struct Message {
    int type = -1;  // -1: there is none
    int counter = 0;
    Bytes data;
  };
  bool post(int type, const Bytes& data, int counter = -1, int channel = 0, int length = -1);
  Message fetch(int passes = 5);  // serves until there is a message
  Message ask(int type, const Bytes& data) {
    post(type, data);
    return fetch();
  }
  int nextCounter();
  unsigned boxBytes = kBox;

  // ---- SDO: data, or an abort code ----
  struct Result {
    uint32_t abort = 0;
    Bytes data;
    bool operator==(const Bytes& expected) const { return abort == 0 && data == expected; }
  };
  Result upload(uint16_t index, int subindex, bool complete = false);
  enum Way { automatic, expedited, unsized, normal, segmented };
  uint32_t download(uint16_t index, int subindex, const Bytes& data, bool complete = false,
                    Way way = automatic);
  // A raw SDO; the answer's CoE message.
  Bytes sdo(const Bytes& command);
  uint32_t abortOf(const Bytes& reply);

  static Bytes join(Bytes a, const Bytes& b) {
    a.insert(a.end(), b.begin(), b.end());
    return a;
  }
  static Bytes little(uint64_t v, int bytes);
  static uint64_t number(const Bytes& b, size_t at, int bytes);

 private:
  int counter_ = 0;
  uint64_t entry_ = 0;  // index and subindex of the last SDO that named one
  bool segment_ = false;
  std::vector<uint8_t> request_, reply_[2], transfer_, process_;
  std::vector<slave_mapped> outputs_, inputs_;
  std::vector<object> objects_;
  std::vector<object_entry> entries_;
};

// A check per test: the name of the rule, and what went wrong.
inline void expect(const std::string& name, bool ok) { check(name, ok); }

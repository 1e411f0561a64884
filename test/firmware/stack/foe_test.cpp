// FoE: files both ways, busy, errors and ends at every packet.
#include <algorithm>

#include "bench.h"

namespace {
Bytes open(int opcode, const std::string& name, uint32_t password = 0) {
  return Bench::join(Bench::join({static_cast<uint8_t>(opcode), 0}, Bench::little(password, 4)),
                     Bytes(name.begin(), name.end()));
}
Bytes packet(uint32_t n, const Bytes& data) {
  return Bench::join(Bench::join({3, 0}, Bench::little(n, 4)), data);
}
Bytes acknowledge(uint32_t n) { return Bench::join({4, 0}, Bench::little(n, 4)); }
Bytes failed(uint32_t code) { return Bench::join({5, 0}, Bench::little(code, 4)); }
Bytes pattern(size_t n) {
  Bytes b;
  for (size_t i = 0; i < n; ++i) b.push_back(static_cast<uint8_t>(i * 13 + i / 251));
  return b;
}

// A write of a whole file; how many times the slave was busy, or -1.
int write(Bench& b, const Bytes& content) {
  const size_t most = b.boxBytes - 12;
  if (b.ask(4, open(2, "app.bin", 0x1234)).data != acknowledge(0)) return -1;
  int busy = 0;
  for (size_t at = 0, n = 1;; at += most, ++n) {
    const size_t count = std::min(most, content.size() - std::min(at, content.size()));
    const Bytes part(content.begin() + static_cast<long>(at),
                     content.begin() + static_cast<long>(at + count));
    Bytes answer;
    while ((answer = b.ask(4, packet(static_cast<uint32_t>(n), part)).data)[0] == 6) ++busy;
    if (answer != acknowledge(static_cast<uint32_t>(n))) return -1;
    if (count < most) return busy;
  }
}

// A read of a whole file, with so many busy answers of the master to each packet.
Bytes read(Bench& b, int busy = 0) {
  Bytes content;
  Bytes m = b.ask(4, open(1, "app.bin")).data;
  for (uint32_t n = 1;; ++n) {
    for (int i = 0; i < busy; ++i) {
      const Bytes again = b.ask(4, {6, 0, 0, 0, 0, 0}).data;
      if (again != m) return {0xbb};
    }
    if (m.size() < 6 || m[0] != 3 || Bench::number(m, 2, 4) != n) return {0xbd};
    content.insert(content.end(), m.begin() + 6, m.end());
    const bool last = m.size() < b.boxBytes - 6;
    b.post(4, acknowledge(n));
    if (last) return b.fetch().type == -1 ? content : Bytes{0xbe};
    m = b.fetch().data;
  }
}

void files() {
  for (uint8_t state : {AL_BOOT, AL_PREOP, AL_OP}) {
    Bench b;
    b.to(state);
    bool up = true, down = true;
    const size_t most = b.boxBytes - 12;
    for (size_t n : {size_t{0}, size_t{1}, most - 1, most, most + 1, 3 * most, size_t{5000}}) {
      down = down && write(b, pattern(n)) == 0 && b.program.content == pattern(n) &&
             b.program.password == 0x1234;
      up = up && read(b) == pattern(n) && b.program.password == 0;
    }
    check("ST-35: files of many lengths are written", down && b.program.closedBadly == 0);
    check("ST-35: and read", up && b.program.closedWell == 14);
    check("ST-35: the name and password are the program's to judge",
          b.ask(4, open(2, "x", 7)).data == failed(0x8001) && b.program.opened == "x" &&
              b.program.password == 7);
  }
}

void busy() {
  Bench b;
  b.to(AL_BOOT);
  b.program.busy = 9;
  check("ST-36: a busy program", write(b, pattern(1000)) == 9 && b.program.content == pattern(1000));
  check("ST-36: a busy master", read(b, 3) == pattern(1000));
  // An opening, and packets to be read: the master waits, and so does what it asks for next.
  const Bytes sdo{0, 0x20, 0x40, 0, 0x10, 0, 0, 0, 0, 0};
  for (int opcode : {1, 2}) {
    Bench d;
    d.to(AL_PREOP);
    d.program.content = pattern(10), d.program.busyOpening = 20;
    d.post(4, open(opcode, "app.bin", 9)), d.serve();
    d.post(3, sdo), d.serve(10);
    const bool waits = !d.c.full(1) && d.c.full(0) && !d.c.interrupts() && d.program.opened == "app.bin" &&
                       d.program.password == 9;
    const auto answer = d.fetch(20), next = d.fetch();
    const Bytes expected = opcode == 1 ? packet(1, pattern(10)) : acknowledge(0);
    check("ST-36: an opening that is busy is answered later, and the next request behind it",
          waits && answer.data == expected && next.type == 3 && d.program.closedBadly == 0);
  }
  Bench r;
  r.to(AL_PREOP);
  r.program.content = pattern(300), r.program.busyReading = 5;
  r.post(4, open(1, "app.bin"));
  const Bytes all = pattern(300);
  bool ok = r.fetch(10).data == packet(1, Bytes(all.begin(), all.begin() + 116));
  r.program.busyReading = 5, r.post(4, acknowledge(1));
  ok = ok && r.fetch(10).data == packet(2, Bytes(all.begin() + 116, all.begin() + 232));
  r.program.busyReading = 5, r.post(4, {6, 0, 0, 0, 0, 0});
  ok = ok && r.fetch(10).data == packet(2, Bytes(all.begin() + 116, all.begin() + 232));
  check("ST-36: a packet that cannot be read yet", ok);
  // Busy without end: the master goes to INIT, and everything is new.
  for (bool opening : {true, false}) {
    Bench e;
    e.to(AL_PREOP);
    (opening ? e.program.busyOpening : e.program.busyReading) = 1 << 20;
    e.program.content = pattern(300);
    e.post(4, open(1, "app.bin")), e.serve(20);
    e.request(AL_INIT);
    ok = e.is(AL_INIT) && e.program.closedBadly == 1;
    e.program.busyOpening = e.program.busyReading = 0;
    e.to(AL_PREOP);
    check("ST-36, ST-38: INIT ends what is busy", ok && e.fetch().type == -1 && read(e) == pattern(300));
  }
  Bench f;
  f.to(AL_PREOP);
  f.program.busyOpening = 3, f.program.openError = 0x8002;
  f.post(4, open(2, "app.bin"));
  check("ST-36, ST-37: busy, and then refused",
        f.fetch(10).data == failed(0x8002) && f.program.closedBadly == 0 && f.ask(3, sdo).type == 3);
}

void mistakes() {
  Bench b;
  b.to(AL_BOOT);
  const auto good = [&] { return write(b, pattern(300)) == 0 && read(b) == pattern(300); };
  b.ask(4, open(2, "app.bin"));
  check("ST-37: a packet too far", b.ask(4, packet(2, {1})).data == failed(0x8005) && good());
  b.program.content = pattern(5000);
  b.ask(4, open(1, "app.bin"));
  check("ST-37: an acknowledge of another packet", b.ask(4, acknowledge(2)).data == failed(0x8005) && good());
  check("ST-37: a packet of no file", b.ask(4, packet(1, {1})).data == failed(0x8004) && good());
  check("ST-37: an acknowledge of no file", b.ask(4, acknowledge(1)).data == failed(0x8004) && good());
  check("ST-37: a busy master without file", b.ask(4, {6, 0, 0, 0, 0, 0}).data == failed(0x8004) && good());
  check("ST-37: no message of FoE", b.ask(4, {9, 0, 0, 0, 0, 0}).data == failed(0x8004) && good());
  b.program.openError = 0x8002;
  check("ST-37: the program refuses a file", b.ask(4, open(2, "app.bin")).data == failed(0x8002));
  b.program.openError = 0, b.program.fileError = 0x8003;
  b.ask(4, open(2, "app.bin"));
  check("ST-37: or a packet", b.ask(4, packet(1, {1})).data == failed(0x8003));
  check("ST-37: or cannot read", b.ask(4, open(1, "app.bin")).data == failed(0x8003));
  b.program.fileError = 0;
  b.application.files = {};
  check("ST-37: no files", b.ask(4, open(1, "app.bin")).data == failed(0x8001) &&
                               b.ask(4, open(2, "app.bin")).data == failed(0x8001));
}

// Broken off behind each packet, by each means.
void ends() {
  const Bytes content = pattern(2000);
  bool writes = true, reads = true;
  for (int means = 0; means < 3; ++means)
    for (unsigned stop = 0; stop <= 8; ++stop) {
      Bench b;
      b.to(AL_BOOT);
      const size_t most = b.boxBytes - 12;
      const auto breakOff = [&] {
        if (means == 0) b.post(4, failed(0x8000)), b.serve();
        if (means == 1) b.request(AL_INIT), b.bootMailboxes(), b.request(AL_BOOT);
        if (means == 2) b.ask(4, open(1, "none"));
        return b.program.closedBadly == 1 && b.program.closedWell == 0;
      };
      b.ask(4, open(2, "app.bin"));
      for (unsigned n = 1; n <= stop; ++n)
        b.ask(4, packet(n, Bytes(content.begin() + static_cast<long>((n - 1) * most),
                                 content.begin() + static_cast<long>(std::min(content.size(), n * most)))));
      if (stop * most < content.size()) writes = writes && breakOff();
      writes = writes && write(b, content) == 0 && b.program.content == content;
      b.program.closedBadly = b.program.closedWell = 0;
      b.ask(4, open(1, "app.bin"));
      for (unsigned n = 1; n <= stop && n * most <= content.size(); ++n) b.ask(4, acknowledge(n));
      reads = reads && breakOff() && read(b) == content;
    }
  check("ST-38: a write that is broken off anywhere, and the next one", writes);
  check("ST-38: a read that is broken off anywhere, and the next one", reads);
}
}  // namespace

void testFoe() {
  files();
  busy();
  mistakes();
  ends();
}

// Proves the simulated EEPROM with a master that moves the two lines bit by bit. Exit code 1 if something is
// wrong.
#include <cstdio>

#include "core/eeprom.h"

namespace {
int failures = 0;

void check(const char* name, bool ok) {
  std::printf("%s %s\n", ok ? "ok   " : "WRONG", name);
  if (!ok) ++failures;
}

class BitBang {
 public:
  explicit BitBang(Eeprom& chip) : chip_(chip) {}

  void start() { set(scl_, true), set(true, true), set(true, false), set(false, false); }
  void stop() { set(false, false), set(true, false), set(true, true); }
  void bit(bool b) { set(false, b), set(true, b), set(false, b); }
  bool receive() {
    set(false, true), set(true, true);
    const bool level = !chip_.sdaLow();
    set(false, true);
    return level;
  }
  // True if acknowledged.
  bool send(uint8_t byte) {
    for (int i = 7; i >= 0; --i) bit(byte >> i & 1);
    return !receive();
  }
  uint8_t read(bool more) {
    int byte = 0;
    for (int i = 0; i < 8; ++i) byte = byte << 1 | receive();
    bit(!more);
    return static_cast<uint8_t>(byte);
  }
  void wait(Time t) { now_ += t; }

  bool address(size_t at) {
    const bool one = chip_.chip().addressBytes == 1;
    start();
    if (!send(static_cast<uint8_t>(0xa0 | (one ? at >> 8 << 1 : 0)))) return stop(), false;
    if (!one && !send(static_cast<uint8_t>(at >> 8))) return stop(), false;
    return send(static_cast<uint8_t>(at));
  }
  bool write(size_t at, const Bytes& data) {
    if (!address(at)) return false;
    for (uint8_t b : data)
      if (!send(b)) return stop(), false;
    stop();
    return true;
  }
  Bytes read(size_t at, size_t n) {
    Bytes data;
    if (!address(at)) return data;
    start();
    if (!send(static_cast<uint8_t>(0xa1 | (chip_.chip().addressBytes == 1 ? at >> 8 << 1 : 0))))
      return stop(), data;
    while (data.size() < n) data.push_back(read(data.size() + 1 < n));
    stop();
    return data;
  }

 private:
  // SCL first when it falls, SDA first when it rises, as the two lines are one wire each.
  void set(bool scl, bool sda) {
    if (!scl) scl_ = false, level();
    sda_ = sda, level();
    if (scl) scl_ = true, level();
  }
  void level() {
    now_ += 2 * kUs;
    chip_.lines(now_, scl_, sda_ && !chip_.sdaLow());
    chip_.lines(now_, scl_, sda_ && !chip_.sdaLow());  // the chip's own pull is on the wire too
  }
  Eeprom& chip_;
  Time now_ = 0;
  bool scl_ = true, sda_ = true;
};

Bytes pattern(size_t n) {
  Bytes b(n);
  for (size_t i = 0; i < n; ++i) b[i] = static_cast<uint8_t>(i * 7 + (i >> 8));
  return b;
}

Bytes part(const Bytes& b, size_t at, size_t n) { return Bytes(b.begin() + at, b.begin() + at + n); }

void testChip(const char* name) {
  std::printf("%s\n", name);
  const EepromChip& chip = *findEepromChip(name);
  const Bytes image = pattern(chip.bytes - 100);
  Eeprom eeprom(chip, image);
  BitBang bus(eeprom);
  check("reads from the start", bus.read(0, 16) == part(image, 0, 16));
  check("reads across blocks", bus.read(0x2fe, 8) == part(image, 0x2fe, 8));
  check("reads one byte", bus.read(0x123, 1) == part(image, 0x123, 1));
  check("an image is continued with 0xFF", bus.read(chip.bytes - 4, 4) == Bytes(4, 0xff));
  const Bytes wrapped = bus.read(chip.bytes - 1, 3);
  check("reading wraps at the end", wrapped == Bytes({0xff, image[0], image[1]}));
  bus.start();
  check("reads on from where it was", bus.send(0xa1) && bus.read(false) == image[2]);
  bus.stop();
  bus.start();
  check("another device's address is not acknowledged", !bus.send(0x92));
  bus.stop();

  int saves = 0;
  eeprom.onWritten = [&](const Eeprom&) { ++saves; };
  check("a word is written", bus.write(0x200, {0x12, 0x34}) && eeprom.contents()[0x200] == 0x12 &&
                                 eeprom.contents()[0x201] == 0x34);
  check("then the chip is busy", !bus.address(0x200));
  bus.wait(4800 * kUs);
  check("nearly 5 ms", !bus.address(0x200));
  bus.wait(300 * kUs);
  check("and no longer", bus.read(0x1ff, 4) == Bytes({image[0x1ff], 0x12, 0x34, image[0x202]}));
  Bytes page = pattern(chip.page + 2);
  check("a page write wraps in its page",
        bus.write(0x100 + 4, page) && eeprom.contents()[0x104] == page[chip.page] &&
            eeprom.contents()[0x106] == page[2] && eeprom.contents()[0x103] == page[chip.page - 1] &&
            eeprom.contents()[0x100 + chip.page] == image[0x100 + chip.page]);
  bus.wait(6000 * kUs);
  check("each write is told once", saves == 2);
  bus.address(0x300), bus.send(0x55), bus.start(), bus.stop();
  check("a write without STOP is dropped", eeprom.contents()[0x300] == image[0x300] && saves == 2);
  bus.address(0x300), bus.send(0x55), bus.bit(1), bus.bit(0), bus.bit(1), bus.stop();
  check("a write that stops within a byte is dropped",
        eeprom.contents()[0x300] == image[0x300] && saves == 2);
  check("the chip still answers", bus.read(0x300, 2) == part(image, 0x300, 2));
}
}  // namespace

int main() {
  testChip("24C16");
  testChip("24C32");
  check("the chip follows from the size",
        eepromChipFor(2048)->bytes == 2048 && eepromChipFor(2049)->bytes == 4096 && !eepromChipFor(4097));
  std::printf(failures ? "%d failed\n" : "all passed\n", failures);
  return failures ? 1 : 0;
}

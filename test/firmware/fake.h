// A controller as a host program sees it, and its board: registers behind a port, with the faults a test
// wants.
#pragma once

#include <array>
#include <cstdint>
#include <cstdio>
#include <functional>
#include <map>
#include <string>
#include <vector>

extern "C" {
#include "port.h"
}

struct board {
  virtual ~board() = default;

  std::array<uint8_t, 0x2000> memory{};
  std::array<uint8_t, 0x2000> stuck{};  // bits that stay 0
  // A RAM whose address lines `dead` are not connected: places that differ in them only are one.
  struct {
    uint16_t first, bytes, dead;
  } aliased{};
  std::vector<std::pair<uint16_t, uint8_t>> writes;

  // Non-volatile memory. A number that is not 0 lets so many calls fail from now on, -1 all of them.
  uint32_t stored = 0;
  bool storeKeeps = true;
  int loadFails = 0, storeFails = 0, logWriteFails = 0, logReadFails = 0, randomFails = 0;
  std::map<uint16_t, std::array<uint8_t, BOARD_LOG_BYTES>> log;
  uint8_t erased = 0xff;
  unsigned logWrites = 0;

  uint32_t drawn = 0;  // what random numbers are made from
  uint8_t inputs = 0;
  std::array<std::string, 4> display;
  unsigned displayed = 0;  // calls
  unsigned watched = 0;    // so often the watchdog was served
  std::vector<std::string> notices;

  // Where an address leads to.
  uint16_t place(uint16_t address) const {
    const unsigned at = address - static_cast<unsigned>(aliased.first);
    return static_cast<uint16_t>(at < aliased.bytes ? aliased.first + (at & ~aliased.dead) : address);
  }
  virtual uint8_t readByte(uint16_t address) { return memory.at(place(address)); }
  virtual void writeByte(uint16_t address, uint8_t value) {
    writes.emplace_back(address, value);
    memory.at(place(address)) = static_cast<uint8_t>(value & ~stuck.at(address));
  }
  virtual void wait(uint32_t) {}
  virtual uint32_t time() { return 0; }

  unsigned word(uint16_t address) { return memory.at(address) | memory.at(address + 1u) << 8; }
  void setWord(uint16_t address, unsigned value) {
    memory.at(address) = static_cast<uint8_t>(value),
    memory.at(address + 1u) = static_cast<uint8_t>(value >> 8);
  }
  bool wrote(uint16_t first, uint16_t last) const {
    for (auto& [address, value] : writes)
      if (address >= first && address <= last) return true;
    return false;
  }
  // The last write to an address; -1 if there was none.
  int lastWrite(uint16_t address) const {
    for (size_t i = writes.size(); i-- > 0;)
      if (writes[i].first == address) return static_cast<int>(i);
    return -1;
  }
  static bool fails(int& left) {
    if (left == 0) return false;
    if (left > 0) --left;
    return true;
  }
};

// Counts what is wrong.
inline int failures = 0;
inline void check(const std::string& name, bool ok) {
  std::printf("%s %s\n", ok ? "ok   " : "WRONG", name.c_str());
  if (!ok) ++failures;
}

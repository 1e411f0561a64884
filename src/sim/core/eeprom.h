// A simulated I2C EEPROM: 24C16 or 24C32 (SII-16 to SII-20), bit by bit.
#pragma once

#include <functional>
#include <string>

#include "core/ethernet.h"
#include "core/simulator.h"

struct EepromChip {
  const char* name;
  size_t bytes;
  int addressBytes;  // with one, further address bits are in the control byte
  size_t page;       // bytes written at once
};

// "24C16" or "24C32"; null if the name is neither.
const EepromChip* findEepromChip(const std::string& name);
// The smallest chip that holds an image; null if none does.
const EepromChip* eepromChipFor(size_t imageBytes);

class Eeprom {
 public:
  // An image shorter than the chip is continued with 0xFF; it must not be longer.
  Eeprom(const EepromChip& chip, Bytes image);

  // The levels of both lines, whenever one has changed; `sda` as all others on it leave it.
  void lines(Time now, bool scl, bool sda);
  // The chip pulls SDA low.
  bool sdaLow() const { return sdaLow_; }
  // The last time a line changed.
  Time lastActive() const { return lastActive_; }

  const EepromChip& chip() const { return chip_; }
  const Bytes& contents() const { return data_; }

  // Called when a write has been taken over.
  std::function<void(const Eeprom&)> onWritten;

  static constexpr Time kWriteTime = 5000 * kUs;  // no acknowledge for so long behind a write

 private:
  enum class Phase { deaf, control, address, write, read };

  void start(Time now);
  void stop(Time now);
  void sample(bool bit);
  bool take(uint8_t byte);
  void drive();

  const EepromChip& chip_;
  Bytes data_;
  bool scl_ = true, sda_ = true, sdaLow_ = false;
  Time lastActive_ = 0, busyUntil_ = 0;
  Phase phase_ = Phase::deaf;
  int bit_ = 0;  // bits of this byte clocked so far; the ninth is the acknowledge
  uint8_t shift_ = 0;
  bool acknowledge_ = false;
  bool reading_ = false;  // the chip sends the current byte
  int addressLeft_ = 0;
  size_t address_ = 0;
  Bytes page_;  // what a write will take over, and which bytes of it
  std::vector<bool> written_;
};

#include "core/eeprom.h"

#include <algorithm>
#include <stdexcept>

namespace {
const EepromChip kChips[] = {{"24C16", 2048, 1, 16}, {"24C32", 4096, 2, 32}};
}

const EepromChip* findEepromChip(const std::string& name) {
  for (const EepromChip& c : kChips)
    if (name == c.name) return &c;
  return nullptr;
}

const EepromChip* eepromChipFor(size_t imageBytes) {
  for (const EepromChip& c : kChips)
    if (imageBytes <= c.bytes) return &c;
  return nullptr;
}

Eeprom::Eeprom(const EepromChip& chip, Bytes image)
    : chip_(chip),
      data_(std::move(image)),
      page_(chip.page),
      written_(chip.page) {
  if (data_.size() > chip.bytes) throw std::logic_error("EEPROM image larger than its chip");
  data_.resize(chip.bytes, 0xff);
}

void Eeprom::lines(Time now, bool scl, bool sda) {
  const bool oldScl = scl_, oldSda = sda_;
  scl_ = scl, sda_ = sda;
  if (scl == oldScl && sda == oldSda) return;
  lastActive_ = now;
  if (scl && oldScl) {  // SDA has changed while SCL is high
    // What the chip itself does to SDA is no condition; it changes SDA only while SCL is low.
    if (sda) stop(now);
    else start(now);
  } else if (scl && !oldScl) {
    sample(sda);
  } else if (!scl && oldScl) {
    drive();
  }
}

void Eeprom::start(Time now) {
  bit_ = 0;
  std::fill(written_.begin(), written_.end(), false);
  sdaLow_ = reading_ = false;
  phase_ = now < busyUntil_ ? Phase::deaf : Phase::control;
}

void Eeprom::stop(Time now) {
  // A write counts only if the STOP comes right behind an acknowledge: SCL has risen once more for it.
  if (phase_ == Phase::write && bit_ <= 1 &&
      std::find(written_.begin(), written_.end(), true) != written_.end()) {
    const size_t base = address_ / chip_.page * chip_.page;
    for (size_t i = 0; i < chip_.page; ++i)
      if (written_[i]) data_[base + i] = page_[i];
    busyUntil_ = now + kWriteTime;
    if (onWritten) onWritten(*this);
  }
  phase_ = Phase::deaf;
  sdaLow_ = reading_ = false;
}

// Rising SCL. Bits 0 to 7 are data; at the ninth who sent the byte listens for the acknowledge.
void Eeprom::sample(bool bit) {
  if (phase_ == Phase::deaf) return;
  if (bit_ < 8) {
    if (!reading_) shift_ = static_cast<uint8_t>(shift_ << 1 | bit);
    if (++bit_ == 8 && !reading_) acknowledge_ = take(shift_);
  } else {
    if (reading_ && bit) phase_ = Phase::deaf, reading_ = false;  // the master has enough
    bit_ = 9;
  }
}

// Falling SCL: the chip puts its next bit on SDA, or lets go of it.
void Eeprom::drive() {
  sdaLow_ = false;
  if (phase_ == Phase::deaf) return;
  if (bit_ == 9) {
    bit_ = 0;
    if (phase_ == Phase::read) {
      reading_ = true;
      shift_ = data_[address_];
      address_ = (address_ + 1) % chip_.bytes;
    }
  }
  if (bit_ < 8) {
    if (reading_) sdaLow_ = !(shift_ >> (7 - bit_) & 1);
  } else if (!reading_) {
    sdaLow_ = acknowledge_;
    if (!acknowledge_) phase_ = Phase::deaf;
  }
}

// A byte of the master; false if the chip does not acknowledge it.
bool Eeprom::take(uint8_t byte) {
  switch (phase_) {
    case Phase::control:
      if (byte >> 4 != 0xa) return false;
      if (byte & 1) {
        // The block select bits of a read count too, where the chip has them.
        if (chip_.addressBytes == 1) address_ = (byte >> 1 & 7u) << 8 | (address_ & 0xff);
        else if (byte >> 1 & 7) return false;
        phase_ = Phase::read;
        return true;
      }
      if (chip_.addressBytes == 2 && (byte >> 1 & 7)) return false;  // another chip's address
      address_ = chip_.addressBytes == 1 ? byte >> 1 & 7u : 0;
      addressLeft_ = chip_.addressBytes;
      phase_ = Phase::address;
      return true;
    case Phase::address:
      address_ = (address_ << 8 | byte) % chip_.bytes;
      if (--addressLeft_ == 0) phase_ = Phase::write;
      return true;
    case Phase::write: {
      const size_t at = address_ % chip_.page;
      page_[at] = byte;
      written_[at] = true;
      address_ = address_ - at + (at + 1) % chip_.page;  // wraps within the page
      return true;
    }
    default: return false;
  }
}

// Ethernet frames as bytes and as nibbles.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

using Bytes = std::vector<uint8_t>;

// FCS of an Ethernet frame; over a frame with its FCS it is kCrcResidue.
uint32_t crc32(const uint8_t* data, size_t size);
constexpr uint32_t kCrcResidue = 0x2144df1c;

// CRC-8 of the SII EEPROM's configuration area (SII-01).
uint8_t siiCrc8(const uint8_t* data, size_t size);

// Preamble (15 times 5), SFD, the frame padded to 60 bytes, FCS: what a network card puts on the wire.
std::vector<uint8_t> toNibbles(Bytes frame);

// What lies behind preamble and SFD.
struct Payload {
  bool sfd = false;  // false: no SFD, the rest is void
  int preamble = 0;  // nibbles of 0x5
  Bytes bytes;       // whole bytes
  bool odd = false;  // half a byte more
};
Payload payloadOf(const std::vector<uint8_t>& nibbles);

std::string hex(const Bytes& bytes);
std::string hexNibbles(const std::vector<uint8_t>& nibbles);

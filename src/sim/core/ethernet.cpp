#include "core/ethernet.h"

#include <array>

uint32_t crc32(const uint8_t* data, size_t size) {
  static const auto table = [] {
    std::array<uint32_t, 256> t{};
    for (uint32_t i = 0; i < 256; ++i) {
      uint32_t c = i;
      for (int k = 0; k < 8; ++k) c = c & 1 ? 0xedb88320u ^ (c >> 1) : c >> 1;
      t[i] = c;
    }
    return t;
  }();
  uint32_t c = ~0u;
  for (size_t i = 0; i < size; ++i) c = table[(c ^ data[i]) & 0xff] ^ (c >> 8);
  return ~c;
}

uint8_t siiCrc8(const uint8_t* data, size_t size) {
  unsigned c = 0xff;
  for (size_t i = 0; i < size; ++i) {
    c ^= data[i];
    for (int k = 0; k < 8; ++k) c = c & 0x80 ? (c << 1 ^ 0x07) & 0xff : c << 1;
  }
  return static_cast<uint8_t>(c);
}

std::vector<uint8_t> toNibbles(Bytes frame) {
  if (frame.size() < 60) frame.resize(60);
  const uint32_t fcs = crc32(frame.data(), frame.size());
  for (int i = 0; i < 4; ++i) frame.push_back(fcs >> (8 * i) & 0xff);
  std::vector<uint8_t> nibbles(15, 0x5);
  nibbles.push_back(0xd);
  for (uint8_t b : frame) nibbles.push_back(b & 0xf), nibbles.push_back(b >> 4);
  return nibbles;
}

Payload payloadOf(const std::vector<uint8_t>& nibbles) {
  Payload p;
  size_t i = 0;
  while (i < nibbles.size() && nibbles[i] == 0x5) ++i;
  p.preamble = static_cast<int>(i);
  if (i == nibbles.size() || nibbles[i] != 0xd) return p;
  p.sfd = true;
  for (++i; i + 1 < nibbles.size(); i += 2) p.bytes.push_back(nibbles[i] | nibbles[i + 1] << 4);
  p.odd = i < nibbles.size();
  return p;
}

std::string hex(const Bytes& bytes) {
  static const char digits[] = "0123456789abcdef";
  std::string s;
  for (uint8_t b : bytes) {
    if (!s.empty()) s += ' ';
    s += digits[b >> 4], s += digits[b & 0xf];
  }
  return s;
}

std::string hexNibbles(const std::vector<uint8_t>& nibbles) {
  static const char digits[] = "0123456789abcdef";
  std::string s;
  for (uint8_t n : nibbles) s += digits[n & 0xf];
  return s;
}

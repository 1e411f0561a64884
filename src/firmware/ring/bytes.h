/* Bytes and numbers of several bytes, the highest byte first, as they stand in frames and datagrams. */
#ifndef FLYFRAME_RING_BYTES_H
#define FLYFRAME_RING_BYTES_H

#include <stdbool.h>
#include <stdint.h>

static inline bool any_byte(const uint8_t *bytes, unsigned length) {
  for (unsigned i = 0; i < length; ++i)
    if (bytes[i] != 0) return true;
  return false;
}
static inline bool same_bytes(const uint8_t *a, const uint8_t *b, unsigned length) {
  for (unsigned i = 0; i < length; ++i)
    if (a[i] != b[i]) return false;
  return true;
}
static inline void copy_bytes(uint8_t *to, const uint8_t *from, unsigned length) {
  for (unsigned i = 0; i < length; ++i) to[i] = from[i];
}
static inline void put_number(uint8_t *to, uint32_t number, unsigned bytes) {
  for (unsigned i = 0; i < bytes; ++i) to[i] = (uint8_t)(number >> 8 * (bytes - 1 - i));
}
static inline uint32_t get_number(const uint8_t *from, unsigned bytes) {
  uint32_t number = 0;
  for (unsigned i = 0; i < bytes; ++i) number = number << 8 | from[i];
  return number;
}

/* A bit per address: bit a % 8 of byte a / 8. */
static inline bool bit_of(const uint8_t *map, unsigned i) { return (map[i / 8] >> i % 8 & 1) != 0; }
static inline void set_bit(uint8_t *map, unsigned i) { map[i / 8] = (uint8_t)(map[i / 8] | 1u << i % 8); }
static inline void clear_bit(uint8_t *map, unsigned i) {
  map[i / 8] = (uint8_t)(map[i / 8] & ~(1u << i % 8));
}

#endif

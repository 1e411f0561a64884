#include "frame.h"

uint32_t ring_id_word(const struct ring_id *id) {
  return (id->urgent ? 0 : 1u << 28) | (uint32_t)id->destination << 21 | (id->is_data ? 1u << 20 : 0) |
         (uint32_t)id->source << 13 | (uint32_t)id->number << 5 | (uint32_t)id->pipe << 1 |
         (id->end ? 1u : 0);
}

struct ring_id ring_id_of(uint32_t word) {
  return (struct ring_id){.urgent = (word >> 28 & 1) == 0,
                          .destination = word >> 21 & 0x7f,
                          .is_data = (word >> 20 & 1) != 0,
                          .source = word >> 13 & 0x7f,
                          .number = word >> 5 & 0xff,
                          .pipe = word >> 1 & 0xf,
                          .end = (word & 1) != 0};
}

/* Four bits a step: a table of 64 bytes instead of one of 1,024. */
uint32_t ring_crc32(const uint8_t *bytes, uint16_t length) {
  static const uint32_t table[16] = {0x00000000, 0x1db71064, 0x3b6e20c8, 0x26d930ac, 0x76dc4190, 0x6b6b51f4,
                                     0x4db26158, 0x5005713c, 0xedb88320, 0xf00f9344, 0xd6d6a3e8, 0xcb61b38c,
                                     0x9b64c2b0, 0x86d3d2d4, 0xa00ae278, 0xbdbdf21c};
  uint32_t crc = 0xffffffff;
  for (uint16_t i = 0; i < length; ++i) {
    crc = crc >> 4 ^ table[(crc ^ bytes[i]) & 0xf];
    crc = crc >> 4 ^ table[(crc ^ (uint32_t)bytes[i] >> 4) & 0xf];
  }
  return ~crc;
}

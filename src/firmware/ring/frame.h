/* Frames of the fibre ring's transport: data frames with identifiers of 29 bits. */
#ifndef FLYFRAME_RING_FRAME_H
#define FLYFRAME_RING_FRAME_H

#include <stdbool.h>
#include <stdint.h>

enum { RING_FRAME_BYTES = 8, RING_LAST_ADDRESS = 125, RING_PIPES = 15, RING_PROCESS_DATA = 15 };

struct ring_frame {
  uint32_t id;
  uint8_t dlc; /* 0 to 15; above 8 it stands for eight bytes */
  uint8_t data[RING_FRAME_BYTES];
};

/* The fields of an identifier. */
struct ring_id {
  bool urgent;
  uint8_t destination; /* 0 all, 1 the server or gateway, 2 to 125 nodes */
  bool is_data;        /* else control */
  uint8_t source;
  uint8_t number; /* data: number of the frame in its message; control: the code */
  uint8_t pipe;
  bool end; /* the last frame of a message; always in control frames */
};

/* Codes of control frames. */
enum ring_code {
  RING_OPEN = 0x01,
  RING_SHORT = 0x02,
  RING_CLOSE = 0x03,
  RING_DONE = 0x11,
  RING_MISSING = 0x12,
  RING_BUSY = 0x13,
  RING_UNKNOWN = 0x14,
  RING_HELLO = 0x20
};

/* What a DONE says. */
enum ring_result { RING_DELIVERED, RING_REFUSED, RING_WRONG_CRC };

/* Bit 7 of a life byte: about a message to all. */
enum { RING_LIFE_MASK = 0x7f, RING_TO_ALL = 0x80 };

uint32_t ring_id_word(const struct ring_id *id);
struct ring_id ring_id_of(uint32_t word);

/* The CRC-32 of Ethernet and zlib. */
uint32_t ring_crc32(const uint8_t *bytes, uint16_t length);

#endif

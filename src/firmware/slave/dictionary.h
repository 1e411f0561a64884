/* The object dictionary: a table that the generator writes (NAME.objects.c), and the values behind it. */
#ifndef FLYFRAME_DICTIONARY_H
#define FLYFRAME_DICTIONARY_H

#include <stdbool.h>
#include <stdint.h>

enum { OBJECT_VARIABLE = 7, OBJECT_ARRAY = 8, OBJECT_RECORD = 9 };
enum { TYPE_REAL = 0x08, TYPE_TEXT = 0x09, TYPE_LREAL = 0x11 }; /* data types that are no integers */

/* Access to an entry, as in its SDO description. */
enum {
  ACCESS_READ = 0x07,  /* in PREOP, SAFEOP, OP: a bit each */
  ACCESS_WRITE = 0x38, /* the same */
  ACCESS_RX = 0x40,    /* mappable into RxPDOs */
  ACCESS_TX = 0x80     /* mappable into TxPDOs */
};

/* What may be written to an entry. */
struct object_range {
  int64_t low, high;
};

struct object_entry {
  uint16_t type;   /* data type (ETG.1000.6) */
  uint16_t bits;   /* of the value; 0: there is no such subindex */
  uint16_t access; /* ACCESS_... */
  uint16_t offset; /* of the variable among the values */
  const char *name;
  const struct object_range *range; /* null: the whole type */
};

struct object {
  uint16_t index;
  uint16_t type;
  uint8_t code;    /* OBJECT_... */
  uint8_t highest; /* subindex; `entries` has one more */
  const struct object_entry *entries;
  const char *name;
};

/* Null if there is none. `objects` are in ascending order. */
const struct object *object_find(const struct object *objects, uint16_t count, uint16_t index);
const struct object_entry *entry_of(const struct object *object, uint8_t subindex);

/* Bytes of a value in a message. */
static inline uint16_t entry_bytes(const struct object_entry *entry) {
  return (uint16_t)((entry->bits + 7u) / 8u);
}

/* Little endian bytes out of the variable, and into it. A variable has 1, 2, 4 or 8 bytes, a text its length.
 */
void entry_load(const uint8_t *values, const struct object_entry *entry, uint8_t *bytes);
void entry_store(uint8_t *values, const struct object_entry *entry, const uint8_t *bytes);

/* An SDO abort code if these bytes are no value of the entry; else 0. */
uint32_t entry_check(const struct object_entry *entry, const uint8_t *bytes);

/* `bits` bits at bit `at` of a buffer, as bytes from bit 0 on; and back. Bits above are 0, or left. */
void bits_read(const uint8_t *buffer, uint32_t at, uint16_t bits, uint8_t *bytes);
void bits_write(uint8_t *buffer, uint32_t at, uint16_t bits, const uint8_t *bytes);

#endif

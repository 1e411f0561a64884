#include "dictionary.h"

#include "codes.h"

const struct object *object_find(const struct object *objects, uint16_t count, uint16_t index) {
  uint16_t low = 0, high = count;
  while (low < high) {
    const uint16_t middle = (uint16_t)((low + high) / 2);
    if (objects[middle].index == index) return &objects[middle];
    if (objects[middle].index < index) low = (uint16_t)(middle + 1);
    else high = middle;
  }
  return 0;
}

const struct object_entry *entry_of(const struct object *object, uint8_t subindex) {
  if (subindex > object->highest || object->entries[subindex].bits == 0) return 0;
  return &object->entries[subindex];
}

static uint16_t variable_bytes(const struct object_entry *entry) {
  const uint16_t bytes = entry_bytes(entry);
  if (entry->type == TYPE_TEXT || bytes <= 2) return bytes;
  return bytes <= 4 ? 4 : 8;
}

/* Where byte `i` of a little endian value stands in a variable of this machine. */
static uint16_t place(const struct object_entry *entry, uint16_t i) {
  const uint16_t one = 1;
  const bool little = *(const uint8_t *)&one == 1;
  if (little || entry->type == TYPE_TEXT) return (uint16_t)(entry->offset + i);
  return (uint16_t)(entry->offset + variable_bytes(entry) - 1 - i);
}

void entry_load(const uint8_t *values, const struct object_entry *entry, uint8_t *bytes) {
  for (uint16_t i = 0; i < entry_bytes(entry); ++i) bytes[i] = values[place(entry, i)];
}

/* A negative number of fewer bits than its variable does not occur: such types have no sign. */
void entry_store(uint8_t *values, const struct object_entry *entry, const uint8_t *bytes) {
  for (uint16_t i = 0; i < variable_bytes(entry); ++i)
    values[place(entry, i)] = i < entry_bytes(entry) ? bytes[i] : 0;
}

static bool is_signed(uint16_t type) { return (type >= 0x02 && type <= 0x04) || type == 0x15; }

uint32_t entry_check(const struct object_entry *entry, const uint8_t *bytes) {
  if (entry->type == TYPE_TEXT || entry->type == TYPE_REAL || entry->type == TYPE_LREAL) return 0;
  uint64_t value = 0;
  for (uint16_t i = entry_bytes(entry); i-- > 0;) value = value << 8 | bytes[i];
  if (entry->bits < 64 && value >> entry->bits != 0) return SDO_TOO_HIGH;
  if (!entry->range) return 0;
  const uint64_t sign = (uint64_t)1 << (entry->bits - 1);
  if (is_signed(entry->type)) {
    /* Shifted by half of the type's numbers, so that unsigned numbers are in order. */
    const uint64_t mask = sign | (sign - 1);
    const uint64_t shifted = value ^ sign;
    if (shifted < (((uint64_t)entry->range->low & mask) ^ sign)) return SDO_TOO_LOW;
    return shifted > (((uint64_t)entry->range->high & mask) ^ sign) ? SDO_TOO_HIGH : 0;
  }
  if (value < (uint64_t)entry->range->low) return SDO_TOO_LOW;
  return value > (uint64_t)entry->range->high ? SDO_TOO_HIGH : 0;
}

void bits_read(const uint8_t *buffer, uint32_t at, uint16_t bits, uint8_t *bytes) {
  for (uint16_t i = 0; i < (bits + 7u) / 8u; ++i) bytes[i] = 0;
  for (uint16_t i = 0; i < bits;) {
    const uint32_t from = at + i;
    if (from % 8 == 0 && i % 8 == 0 && bits - i >= 8) {
      bytes[i / 8] = buffer[from / 8];
      i = (uint16_t)(i + 8);
    } else {
      bytes[i / 8] |= (uint8_t)((buffer[from / 8] >> from % 8 & 1u) << i % 8);
      ++i;
    }
  }
}

void bits_write(uint8_t *buffer, uint32_t at, uint16_t bits, const uint8_t *bytes) {
  for (uint16_t i = 0; i < bits;) {
    const uint32_t to = at + i;
    if (to % 8 == 0 && i % 8 == 0 && bits - i >= 8) {
      buffer[to / 8] = bytes[i / 8];
      i = (uint16_t)(i + 8);
    } else {
      const unsigned bit = 1u << to % 8, value = bytes[i / 8] >> i % 8 & 1 ? bit : 0u;
      buffer[to / 8] = (uint8_t)((buffer[to / 8] & ~bit) | value);
      ++i;
    }
  }
}

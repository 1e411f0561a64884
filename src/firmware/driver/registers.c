#include "registers.h"

uint32_t number_at(const uint8_t *bytes, uint8_t length) {
  uint32_t number = 0;
  for (uint8_t i = length; i-- > 0;) number = number << 8 | bytes[i];
  return number;
}

void number_to(uint8_t *bytes, uint8_t length, uint32_t number) {
  for (uint8_t i = 0; i < length; ++i) bytes[i] = (uint8_t)(number >> (8 * i));
}

uint32_t read_number(struct board *board, uint16_t address, uint8_t length) {
  uint8_t bytes[4] = {0, 0, 0, 0};
  board_read(board, address, bytes, length);
  return number_at(bytes, length);
}

void write_number(struct board *board, uint16_t address, uint8_t length, uint32_t number) {
  uint8_t bytes[4];
  number_to(bytes, 4, number);
  board_write(board, address, bytes, length);
}

bool write_holds(struct board *board, uint16_t address, const uint8_t *data, uint8_t length) {
  board_write(board, address, data, length);
  for (uint8_t i = 0; i < length; ++i)
    if (read_number(board, (uint16_t)(address + i), 1) != data[i]) return false;
  return true;
}

bool number_holds(struct board *board, uint16_t address, uint8_t length, uint32_t number) {
  uint8_t bytes[4];
  number_to(bytes, 4, number);
  return write_holds(board, address, bytes, length);
}

bool memory_holds(struct board *board, uint16_t address, uint16_t length) {
  static const uint8_t inverted[] = {0x00, 0xff};
  for (int pass = 0; pass < 2; ++pass) {
    /* All written before any is read: two places that are one would show. 37 is odd: no two of 256 bytes are
     * equal. */
    for (uint16_t i = 0; i < length; ++i)
      write_number(board, (uint16_t)(address + i), 1, (uint8_t)((37u * i + 1) ^ inverted[pass]));
    for (uint16_t i = 0; i < length; ++i)
      if (read_number(board, (uint16_t)(address + i), 1) != (uint8_t)((37u * i + 1) ^ inverted[pass]))
        return false;
  }
  for (uint16_t i = 0; i < length; ++i) write_number(board, (uint16_t)(address + i), 1, 0);
  return true;
}

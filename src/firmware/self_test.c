#include "self_test.h"

static const char *const texts[SELF_TEST_CODES] = {
    "The self-test has not been run.",
    "The self-test is good.",
    "No controller answers, or another one than this program is for.",
    "A register or the RAM of the controller does not hold what was written.",
    "The non-volatile memory does not work.",
    "The source of random numbers does not work.",
    "The node ID is 0, 0xFFFF, or wider than the controller holds.",
    "The debounce time is above 655,350 us.",
    "The off time is 0.",
    "The master ID is 0.",
    "A MAC address is all zero or a group address.",
    "An IP address is none of a single station.",
    "A UDP port is 0.",
    "The bus cycle is not 10 to 41,943 us.",
    "The answer time-out is not 10 to 2,621 us.",
    "There are more than 15 retries.",
    "Repetition or heartbeat of reports is not 1 to 4,095 ms.",
    "The key is all zero.",
    "The heartbeat's promise is below 10 ms.",
    "The server's time-out is 0.",
    "There are too many places, a node ID among them is none, or stands twice.",
    "The display has not 2 to 4 lines of 20 to 40 columns.",
};

const char *self_test_text(enum self_test result) {
  return (unsigned)result < SELF_TEST_CODES ? texts[result] : "The self-test failed for an unknown reason.";
}

enum self_test worse(enum self_test first, enum self_test second) {
  return first == SELF_TEST_GOOD ? second : first;
}

uint32_t read_number(struct board *board, uint16_t address, uint8_t length) {
  uint8_t bytes[4] = {0, 0, 0, 0};
  board_read(board, address, bytes, length);
  return bytes[0] | (uint32_t)bytes[1] << 8 | (uint32_t)bytes[2] << 16 | (uint32_t)bytes[3] << 24;
}

static void to_bytes(uint8_t bytes[4], uint32_t number) {
  for (int i = 0; i < 4; ++i) bytes[i] = (uint8_t)(number >> (8 * i));
}

void write_number(struct board *board, uint16_t address, uint8_t length, uint32_t number) {
  uint8_t bytes[4];
  to_bytes(bytes, number);
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
  to_bytes(bytes, number);
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

bool is_zero(const uint8_t *bytes, uint16_t count) {
  uint8_t all = 0;
  for (uint16_t i = 0; i < count; ++i) all |= bytes[i];
  return all == 0;
}

#include "start_number.h"

enum { TRIES = 16 }; /* each misses with 1/128 at most */

static bool is_new(uint32_t number, uint32_t mask, uint32_t before) {
  return (number & mask) != 0 && (number & mask) != before;
}

bool start_number(struct board *board, uint32_t mask, uint32_t before, uint32_t *number) {
  uint32_t stored = 0, kept = 0;
  uint8_t random[4];
  if (board_load(board, &stored)) {
    uint32_t next = stored + 1;
    while (!is_new(next, mask, before)) ++next;
    if (board_store(board, next) && board_load(board, &kept) && kept == next) {
      *number = next & mask;
      return true;
    }
  }
  /* A memory that does not work may still give the number of the last start. */
  const uint32_t last = stored & mask;
  *number = before + 1;
  while (!is_new(*number, mask, before) || (*number & mask) == last) ++*number;
  for (int i = 0; i < TRIES && board_random(board, random, sizeof random); ++i) {
    const uint32_t drawn =
        random[0] | (uint32_t)random[1] << 8 | (uint32_t)random[2] << 16 | (uint32_t)random[3] << 24;
    if (!is_new(drawn, mask, before) || (drawn & mask) == last) continue;
    *number = drawn;
    break;
  }
  *number &= mask;
  return false;
}

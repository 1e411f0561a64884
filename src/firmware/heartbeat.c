#include "heartbeat.h"

#include "self_test.h"

uint16_t heartbeat(struct board *board, uint16_t address, uint16_t promise_ms) {
  const uint16_t left = (uint16_t)read_number(board, address, 2);
  if (left == promise_ms) return 0;
  write_number(board, address, 2, promise_ms);
  /* More than was promised is none of this program's promises. */
  return left < promise_ms ? (uint16_t)(promise_ms - left) : 0;
}

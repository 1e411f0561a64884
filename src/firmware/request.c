#include "request.h"

#include "alarm-master.h"
#include "self_test.h"

enum { WAIT_US = 20 }; /* between two looks */

/* Waits until (status & mask) == value; false if that takes longer than `us`. Waiting may return at once, and
 * the controller's time may stand still, so looks count too. */
static bool wait_for(struct board *board, uint8_t mask, uint8_t value, uint32_t us) {
  const uint32_t begin = read_number(board, MASTER_MASTER_TIME, 4);
  for (uint32_t looks = 0; looks <= us; ++looks) {
    if ((read_number(board, MASTER_MASTER_STATUS, 1) & mask) == value) return true;
    if (read_number(board, MASTER_MASTER_TIME, 4) - begin > us) return false;
    board_wait(board, WAIT_US);
  }
  return false;
}

bool request_is_free(struct board *board, uint32_t limit_us) {
  return wait_for(board, MASTER_REQUEST_BUSY_MASK, 0, limit_us);
}

enum request_end request(struct board *board, struct request *r, uint32_t limit_us) {
  if (!request_is_free(board, limit_us)) return REQUEST_HUNG;
  write_number(board, MASTER_REQUEST_COMMAND, 1, r->command);
  write_number(board, MASTER_REQUEST_LENGTH, 1, r->length);
  write_number(board, MASTER_REQUEST_ADDRESS, 4, r->adp | (uint32_t)r->ado << 16);
  board_write(board, MASTER_REQUEST_DATA, r->data, r->length);
  write_number(board, MASTER_REQUEST_CONTROL, 1, MASTER_REQUEST_GO_MASK);
  if (!wait_for(board, MASTER_REQUEST_DONE_MASK, MASTER_REQUEST_DONE_MASK, limit_us)) return REQUEST_HUNG;
  r->counter = (uint16_t)read_number(board, MASTER_REQUEST_COUNTER, 2);
  board_read(board, MASTER_REQUEST_RESULT, r->data, r->length);
  return read_number(board, MASTER_REQUEST_ANSWERED, 1) != 0 ? REQUEST_BACK : REQUEST_LOST;
}

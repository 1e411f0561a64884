#include "alarm_slave.h"

#include "alarm-slave.h"
#include "driver/controller.h"
#include "heartbeat.h"
#include "start_number.h"

enum {
  TYPE = 0xf1,
  USER_RAM_BYTES = 128,
  POLL_US = 1000,
  PATIENCE_MS = 1000 /* that the supply may be off for longer than a reset of the detector takes */
};

static bool is_there(struct board *board) {
  return read_number(board, ESC_ESC_TYPE, 1) == TYPE &&
         read_number(board, ESC_RAM_SIZE, 1) == ESC_PROCESS_RAM_BYTES / 1024;
}

/* Each parameter that is one goes to the controller; the result tells of the first that is none. */
static enum self_test write_parameters(struct board *board, const struct alarm_slave_parameters *p) {
  enum self_test result = SELF_TEST_GOOD;
  if (p->node_id == 0 || p->node_id == PROTOCOL_ALL_NODES ||
      !number_holds(board, ESC_STATION_ALIAS, 2, p->node_id))
    result = worse(result, SELF_TEST_NODE_ID);
  if (p->debounce_us > 655350) result = worse(result, SELF_TEST_DEBOUNCE);
  else if (!number_holds(board, ESC_DETECTOR_DEBOUNCE, 2, p->debounce_us / 10))
    result = worse(result, SELF_TEST_MEMORY);
  if (p->off_time_ms == 0) result = worse(result, SELF_TEST_OFF_TIME);
  else if (!number_holds(board, ESC_DETECTOR_OFF_TIME, 2, p->off_time_ms))
    result = worse(result, SELF_TEST_MEMORY);
  if (p->alive_ms < HEARTBEAT_LEAST_MS) result = worse(result, SELF_TEST_ALIVE);
  return result;
}

/* Another epoch after each start, so that the server can tell the events of two starts apart. */
static enum self_test begin_epoch(struct alarm_slave *slave) {
  struct board *board = slave->board;
  uint32_t epoch;
  const bool stored = start_number(board, 0xff, read_number(board, ESC_ALARM_EPOCH, 1), &epoch);
  slave->epoch = (uint8_t)epoch;
  slave->marked = number_holds(board, ESC_ALARM_EPOCH, 1, epoch);
  if (!slave->marked) return SELF_TEST_MEMORY;
  return stored ? SELF_TEST_GOOD : SELF_TEST_STORE;
}

/* Reads a message to `last` if there is one; whether there is. Where events are acknowledged by write one
 * that has come between reading and that write is told by its difference only. */
static bool take(struct alarm_slave *slave, uint16_t address, uint8_t *last, bool told) {
  uint8_t message[ALARM_MESSAGE_BYTES];
  if (!told && !slave->by_write) return false;
  board_read(slave->board, address, message, sizeof message);
  for (int i = 0; i < ALARM_MESSAGE_BYTES; ++i) {
    told = told || last[i] != message[i];
    last[i] = message[i];
  }
  return told;
}

enum self_test alarm_slave_start(struct alarm_slave *slave, struct board *board,
                                 const struct alarm_slave_parameters *parameters) {
  *slave = (struct alarm_slave){.board = board, .parameters = *parameters};
  /* Of an unknown controller nothing is written. */
  if (!is_there(board)) return slave->self_test = SELF_TEST_CONTROLLER;
  slave->by_write = acknowledges_by_write(board);
  take(slave, ESC_ALARM_BROADCAST, slave->last_broadcast, false); /* of before this start */
  take(slave, ESC_ALARM_MESSAGE, slave->last_message, false);
  /* Before anything that takes time; a detector that is on stays on. */
  write_number(board, ESC_ALARM_ENABLE, 1, ESC_DETECTOR_ENABLE_MASK);
  enum self_test result =
      memory_holds(board, ESC_USER_RAM, USER_RAM_BYTES) ? SELF_TEST_GOOD : SELF_TEST_MEMORY;
  result = worse(result, write_parameters(board, parameters));
  result = worse(result, begin_epoch(slave));
  if (read_number(board, ESC_ALARM_ENABLE, 1) != ESC_DETECTOR_ENABLE_MASK)
    result = worse(result, SELF_TEST_MEMORY);
  slave->self_test = result;
  /* The master takes a slave for well when its self-test is: everything else must be there before. */
  slave->marked = number_holds(board, ESC_SELF_TEST, 1, result) && slave->marked;
  if (slave->parameters.alive_ms < HEARTBEAT_LEAST_MS) slave->parameters.alive_ms = HEARTBEAT_LEAST_MS;
  heartbeat(board, ESC_HOST_ALIVE, slave->parameters.alive_ms);
  return result;
}

static void start_again(struct alarm_slave *slave) {
  const enum self_test before = slave->self_test;
  const struct alarm_slave_parameters parameters = slave->parameters;
  alarm_slave_start(slave, slave->board, &parameters);
  if (slave->self_test != before) board_notice(slave->board, self_test_text(slave->self_test));
}

static void take_messages(struct alarm_slave *slave) {
  /* Reading it ends the interrupt; a message that comes from now on makes another one. */
  const uint32_t received = read_number(slave->board, ESC_ALARM_MESSAGES, 1);
  if (received == 0) return;
  if (slave->by_write) write_number(slave->board, ESC_ALARM_MESSAGES, 1, 0);
  slave->broadcasts +=
      take(slave, ESC_ALARM_BROADCAST, slave->last_broadcast, received & ESC_BROADCAST_RECEIVED_MASK);
  slave->messages +=
      take(slave, ESC_ALARM_MESSAGE, slave->last_message, received & ESC_MESSAGE_RECEIVED_MASK);
}

/* The detector has its supply, or has been without no longer than a reset takes. */
static bool detector_goes_on(struct alarm_slave *slave, uint16_t passed_ms) {
  if (read_number(slave->board, ESC_ALARM_ENABLE, 1) != ESC_DETECTOR_ENABLE_MASK)
    write_number(slave->board, ESC_ALARM_ENABLE, 1, ESC_DETECTOR_ENABLE_MASK);
  const uint32_t limit = (uint32_t)slave->parameters.off_time_ms + PATIENCE_MS;
  if (!(alarm_slave_status(slave) & PROTOCOL_SLAVE_UNWATCHED)) slave->unwatched_ms = 0;
  else if (slave->unwatched_ms <= limit) slave->unwatched_ms += passed_ms;
  return slave->unwatched_ms <= limit;
}

void alarm_slave_serve(struct alarm_slave *slave) {
  struct board *board = slave->board;
  board_wait(board, POLL_US);
  const bool was_reset =
      slave->marked && (read_number(board, ESC_SELF_TEST, 1) != (uint32_t)slave->self_test ||
                        read_number(board, ESC_ALARM_EPOCH, 1) != slave->epoch);
  if (slave->self_test == SELF_TEST_CONTROLLER || was_reset || !is_there(board)) {
    start_again(slave);
    return;
  }
  const uint16_t passed_ms = heartbeat(board, ESC_HOST_ALIVE, slave->parameters.alive_ms);
  take_messages(slave);
  if (detector_goes_on(slave, passed_ms) && passed_ms > 0) board_watchdog(board);
}

uint16_t alarm_slave_status(struct alarm_slave *slave) {
  return (uint16_t)read_number(slave->board, ESC_SLAVE_STATE + PROTOCOL_SLAVE_STATE_STATUS_AT,
                               PROTOCOL_SLAVE_STATE_STATUS_BYTES);
}

void alarm_slave_run(struct alarm_slave *slave, struct board *board,
                     const struct alarm_slave_parameters *parameters) {
  if (alarm_slave_start(slave, board, parameters) != SELF_TEST_GOOD)
    board_notice(board, self_test_text(slave->self_test));
  for (;;) alarm_slave_serve(slave);
}

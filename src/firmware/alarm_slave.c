#include "alarm_slave.h"

#include "alarm-slave.h"

enum {
  TYPE = 0xf1,
  USER_RAM_BYTES = 128,
  POLL_US = 1000,
  ENABLE = ESC_DETECTOR_ENABLE_MASK | ESC_ALARM_REPORT_MASK
};

static enum self_test check(const struct alarm_slave_parameters *p) {
  if (p->node_id == 0 || p->node_id == PROTOCOL_ALL_NODES) return SELF_TEST_NODE_ID;
  if (p->debounce_us > 655350) return SELF_TEST_DEBOUNCE;
  if (p->off_time_ms == 0) return SELF_TEST_OFF_TIME;
  return SELF_TEST_GOOD;
}

static enum self_test set_up(struct alarm_slave *slave) {
  struct board *board = slave->board;
  const struct alarm_slave_parameters *p = &slave->parameters;
  uint32_t starts;

  if (!memory_holds(board, ESC_USER_RAM, USER_RAM_BYTES)) return SELF_TEST_MEMORY;
  const enum self_test parameters = check(p);
  if (parameters != SELF_TEST_GOOD) return parameters;

  /* Another epoch after each start, as events are counted anew; stored before it is used. */
  if (!board_load(board, &starts) || !board_store(board, starts + 1)) return SELF_TEST_STORE;
  slave->epoch = (uint8_t)(starts + 1);

  if (!number_holds(board, ESC_STATION_ALIAS, 2, p->node_id)) return SELF_TEST_NODE_ID;
  if (!number_holds(board, ESC_ALARM_EPOCH, 1, slave->epoch) ||
      !number_holds(board, ESC_DETECTOR_DEBOUNCE, 2, p->debounce_us / 10) ||
      !number_holds(board, ESC_DETECTOR_OFF_TIME, 2, p->off_time_ms))
    return SELF_TEST_MEMORY;
  return SELF_TEST_GOOD;
}

enum self_test alarm_slave_start(struct alarm_slave *slave, struct board *board,
                                 const struct alarm_slave_parameters *parameters) {
  *slave = (struct alarm_slave){.board = board, .parameters = *parameters};
  /* Of an unknown controller nothing is written. */
  if (read_number(board, ESC_ESC_TYPE, 1) != TYPE ||
      read_number(board, ESC_RAM_SIZE, 1) != ESC_PROCESS_RAM_BYTES / 1024)
    return slave->self_test = SELF_TEST_CONTROLLER;
  write_number(board, ESC_ALARM_ENABLE, 1, 0);
  slave->self_test = set_up(slave);
  /* The master lists a slave when its self-test has a result: everything else it asks for must be there
   * before. */
  write_number(board, ESC_SELF_TEST, 1, slave->self_test);
  if (slave->self_test == SELF_TEST_GOOD) write_number(board, ESC_ALARM_ENABLE, 1, ENABLE);
  return slave->self_test;
}

void alarm_slave_serve(struct alarm_slave *slave) {
  board_wait(slave->board, POLL_US);
  if (read_number(slave->board, ESC_ALARM_ENABLE, 1) != ENABLE) {
    const struct alarm_slave_parameters parameters = slave->parameters;
    if (alarm_slave_start(slave, slave->board, &parameters) != SELF_TEST_GOOD)
      board_fatal(slave->board, self_test_text(slave->self_test));
    return;
  }
  /* Reading it ends the interrupt; a message that comes from now on makes another one. */
  const uint32_t received = read_number(slave->board, ESC_ALARM_MESSAGES, 1);
  if (received & ESC_BROADCAST_RECEIVED_MASK) {
    board_read(slave->board, ESC_ALARM_BROADCAST, slave->last_broadcast, ALARM_MESSAGE_BYTES);
    ++slave->broadcasts;
  }
  if (received & ESC_MESSAGE_RECEIVED_MASK) {
    board_read(slave->board, ESC_ALARM_MESSAGE, slave->last_message, ALARM_MESSAGE_BYTES);
    ++slave->messages;
  }
}

struct alarm_slave_status alarm_slave_status(struct alarm_slave *slave) {
  const uint32_t bits = read_number(slave->board, ESC_ALARM_STATUS, 2);
  struct alarm_slave_status status;
  status.events = (uint8_t)((bits & ESC_ALARM_EVENTS_MASK) >> ESC_ALARM_EVENTS_SHIFT);
  status.detector = (uint8_t)((bits & ESC_DETECTOR_STATE_MASK) >> ESC_DETECTOR_STATE_SHIFT);
  status.supply = (bits & ESC_DETECTOR_SUPPLY_MASK) != 0;
  status.latched = (bits & ESC_ALARM_LATCHED_MASK) != 0;
  return status;
}

void alarm_slave_run(struct alarm_slave *slave, struct board *board,
                     const struct alarm_slave_parameters *parameters) {
  if (alarm_slave_start(slave, board, parameters) != SELF_TEST_GOOD)
    board_fatal(board, self_test_text(slave->self_test));
  for (;;) alarm_slave_serve(slave);
}

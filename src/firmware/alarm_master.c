#include "alarm_master.h"

#include "alarm-master.h"
#include "alarm-slave.h"

enum {
  TYPE = 0xf2,
  SLOTS_PER_US = 25,
  POLL_US = 1000,
  WAIT_US = 20,     /* between two looks at a request */
  SPARE_US = 50000, /* for whatever else the line is busy with */
  LONGEST_FRAME_US = 125,
  ATTEMPTS = 3, /* of a request, besides the retries of its frame */
  RUN = MASTER_LINE_RUN_MASK | MASTER_REPORT_RUN_MASK
};

/* --- start --- */

static bool is_zero(const uint8_t *bytes, int count) {
  uint8_t all = 0;
  for (int i = 0; i < count; ++i) all |= bytes[i];
  return all == 0;
}

static bool is_station_mac(const uint8_t *mac) { return !is_zero(mac, 6) && (mac[0] & 1) == 0; }
static bool is_station_ip(const uint8_t *ip) { return ip[0] != 0 && ip[0] < 224; }
static bool within(uint32_t number, uint32_t least, uint32_t most) {
  return number >= least && number <= most;
}

static enum self_test check(const struct alarm_master_parameters *p) {
  if (p->master_id == 0) return SELF_TEST_MASTER_ID;
  if (!is_station_mac(p->master_mac) || !is_station_mac(p->server_mac)) return SELF_TEST_MAC;
  if (!is_station_ip(p->master_ip) || !is_station_ip(p->server_ip)) return SELF_TEST_IP;
  if (p->master_port == 0 || p->server_port == 0) return SELF_TEST_PORT;
  if (!within(p->bus_cycle_us, 10, 41943)) return SELF_TEST_BUS_CYCLE;
  if (!within(p->answer_timeout_us, 10, 2621)) return SELF_TEST_TIMEOUT;
  if (p->retries > 15) return SELF_TEST_RETRIES;
  if (!within(p->report_repeat_ms, 1, 4095) || !within(p->report_heartbeat_ms, 1, 4095))
    return SELF_TEST_REPORT;
  if (is_zero(p->key, PROTOCOL_KEY_BYTES)) return SELF_TEST_KEY;
  return SELF_TEST_GOOD;
}

/* A port stands in its register as on the wire. */
static bool port_holds(struct board *board, uint16_t address, uint16_t port) {
  const uint8_t bytes[2] = {(uint8_t)(port >> 8), (uint8_t)port};
  return write_holds(board, address, bytes, sizeof bytes);
}

static bool write_parameters(struct board *board, const struct alarm_master_parameters *p, uint16_t boot) {
  return number_holds(board, MASTER_MASTER_ID, 2, p->master_id) &&
         number_holds(board, MASTER_BOOT_NUMBER, 2, boot) &&
         port_holds(board, MASTER_MASTER_PORT, p->master_port) &&
         port_holds(board, MASTER_SERVER_PORT, p->server_port) &&
         write_holds(board, MASTER_MASTER_MAC, p->master_mac, 6) &&
         write_holds(board, MASTER_SERVER_MAC, p->server_mac, 6) &&
         write_holds(board, MASTER_MASTER_IP, p->master_ip, 4) &&
         write_holds(board, MASTER_SERVER_IP, p->server_ip, 4) &&
         number_holds(board, MASTER_BUS_CYCLE, 4, p->bus_cycle_us * SLOTS_PER_US) &&
         number_holds(board, MASTER_ANSWER_TIMEOUT, 2, (uint32_t)p->answer_timeout_us * SLOTS_PER_US) &&
         number_holds(board, MASTER_RETRIES, 1, p->retries) &&
         number_holds(board, MASTER_REPORT_REPEAT, 2, p->report_repeat_ms) &&
         number_holds(board, MASTER_REPORT_HEARTBEAT, 2, p->report_heartbeat_ms);
}

static enum self_test set_up(struct alarm_master *master) {
  struct board *board = master->board;
  uint32_t boots;

  if (!memory_holds(board, MASTER_REQUEST_DATA, 8) ||
      !memory_holds(board, MASTER_HOST_EVENT, PROTOCOL_HOST_EVENT_BYTES))
    return SELF_TEST_MEMORY;
  const enum self_test parameters = check(&master->parameters);
  if (parameters != SELF_TEST_GOOD) return parameters;

  /* A boot number that came back would let old commands in: it is stored before it is used, and never begins
   * anew by itself. */
  if (!board_load(board, &boots)) return SELF_TEST_STORE;
  if (boots >= 0xffff) return SELF_TEST_BOOTS_USED_UP;
  uint32_t stored = 0;
  if (!board_store(board, boots + 1) || !board_load(board, &stored) || stored != boots + 1)
    return SELF_TEST_STORE;
  master->boot = (uint16_t)stored;
  return write_parameters(board, &master->parameters, master->boot) ? SELF_TEST_GOOD : SELF_TEST_MEMORY;
}

enum self_test alarm_master_start(struct alarm_master *master, struct board *board,
                                  const struct alarm_master_parameters *parameters) {
  *master = (struct alarm_master){.board = board, .parameters = *parameters};
  /* Of an unknown controller nothing is written. */
  if (read_number(board, MASTER_MASTER_TYPE, 1) != TYPE) return master->self_test = SELF_TEST_CONTROLLER;
  write_number(board, MASTER_MASTER_CONTROL, 1, 0);
  master->self_test = set_up(master);
  master->filter.key = master->parameters.key;
  master->filter.master_id = parameters->master_id;
  master->filter.boot = master->boot;
  write_number(board, MASTER_MASTER_SELF_TEST, 1, master->self_test);
  if (master->self_test == SELF_TEST_GOOD) write_number(board, MASTER_MASTER_CONTROL, 1, RUN);
  return master->self_test;
}

/* --- commands --- */

/* Waits until (status & mask) == value; false if that takes longer than `us`. Waiting may return at once, so
 * looks count too. */
static bool wait_for(struct alarm_master *master, uint8_t mask, uint8_t value, uint32_t us) {
  const uint32_t begin = read_number(master->board, MASTER_MASTER_TIME, 4);
  for (uint32_t looks = 0; looks <= us; ++looks) {
    if ((read_number(master->board, MASTER_MASTER_STATUS, 1) & mask) == value) return true;
    if (read_number(master->board, MASTER_MASTER_TIME, 4) - begin > us) return false;
    board_wait(master->board, WAIT_US);
  }
  return false;
}

/* Longer than a request may take. */
static uint32_t request_limit(const struct alarm_master_parameters *p) {
  return 2 * p->bus_cycle_us + (p->retries + 2u) * ((uint32_t)p->answer_timeout_us + LONGEST_FRAME_US) +
         SPARE_US;
}

/* One datagram, once: false if no answer came; else its working counter. */
static bool ask(struct alarm_master *master, uint8_t command, uint16_t adp, uint16_t ado, const uint8_t *data,
                uint8_t length, uint16_t *counter) {
  struct board *board = master->board;
  const uint32_t limit = request_limit(&master->parameters);
  if (!wait_for(master, MASTER_REQUEST_BUSY_MASK, 0, limit)) return false;
  write_number(board, MASTER_REQUEST_COMMAND, 1, command);
  write_number(board, MASTER_REQUEST_LENGTH, 1, length);
  write_number(board, MASTER_REQUEST_ADDRESS, 4, adp | (uint32_t)ado << 16);
  board_write(board, MASTER_REQUEST_DATA, data, length);
  write_number(board, MASTER_REQUEST_CONTROL, 1, MASTER_REQUEST_GO_MASK);
  if (!wait_for(master, MASTER_REQUEST_DONE_MASK, MASTER_REQUEST_DONE_MASK, limit)) return false;
  *counter = (uint16_t)read_number(board, MASTER_REQUEST_COUNTER, 2);
  return read_number(board, MASTER_REQUEST_ANSWERED, 1) != 0;
}

/* A write to one node, or to all: then all that are present must have taken it. */
static enum protocol_result write_nodes(struct alarm_master *master, uint16_t node, uint16_t ado,
                                        const uint8_t *data, uint8_t length) {
  const bool all = node == PROTOCOL_ALL_NODES;
  enum protocol_result result = PROTOCOL_RESULT_NO_ANSWER;
  for (int attempt = 0; attempt < ATTEMPTS; ++attempt) {
    const uint32_t present = read_number(master->board, MASTER_SLAVES_PRESENT, 1);
    uint16_t counter = 0;
    if (!ask(master, (uint8_t)(all ? PROTOCOL_ECAT_BWR : PROTOCOL_ECAT_FPWR), all ? 0 : node, ado, data,
             length, &counter))
      continue;
    if (counter > 0 && (!all || counter >= present)) return PROTOCOL_RESULT_DONE;
    result = all ? PROTOCOL_RESULT_NO_ANSWER : PROTOCOL_RESULT_NO_SUCH_NODE;
  }
  return result;
}

static enum protocol_result execute(struct alarm_master *master, const struct command *command) {
  const bool all = command->node == PROTOCOL_ALL_NODES;
  const uint8_t message[8] = {command->order, 0, 0, 0, 0, 0, 0, 0};
  uint8_t bits;
  switch (command->order) {
    case PROTOCOL_ALARM_CLEAR: bits = ESC_ALARM_CLEAR_MASK; break;
    case PROTOCOL_DETECTOR_RESET: bits = ESC_DETECTOR_RESTART_MASK; break;
    default: return PROTOCOL_RESULT_UNKNOWN_COMMAND;
  }
  /* 0 is the station address of slaves that have none: a write to it would reach them all. */
  if (command->node == 0) return PROTOCOL_RESULT_NO_SUCH_NODE;
  /* The master before the slaves: an alarm that comes meanwhile switches its signals on again. */
  if (command->order == PROTOCOL_ALARM_CLEAR)
    write_number(master->board, MASTER_MASTER_CONTROL, 1, RUN | MASTER_BUZZER_OFF_MASK);
  const enum protocol_result result = write_nodes(master, command->node, ESC_ALARM_COMMAND, &bits, 1);
  if (result != PROTOCOL_RESULT_DONE) return result;
  return write_nodes(master, command->node, all ? ESC_ALARM_BROADCAST : ESC_ALARM_MESSAGE, message,
                     sizeof message);
}

/* The server is told how a command ended, among the events. */
static void tell(struct alarm_master *master, const struct command *command, enum protocol_result result) {
  const uint8_t event[PROTOCOL_HOST_EVENT_BYTES] = {
      [PROTOCOL_HOST_EVENT_POSITION_AT] = command->order,
      [PROTOCOL_HOST_EVENT_STATE_AT] = (uint8_t)result,
      [PROTOCOL_HOST_EVENT_NODE_AT] = (uint8_t)command->node,
      [PROTOCOL_HOST_EVENT_NODE_AT + 1] = (uint8_t)(command->node >> 8),
      [PROTOCOL_HOST_EVENT_SEQUENCE_AT] = (uint8_t)command->counter,
      [PROTOCOL_HOST_EVENT_SEQUENCE_AT + 1] = (uint8_t)(command->counter >> 8)};
  if (!wait_for(master, MASTER_HOST_EVENT_BUSY_MASK, 0, request_limit(&master->parameters))) {
    ++master->untold;
    return;
  }
  board_write(master->board, MASTER_HOST_EVENT, event, sizeof event);
  write_number(master->board, MASTER_HOST_EVENT_CONTROL, 1, MASTER_HOST_EVENT_GO_MASK);
}

static void take_message(struct alarm_master *master) {
  uint8_t message[PROTOCOL_COMMAND_BYTES];
  struct command command;
  const uint16_t length = (uint16_t)read_number(master->board, MASTER_MAILBOX_LENGTH, 2);
  write_number(master->board, MASTER_MAILBOX_OFFSET, 1, 0);
  for (uint16_t i = 0; i < PROTOCOL_COMMAND_BYTES; ++i)
    message[i] = i < length ? (uint8_t)read_number(master->board, MASTER_MAILBOX_DATA, 1) : 0;
  /* From here on the next one can come. */
  write_number(master->board, MASTER_MAILBOX_CONTROL, 1, MASTER_MAILBOX_DONE_MASK);
  switch (command_check(&master->filter, message, length, &command)) {
    case COMMAND_ACCEPTED:
      ++master->accepted;
      tell(master, &command, execute(master, &command));
      break;
    case COMMAND_MALFORMED: ++master->malformed; break;
    case COMMAND_FORGED: ++master->forged; break;
    case COMMAND_REPLAYED: ++master->replayed; break;
  }
}

void alarm_master_serve(struct alarm_master *master) {
  board_wait(master->board, POLL_US);
  if ((read_number(master->board, MASTER_MASTER_CONTROL, 1) & RUN) != RUN) {
    const struct alarm_master_parameters parameters = master->parameters;
    if (alarm_master_start(master, master->board, &parameters) != SELF_TEST_GOOD)
      board_fatal(master->board, self_test_text(master->self_test));
    return;
  }
  if (read_number(master->board, MASTER_MASTER_STATUS, 1) & MASTER_MAILBOX_WAITING_MASK) take_message(master);
}

void alarm_master_run(struct alarm_master *master, struct board *board,
                      const struct alarm_master_parameters *parameters) {
  if (alarm_master_start(master, board, parameters) != SELF_TEST_GOOD)
    board_fatal(board, self_test_text(master->self_test));
  for (;;) alarm_master_serve(master);
}

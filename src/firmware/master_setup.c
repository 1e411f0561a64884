#include "master_setup.h"

#include "alarm-master.h"
#include "heartbeat.h"
#include "request.h"
#include "start_number.h"

enum { TYPE = 0xf2, SLOTS_PER_US = 25, SPARE_US = 50000 /* for whatever else the line is busy with */ };
enum { LONGEST_FRAME_US = 125, MOST_CYCLE_US = 41943, MOST_TIMEOUT_US = 2621, MOST_RETRIES = 15 };
enum { RANDOM_TRIES = 4 };

static bool is_station_mac(const uint8_t *mac) { return !is_zero(mac, 6) && (mac[0] & 1) == 0; }
static bool is_station_ip(const uint8_t *ip) { return ip[0] != 0 && ip[0] < 224; }
static bool within(uint32_t number, uint32_t least, uint32_t most) {
  return number >= least && number <= most;
}

bool master_is_there(struct board *board) { return read_number(board, MASTER_MASTER_TYPE, 1) == TYPE; }

/* As the controller has them: its own for those that are none. */
uint32_t master_request_limit(const struct alarm_master_parameters *p) {
  const uint32_t cycle = within(p->bus_cycle_us, 10, MOST_CYCLE_US) ? p->bus_cycle_us : MOST_CYCLE_US;
  const uint32_t timeout =
      within(p->answer_timeout_us, 10, MOST_TIMEOUT_US) ? p->answer_timeout_us : MOST_TIMEOUT_US;
  const uint32_t retries = p->retries <= MOST_RETRIES ? p->retries : MOST_RETRIES;
  return 2 * cycle + (retries + 2) * (timeout + LONGEST_FRAME_US) + SPARE_US;
}

/* A setting is written if it is one; the result says what is wrong with it. */
static enum self_test set(struct board *board, uint16_t address, uint8_t length, uint32_t number, bool right,
                          enum self_test otherwise) {
  if (!right) return otherwise;
  return number_holds(board, address, length, number) ? SELF_TEST_GOOD : SELF_TEST_MEMORY;
}

static enum self_test set_bytes(struct board *board, uint16_t address, const uint8_t *bytes, uint8_t length,
                                bool right, enum self_test otherwise) {
  if (!right) return otherwise;
  return write_holds(board, address, bytes, length) ? SELF_TEST_GOOD : SELF_TEST_MEMORY;
}

/* A port stands in its register as on the wire. */
static enum self_test set_port(struct board *board, uint16_t address, uint16_t port) {
  const uint8_t bytes[2] = {(uint8_t)(port >> 8), (uint8_t)port};
  return set_bytes(board, address, bytes, sizeof bytes, port != 0, SELF_TEST_PORT);
}

/* What the line needs; the controller's own settings serve as well. */
static enum self_test set_line(struct board *board, const struct alarm_master_parameters *p) {
  enum self_test result = set(board, MASTER_BUS_CYCLE, 4, p->bus_cycle_us * SLOTS_PER_US,
                              within(p->bus_cycle_us, 10, MOST_CYCLE_US), SELF_TEST_BUS_CYCLE);
  result = worse(result, set(board, MASTER_ANSWER_TIMEOUT, 2, (uint32_t)p->answer_timeout_us * SLOTS_PER_US,
                             within(p->answer_timeout_us, 10, MOST_TIMEOUT_US), SELF_TEST_TIMEOUT));
  return worse(result,
               set(board, MASTER_RETRIES, 1, p->retries, p->retries <= MOST_RETRIES, SELF_TEST_RETRIES));
}

/* How often there are reports; likewise. */
static enum self_test set_times(struct board *board, const struct alarm_master_parameters *p) {
  enum self_test result = set(board, MASTER_REPORT_REPEAT, 2, p->report_repeat_ms,
                              within(p->report_repeat_ms, 1, 4095), SELF_TEST_REPORT);
  result = worse(result, set(board, MASTER_REPORT_HEARTBEAT, 2, p->report_heartbeat_ms,
                             within(p->report_heartbeat_ms, 1, 4095), SELF_TEST_REPORT));
  return worse(result, set(board, MASTER_SERVER_TIMEOUT, 1, p->server_timeout_s, p->server_timeout_s != 0,
                           SELF_TEST_SERVER_TIMEOUT));
}

/* Whom reports go to, from whom, and how they are tagged: without that there are none. */
static enum self_test set_network(struct board *board, const struct alarm_master_parameters *p) {
  enum self_test result =
      set(board, MASTER_MASTER_ID, 2, p->master_id, p->master_id != 0, SELF_TEST_MASTER_ID);
  result = worse(result, set_bytes(board, MASTER_MASTER_MAC, p->master_mac, 6, is_station_mac(p->master_mac),
                                   SELF_TEST_MAC));
  result = worse(result, set_bytes(board, MASTER_SERVER_MAC, p->server_mac, 6, is_station_mac(p->server_mac),
                                   SELF_TEST_MAC));
  result = worse(
      result, set_bytes(board, MASTER_MASTER_IP, p->master_ip, 4, is_station_ip(p->master_ip), SELF_TEST_IP));
  result = worse(
      result, set_bytes(board, MASTER_SERVER_IP, p->server_ip, 4, is_station_ip(p->server_ip), SELF_TEST_IP));
  result = worse(result, set_port(board, MASTER_MASTER_PORT, p->master_port));
  result = worse(result, set_port(board, MASTER_SERVER_PORT, p->server_port));
  if (is_zero(p->key, PROTOCOL_KEY_BYTES)) return worse(result, SELF_TEST_KEY);
  /* It cannot be read back. While reports run it is in use, and is there already: a new key needs a reset of
   * the controller. */
  if (!(read_number(board, MASTER_MASTER_CONTROL, 1) & MASTER_REPORT_RUN_MASK))
    board_write(board, MASTER_MASTER_KEY, p->key, PROTOCOL_KEY_BYTES);
  return result;
}

static bool is_list(const struct panel_parameters *p, uint32_t most) {
  if (p->place_count > most) return false;
  for (uint8_t i = 0; i < p->place_count; ++i) {
    if (p->places[i].node == 0 || p->places[i].node == PROTOCOL_ALL_NODES) return false;
    for (uint8_t k = 0; k < i; ++k)
      if (p->places[k].node == p->places[i].node) return false;
  }
  return true;
}

/* The expected slaves, by position; `listed` if there are any. */
static enum self_test set_places(struct board *board, const struct panel_parameters *p, bool *listed) {
  const uint32_t most = read_number(board, MASTER_MAX_SLAVES, 1);
  *listed = p->place_count > 0 && is_list(p, most);
  for (uint32_t i = 0; i < most; ++i) {
    write_number(board, MASTER_SLAVE_INDEX, 1, i);
    write_number(board, MASTER_EXPECTED_NODE, 2, *listed && i < p->place_count ? p->places[i].node : 0);
  }
  return *listed || p->place_count == 0 ? SELF_TEST_GOOD : SELF_TEST_PLACES;
}

/* The life for the slaves is another one after each start, so that they tell again what they have told
 * another master; that for the server is one that nobody can know before, so that answers to an earlier life
 * are worth nothing. `usable`: reports may have it. */
static enum self_test begin_life(struct alarm_master *master, bool *usable) {
  struct board *board = master->board;
  uint8_t life[PROTOCOL_LIFE_BYTES] = {0};
  uint32_t number;
  master->store_failed = !start_number(board, 0xffff, read_number(board, MASTER_LINE_LIFE, 2), &number);
  master->line_life = (uint16_t)number;
  bool drawn = false;
  for (int i = 0; i < RANDOM_TRIES && !drawn; ++i)
    drawn = board_random(board, life, sizeof life) && !is_zero(life, sizeof life);
  if (!drawn) {
    /* At least one that was not there before. */
    for (int i = 0; i < PROTOCOL_LIFE_BYTES; ++i) life[i] = 0;
    uint32_t stored = 0;
    if (!master->store_failed && board_load(board, &stored))
      for (int i = 0; i < 4; ++i) life[PROTOCOL_LIFE_BYTES - 1 - i] = (uint8_t)(stored >> (8 * i));
  }
  *usable = !is_zero(life, sizeof life);
  enum self_test result = master->store_failed ? SELF_TEST_STORE : SELF_TEST_GOOD;
  if (!number_holds(board, MASTER_LINE_LIFE, 2, master->line_life) ||
      !write_holds(board, MASTER_MASTER_LIFE, life, sizeof life))
    result = worse(result, SELF_TEST_MEMORY);
  return worse(result, drawn ? SELF_TEST_GOOD : SELF_TEST_RANDOM);
}

/* The controller has run on while the host has started anew: it stays the same master. */
static enum self_test keep_life(struct alarm_master *master) {
  uint32_t stored;
  master->line_life = (uint16_t)read_number(master->board, MASTER_LINE_LIFE, 2);
  master->store_failed = !board_load(master->board, &stored);
  return master->store_failed ? SELF_TEST_STORE : SELF_TEST_GOOD;
}

static bool runs(struct board *board) {
  uint8_t life[PROTOCOL_LIFE_BYTES];
  board_read(board, MASTER_MASTER_LIFE, life, sizeof life);
  return read_number(board, MASTER_MASTER_SELF_TEST, 1) != SELF_TEST_NOT_RUN && !is_zero(life, sizeof life);
}

/* What the controller still has to send of an earlier start of the host must not be overwritten by patterns.
 */
static enum self_test check_memory(struct board *board, uint32_t limit_us) {
  enum self_test result = SELF_TEST_GOOD;
  if (!request_is_free(board, limit_us) || !memory_holds(board, MASTER_REQUEST_DATA, 8))
    result = SELF_TEST_MEMORY;
  if (!(read_number(board, MASTER_MASTER_STATUS, 1) & MASTER_HOST_EVENT_BUSY_MASK) &&
      !memory_holds(board, MASTER_HOST_EVENT, PROTOCOL_HOST_EVENT_BYTES))
    result = SELF_TEST_MEMORY;
  return result;
}

enum self_test master_set_up(struct alarm_master *master) {
  struct board *board = master->board;
  const struct alarm_master_parameters *p = &master->parameters;
  bool usable = true, listed = false;
  enum self_test result = check_memory(board, master_request_limit(p));
  result = worse(result, set_line(board, p));
  result = worse(result, set_times(board, p));
  const enum self_test network = set_network(board, p);
  result = worse(result, network);
  result = worse(result, set_places(board, &p->panel, &listed));
  result = worse(result, runs(board) ? keep_life(master) : begin_life(master, &usable));
  if (p->alive_ms < HEARTBEAT_LEAST_MS) result = worse(result, SELF_TEST_ALIVE);
  if (!panel_fits(&p->panel)) result = worse(result, SELF_TEST_DISPLAY);
  master->control = MASTER_LINE_RUN_MASK;
  if (network == SELF_TEST_GOOD && usable) master->control |= MASTER_REPORT_RUN_MASK;
  if (listed) master->control |= MASTER_LINE_LISTED_MASK;
  return result;
}

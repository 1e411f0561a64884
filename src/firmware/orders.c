#include "orders.h"

#include "alarm-master.h"
#include "alarm-slave.h"
#include "master_setup.h"
#include "request.h"

enum { ATTEMPTS = 3 }; /* of a datagram, besides the retries of its frame */

struct order {
  uint8_t code; /* an enum protocol_order, or unknown */
  uint16_t node;
  uint16_t seconds;
  uint32_t ticket;
};

static uint16_t big16(const uint8_t *at) { return (uint16_t)(at[0] << 8 | at[1]); }
static uint32_t big32(const uint8_t *at) { return (uint32_t)big16(at) << 16 | big16(at + 2); }

/* --- datagrams --- */

static enum request_end ask(struct alarm_master *master, struct request *r) {
  const enum request_end end = request(master->board, r, master_request_limit(&master->parameters));
  master->line_moves = end != REQUEST_HUNG;
  return end;
}

/* A write to the slave at a position. The line may have changed since that was looked up: the slave is asked
 * for its node ID first. */
static enum protocol_result write_one(struct alarm_master *master, uint8_t position, uint16_t node,
                                      uint16_t ado, const uint8_t *data, uint8_t length) {
  enum protocol_result result = PROTOCOL_RESULT_NO_ANSWER;
  for (int attempt = 0; attempt < ATTEMPTS; ++attempt) {
    struct request r = {.command = PROTOCOL_ECAT_APRD,
                        .adp = adp_of(position),
                        .ado = ESC_SLAVE_STATE + PROTOCOL_SLAVE_STATE_NODE_AT,
                        .length = PROTOCOL_SLAVE_STATE_NODE_BYTES};
    if (ask(master, &r) != REQUEST_BACK || r.counter != 1) continue;
    if ((r.data[0] | r.data[1] << 8) != node) {
      result = PROTOCOL_RESULT_NO_SUCH_NODE;
      continue;
    }
    result = PROTOCOL_RESULT_NO_ANSWER;
    r = (struct request){
        .command = PROTOCOL_ECAT_APWR, .adp = adp_of(position), .ado = ado, .length = length};
    for (uint8_t i = 0; i < length; ++i) r.data[i] = data[i];
    if (ask(master, &r) == REQUEST_BACK && r.counter == 1) return PROTOCOL_RESULT_DONE;
  }
  return result;
}

/* All that are there must take it. */
static enum protocol_result write_all(struct alarm_master *master, uint16_t ado, const uint8_t *data,
                                      uint8_t length) {
  for (int attempt = 0; attempt < ATTEMPTS; ++attempt) {
    struct request r = {.command = PROTOCOL_ECAT_BWR, .ado = ado, .length = length};
    for (uint8_t i = 0; i < length; ++i) r.data[i] = data[i];
    const uint16_t present = picture_present(&master->picture);
    if (ask(master, &r) == REQUEST_BACK && r.counter > 0 && r.counter >= present) return PROTOCOL_RESULT_DONE;
  }
  return PROTOCOL_RESULT_NO_ANSWER;
}

/* Two slaves may have one node ID, which is a fault: both are meant. */
static enum protocol_result write_nodes(struct alarm_master *master, uint16_t node, uint16_t ado,
                                        const uint8_t *data, uint8_t length) {
  if (node == PROTOCOL_ALL_NODES) return write_all(master, ado, data, length);
  int position = node == 0 ? -1 : picture_position(&master->picture, node, 0);
  enum protocol_result result = position < 0 ? PROTOCOL_RESULT_NO_SUCH_NODE : PROTOCOL_RESULT_DONE;
  for (; position >= 0; position = picture_position(&master->picture, node, position + 1)) {
    const enum protocol_result one = write_one(master, (uint8_t)position, node, ado, data, length);
    if (one != PROTOCOL_RESULT_DONE) result = one;
  }
  return result;
}

/* --- execution --- */

/* The controller carries it to exactly those slaves that it concerns now. */
static enum protocol_result pulse(struct alarm_master *master, uint8_t bit) {
  write_number(master->board, MASTER_MASTER_CONTROL, 1, master->control | bit);
  return PROTOCOL_RESULT_DONE;
}

static enum protocol_result command(struct alarm_master *master, uint16_t node, uint8_t for_all,
                                    uint8_t for_one) {
  if (node == PROTOCOL_ALL_NODES) return pulse(master, for_all);
  return write_nodes(master, node, ESC_ALARM_COMMAND, &for_one, 1);
}

static enum protocol_result set_mode(struct alarm_master *master, const struct order *order,
                                     enum protocol_mode mode) {
  const uint8_t data[4] = {(uint8_t)mode, 0, (uint8_t)order->seconds, (uint8_t)(order->seconds >> 8)};
  /* For no time at all: that is none of the three. */
  if (order->seconds == 0 && mode != PROTOCOL_MODE_WATCH) return PROTOCOL_RESULT_REFUSED;
  return write_nodes(master, order->node, ESC_DETECTOR_MODE, data, sizeof data);
}

static enum protocol_result execute(struct alarm_master *master, const struct order *order) {
  struct order watch = *order;
  watch.seconds = 0;
  switch (order->code) {
    case PROTOCOL_ORDER_SILENCE:
      return command(master, order->node, MASTER_SILENCE_MASK, ESC_ALARM_SILENCE_MASK);
    case PROTOCOL_ORDER_RESET:
      return command(master, order->node, MASTER_RESET_ALARM_MASK, ESC_DETECTOR_RESTART_MASK);
    case PROTOCOL_ORDER_DISABLE: return set_mode(master, order, PROTOCOL_MODE_DISABLE);
    case PROTOCOL_ORDER_TEST: return set_mode(master, order, PROTOCOL_MODE_TEST);
    case PROTOCOL_ORDER_WATCH: return set_mode(master, &watch, PROTOCOL_MODE_WATCH);
    case PROTOCOL_ORDER_ACKNOWLEDGE: return PROTOCOL_RESULT_DONE; /* the log has it then */
    default: return PROTOCOL_RESULT_UNKNOWN_COMMAND;
  }
}

/* The end of an order goes into the log, and to the server. */
static void end(struct alarm_master *master, const struct order *order, enum protocol_result result,
                uint64_t time_us) {
  const uint8_t event[PROTOCOL_HOST_EVENT_BYTES] = {
      [PROTOCOL_HOST_EVENT_POSITION_AT] = order->code,
      [PROTOCOL_HOST_EVENT_STATE_AT] = (uint8_t)result,
      [PROTOCOL_HOST_EVENT_NODE_AT] = (uint8_t)order->node,
      [PROTOCOL_HOST_EVENT_NODE_AT + 1] = (uint8_t)(order->node >> 8),
      [PROTOCOL_HOST_EVENT_SEQUENCE_AT] = (uint8_t)order->ticket,
      [PROTOCOL_HOST_EVENT_SEQUENCE_AT + 1] = (uint8_t)(order->ticket >> 8)};
  event_log_write(&master->log, &(struct log_record){.time_us = time_us,
                                                     .kind = LOG_ORDER,
                                                     .position = order->code,
                                                     .node = order->node,
                                                     .detail = (uint32_t)result | order->ticket << 16});
  struct host_events *events = &master->events;
  if (events->count == HOST_EVENTS) {
    ++master->untold;
    return;
  }
  uint8_t *place = events->waiting[(events->first + events->count++) % HOST_EVENTS];
  for (int i = 0; i < PROTOCOL_HOST_EVENT_BYTES; ++i) place[i] = event[i];
}

void take_order(struct alarm_master *master, uint64_t time_us) {
  struct board *board = master->board;
  uint8_t answer[PROTOCOL_ANSWER_BYTES];
  const uint32_t length = read_number(board, MASTER_MAILBOX_LENGTH, 2);
  write_number(board, MASTER_MAILBOX_OFFSET, 1, 0);
  for (uint32_t i = 0; i < PROTOCOL_ANSWER_BYTES; ++i)
    answer[i] = i < length ? (uint8_t)read_number(board, MASTER_MAILBOX_DATA, 1) : 0;
  /* From here on the next one can come. */
  write_number(board, MASTER_MAILBOX_CONTROL, 1, MASTER_MAILBOX_DONE_MASK);
  const struct order order = {answer[PROTOCOL_ANSWER_ORDER_AT], big16(answer + PROTOCOL_ANSWER_NODE_AT),
                              big16(answer + PROTOCOL_ANSWER_SECONDS_AT),
                              big32(answer + PROTOCOL_ANSWER_TICKET_AT)};
  if (length != PROTOCOL_ANSWER_BYTES || big16(answer + PROTOCOL_ANSWER_MAGIC_AT) != PROTOCOL_MAGIC ||
      answer[PROTOCOL_ANSWER_VERSION_AT] != PROTOCOL_VERSION ||
      answer[PROTOCOL_ANSWER_KIND_AT] != PROTOCOL_KIND_ANSWER ||
      big16(answer + PROTOCOL_ANSWER_MASTER_AT) != master->parameters.master_id ||
      order.code == PROTOCOL_ORDER_NONE) {
    ++master->malformed;
    return;
  }
  ++master->orders;
  end(master, &order, alarm_master_storage_failed(master) ? PROTOCOL_RESULT_REFUSED : execute(master, &order),
      time_us);
}

void order_by_panel(struct alarm_master *master, uint8_t order, uint64_t time_us) {
  const struct order pressed = {order, PROTOCOL_ALL_NODES, 0, 0};
  end(master, &pressed, execute(master, &pressed), time_us);
}

void tell_events(struct alarm_master *master) {
  struct host_events *events = &master->events;
  if (events->count == 0 || read_number(master->board, MASTER_MASTER_STATUS, 1) & MASTER_HOST_EVENT_BUSY_MASK)
    return;
  board_write(master->board, MASTER_HOST_EVENT, events->waiting[events->first], PROTOCOL_HOST_EVENT_BYTES);
  write_number(master->board, MASTER_HOST_EVENT_CONTROL, 1, MASTER_HOST_EVENT_GO_MASK);
  events->first = (uint8_t)((events->first + 1) % HOST_EVENTS);
  --events->count;
}

#include "ring_node.h"

#include "../driver/registers.h"
#include "../start_number.h"
#include "ring-node-tp.h"

enum {
  TYPE = 0xf3,
  LIFE_MASK = 0x7f,
  PD_MS_MAX = 1000,
  FRAMES_A_PASS = 64,  /* then it is the transport's turn */
  RESTART_US = 100000, /* between two looks for a controller */
  WAIT_US_MAX = 500000, /* as the watchdog is served once a pass */
  ALL_EVENTS = 0xffff
};

/* What wakes the host; conflicts are found in relay mode only. */
static const uint32_t WAKING = NODE_CAN_F_MASK_RECEIVED_MASK | NODE_CAN_F_MASK_SLOT_DONE_MASK |
                               NODE_RING_MASK_PORT_MASK | NODE_RING_MASK_MODE_MASK;

/* Bytes of HELLO behind the life (TP-31). */
enum { HELLO_STATE, HELLO_PORTS, HELLO_CAN_F, HELLO_CAN_T, HELLO_TYPE, HELLO_VERSION = HELLO_TYPE + 2 };

static bool is_possible(const struct ring_node_parameters *p) {
  return p->address >= 1 && p->address <= RING_LAST_ADDRESS && p->pd_ms >= 1 && p->pd_ms <= PD_MS_MAX;
}

/* By the board's clock: time goes on, and messages end, while the controller does not answer. */
static void look_at_time(struct ring_node *node) {
  const uint32_t timer = board_time(node->board);
  node->now_us += timer - node->timer;
  node->timer = timer;
}

/* A controller that does not answer may read as anything, as ones in each register. */
static bool answers(const struct ring_node *node) {
  return read_number(node->board, NODE_NODE_TYPE, 1) == TYPE;
}

static void look_at_status(struct ring_node *node) {
  struct board *board = node->board;
  node->status[HELLO_STATE] = (uint8_t)read_number(board, NODE_RING_STATE, 1);
  node->status[HELLO_PORTS] = (uint8_t)read_number(board, NODE_RING_PORTS, 1);
  node->status[HELLO_CAN_F] = (uint8_t)read_number(board, NODE_CAN_F_STATUS, 1);
  node->status[HELLO_CAN_T] = (uint8_t)read_number(board, NODE_CAN_T_STATUS, 1); /* 0 without that port */
  node->status[HELLO_TYPE] = (uint8_t)(node->parameters.device_type >> 8);
  node->status[HELLO_TYPE + 1] = (uint8_t)node->parameters.device_type;
  node->status[HELLO_VERSION] = node->parameters.version;
}

static uint8_t life_behind(uint8_t life) { return (uint8_t)(life % LIFE_MASK + 1); }
static uint8_t life_before(uint8_t life) { return (uint8_t)(life > 1 ? life - 1 : LIFE_MASK); }

/* As others see it (TP-20). */
static bool is_ahead(uint32_t life, uint32_t of) {
  const uint32_t by = (life + LIFE_MASK - of) % LIFE_MASK;
  return by > 0 && by <= LIFE_MASK / 2;
}

/* A life that no start has used yet. If the last one has failed there is one: a store for each would wear the
 * memory out. Others ignore a life that looks older than the last one for 10 s, on slow rings for longer
 * (TP-20, TB-28): as the number of a memory may that did not work meanwhile, or a random one. */
static void take_life(struct ring_node *node) {
  if (node->life_is_new) return;
  uint32_t life;
  const uint8_t last = node->life;
  do node->stored = start_number(node->board, LIFE_MASK, last, &life);
  while (node->stored && last != 0 && !is_ahead(life, last));
  /* Two ahead: of what the controller has the transport may have been one ahead. */
  node->life = node->stored || last == 0 ? (uint8_t)life : life_behind(life_behind(last));
  node->life_is_new = true;
}

/* Also without a controller: what the device has given the transport by then is not lost. */
static void start_transport(struct ring_node *node) {
  const struct ring_node_parameters *p = &node->parameters;
  const struct transport_config config = {.address = p->address,
                                          .life = node->life,
                                          .kbps = p->kbps,
                                          .slots = can_port_slots(p->relay, p->bridge),
                                          .pd_ms = p->pd_ms,
                                          .hello_ms = p->hello_ms};
  transport_start(&node->transport, &node->port, &config, node->now_us);
  node->began = true;
}

/* The transport goes on through a reset of the controller: what waited there is lost, as frames may be. The
 * links begin a new life, since their sequences begin anew. */
static enum ring_node_fault start_controller(struct ring_node *node) {
  const struct ring_node_parameters *p = &node->parameters;
  struct board *board = node->board;
  if (!node->began) return RING_NODE_SETTINGS;
  if (!answers(node)) return RING_NODE_NO_CONTROLLER;
  take_life(node);
  const struct can_port_config config = {.address = p->address,
                                         .home = p->home,
                                         .relay = p->relay,
                                         .kbps = p->kbps,
                                         .core_mhz = p->core_mhz,
                                         .up_ms = p->up_ms,
                                         .confirm_us = p->confirm_us,
                                         .life = node->life,
                                         .pair_kbps = p->pair_kbps,
                                         .bridge = p->bridge};
  if (!can_port_start(&node->port, board, &config)) return RING_NODE_SETTINGS;
  write_number(board, NODE_NODE_EVENTS, 2, ALL_EVENTS);
  const uint32_t waking = WAKING | (p->relay ? NODE_RING_MASK_CONFLICT_MASK : 0) | p->other_events;
  if (!number_holds(board, NODE_NODE_MASK, 2, waking)) return RING_NODE_SETTINGS;
  node->life_is_new = false;
  node->link_life = node->life;
  ++node->starts;
  look_at_status(node);
  transport_hello(&node->transport, node->status);
  return node->stored ? RING_NODE_GOOD : RING_NODE_STORE;
}

bool ring_node_runs(const struct ring_node *node) {
  return (node->fault == RING_NODE_GOOD || node->fault == RING_NODE_STORE) && answers(node) &&
         can_port_runs(&node->port);
}

enum ring_node_fault ring_node_start(struct ring_node *node, struct board *board,
                                     const struct ring_node_parameters *parameters) {
  const struct ring_node_parameters p = *parameters; /* which may be its own */
  for (uint32_t i = 0; i < sizeof *node; ++i) ((uint8_t *)node)[i] = 0; /* too large for a stack */
  node->board = board;
  node->parameters = p;
  if (answers(node)) node->life = (uint8_t)read_number(board, NODE_RING_LIFE, 1) & LIFE_MASK;
  node->link_life = node->life; /* of the program before */
  node->timer = board_time(board);
  if (is_possible(&p)) {
    take_life(node);
    start_transport(node);
  }
  return node->fault = start_controller(node);
}

/* Whether frames are left in the controller. */
static bool move_frames(struct ring_node *node) {
  struct board *board = node->board;
  struct ring_frame frame;
  /* Before what they tell of is looked at: what comes from now on makes another one. */
  write_number(board, NODE_NODE_EVENTS, 2, read_number(board, NODE_NODE_EVENTS, 2));
  look_at_status(node);
  transport_hello(&node->transport, node->status);
  for (int i = 0; i < FRAMES_A_PASS; ++i) {
    if (!can_port_receive(&node->port, &frame)) return false;
    transport_receive(&node->transport, &frame, node->now_us);
  }
  return true;
}

void ring_node_look(struct ring_node *node) {
  node->more = false;
  board_watchdog(node->board);
  look_at_time(node);
  if (!ring_node_runs(node)) node->fault = start_controller(node);
  if (ring_node_runs(node)) node->more = move_frames(node);
  else can_port_lose(&node->port);
}

void ring_node_poll(struct ring_node *node) {
  if (!node->began) return;
  node->due_us = transport_poll(&node->transport, node->now_us);
  if (node->more) node->due_us = node->now_us; /* they make no event */
}

void ring_node_serve(struct ring_node *node) {
  ring_node_look(node);
  ring_node_poll(node);
}

void ring_node_wait(struct ring_node *node, uint32_t most_us) {
  uint64_t us = most_us < WAIT_US_MAX ? most_us : WAIT_US_MAX;
  if (!ring_node_runs(node)) us = us < RESTART_US ? us : RESTART_US;
  else if (node->due_us <= node->now_us) us = 0;
  else if (node->due_us - node->now_us < us) us = node->due_us - node->now_us;
  if (us > 0) board_wait(node->board, (uint32_t)us);
}

bool ring_node_conflict(const struct ring_node *node) {
  return (node->status[HELLO_STATE] & NODE_RING_CONFLICT_MASK) != 0;
}

/* Sequences begin anew, so it is another life (RB-13): of the old one others would take nothing. It is the
 * one before that of the start, and that one again, in turn: a number of its own would wear the memory each
 * time, and bring the lives of later starts so far ahead that they look old (TP-20). Without a memory it is
 * the next one, so that the controller's stays the newest. Without a conflict nothing is done: others have to
 * hear of a life before the one in front of it may come again. */
void ring_node_clear_conflict(struct ring_node *node) {
  struct board *board = node->board;
  if (!ring_node_runs(node)) return; /* the next start ends it, too */
  look_at_status(node);
  if (!ring_node_conflict(node)) return;
  if (!node->stored) node->life = node->link_life = life_behind(node->link_life);
  else node->link_life = node->link_life == node->life ? life_before(node->life) : node->life;
  write_number(board, NODE_RING_LIFE, 1, node->link_life);
  const uint32_t control = read_number(board, NODE_RING_CONTROL, 1);
  write_number(board, NODE_RING_CONTROL, 1, control | NODE_RING_CLEAR_MASK);
}

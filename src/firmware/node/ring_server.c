#include "ring_server.h"

#include "../driver/registers.h"
#include "../ring/bytes.h"
#include "ring-server.h"

enum {
  LOOK_MS = 100, /* between two looks at the nodes without news, at most */
  US_IN_MS = 1000,
  PARTS_OF_MESSAGE = 2, /* the most that a message of 2 KiB has */
  /* Places that messages leave for what else is to be told: news, which leave the rest for results. */
  PARTS_FOR_OTHERS = 8 + RING_REPORTS_RESULTS,
  DATAGRAMS_A_PASS = 4,
  PLANT_EVENTS = NODE_PLANT_MASK_RECEIVED_MASK | NODE_PLANT_MASK_SENT_MASK,
  PORTS_AT = 1, /* in HELLO behind the life */
  CAN_F_AT = 2,
  CAN_T_AT = 3,
  ORDER_US = 30000000, /* for a message of the server: twice what four long ones take at 5 kbit/s */
  /* Of a CAN status: another one in each moment, and no news. */
  MOMENTARY = NODE_CAN_F_INTEGRATING_MASK | NODE_CAN_F_SENDING_MASK | NODE_CAN_F_RECEIVING_MASK
};

static uint64_t look_us(const struct ring_server *s) {
  const uint16_t hello_ms = s->parameters.node.hello_ms;
  return (hello_ms != 0 && hello_ms < LOOK_MS ? hello_ms : LOOK_MS) * (uint64_t)US_IN_MS;
}

/* --- parts --- */

static struct ring_part own_part(uint8_t type, uint8_t source, const uint8_t *bytes, uint8_t length,
                                 const void *ends) {
  struct ring_part part = {.type = type, .source = source, .total = length, .length = length, .ends = ends};
  copy_bytes(part.own, bytes, length);
  return part;
}

/* What is known of a node, or of the ring, if that is news. The next news waits until the server has these:
 * so one that changes all the time takes one place. */
static void tell(struct ring_server *s, struct ring_server_node *n, uint8_t type, uint8_t source,
                 const uint8_t *bytes, uint8_t length) {
  if (n->waits || ring_reports_free(&s->reports) <= RING_REPORTS_RESULTS) return;
  if (n->told && n->length == length && same_bytes(n->bytes, bytes, length)) return;
  n->told = n->waits = true;
  n->length = length;
  copy_bytes(n->bytes, bytes, length);
  const struct ring_part part = own_part(type, source, bytes, length, n);
  ring_reports_add(&s->reports, &part);
}

/* The controller forgets distances sooner than the next HELLO comes (FR-59, FR-60): they are those heard
 * last, until a node's HELLO would be missed. */
static void look_at_distances(struct ring_server *s, struct ring_server_node *n, uint8_t address) {
  uint8_t now[RING_SERVER_PORTS];
  board_read(s->node.board, (uint16_t)(NODE_RING_DISTANCEN(address)), now, sizeof now);
  for (unsigned p = 0; p < RING_SERVER_PORTS; ++p) {
    if (now[p] == 0 && s->node.now_us - n->heard_us[p] < transport_member_us(&s->node.transport)) continue;
    if (now[p] != 0) n->heard_us[p] = s->node.now_us;
    n->distances[p] = now[p];
  }
}

static void look_at_node(struct ring_server *s, uint8_t address) {
  struct ring_server_node *n = &s->nodes[address];
  uint8_t bytes[RING_SERVER_NODE_BYTES] = {0};
  const bool present = bit_of(s->picture.present, address);
  /* One that was never there is not lost. */
  if (!present && !n->was_there) return;
  if (present) {
    n->was_there = true;
    uint8_t *hello = bytes + 2;
    bytes[0] = 1;
    if (address == s->parameters.node.address) {
      bytes[1] = s->node.life;
      copy_bytes(hello, s->node.status, TRANSPORT_HELLO_BYTES);
    } else {
      transport_told(&s->node.transport, address, &bytes[1], hello);
    }
    hello[CAN_F_AT] &= (uint8_t)~MOMENTARY;
    hello[CAN_T_AT] &= (uint8_t)~MOMENTARY;
    if (s->parameters.node.relay) look_at_distances(s, n, address);
    copy_bytes(hello + TRANSPORT_HELLO_BYTES, n->distances, sizeof n->distances);
  }
  tell(s, n, PROTOCOL_RING_PART_NODE, address, bytes, present ? sizeof bytes : 1);
}

static void look_at_ring(struct ring_server *s) {
  const uint32_t news = transport_news(&s->node.transport);
  const uint8_t ports = s->node.status[PORTS_AT]; /* which the picture is of */
  const bool due = s->node.now_us - s->looked_us >= look_us(s);
  if (news == s->news && ports == s->ports && !due) return;
  if (due) s->looked_us = s->node.now_us;
  s->news = news;
  s->ports = ports;
  ring_picture_look(&s->picture, &s->node);
  for (uint8_t a = 1; a < TRANSPORT_NODES; ++a) look_at_node(s, a);
  if (!s->picture.known) return;
  /* The other side of a break tells of it in a moment. */
  if ((s->picture.ends[0] == 0) != (s->picture.ends[1] == 0) && !due) return;
  tell(s, &s->ring, PROTOCOL_RING_PART_RING, s->parameters.node.address, s->picture.ends,
       sizeof s->picture.ends);
}

/* A message stays in the transport until the server has it: only then its sender is told. */
static void take_messages(struct ring_server *s) {
  struct transport *t = &s->node.transport;
  const struct transport_message *m;
  while (ring_reports_free(&s->reports) >= PARTS_OF_MESSAGE + PARTS_FOR_OTHERS &&
         (m = transport_received(t)) != 0) {
    transport_hold(t, m);
    for (uint16_t at = 0; at < m->length; at = (uint16_t)(at + RING_REPORTS_DATA_BYTES)) {
      const uint16_t rest = (uint16_t)(m->length - at);
      const bool last = rest <= RING_REPORTS_DATA_BYTES;
      const struct ring_part part = {.type = PROTOCOL_RING_PART_MESSAGE,
                                     .source = m->source,
                                     .pipe = m->pipe,
                                     .number = m->number,
                                     .life = (uint8_t)(m->life | (m->to_all ? RING_TO_ALL : 0)),
                                     .flags = (uint8_t)((m->urgent ? PROTOCOL_RING_FLAG_URGENT : 0) |
                                                        (m->repeat ? PROTOCOL_RING_FLAG_REPEAT : 0)),
                                     .total = m->length,
                                     .offset = at,
                                     .length = last ? rest : RING_REPORTS_DATA_BYTES,
                                     .data = m->data + at,
                                     .ends = last ? m : 0};
      ring_reports_add(&s->reports, &part);
    }
  }
}

/* What the server has. */
static void end_parts(struct ring_server *s) {
  struct ring_part part;
  while (ring_reports_done(&s->reports, &part)) {
    if (part.type == PROTOCOL_RING_PART_MESSAGE) {
      if (part.ends != 0) transport_take(&s->node.transport, part.ends, false);
    } else if (part.type == PROTOCOL_RING_PART_NODE) {
      s->nodes[part.source].waits = false;
    } else if (part.type == PROTOCOL_RING_PART_RING) {
      s->ring.waits = false;
    }
  }
}

/* --- messages of the server --- */

static void tell_result(struct ring_server *s, uint32_t counter, uint8_t result) {
  uint8_t bytes[RING_REPORTS_RESULT_BYTES] = {[4] = result};
  put_number(bytes, counter, 4);
  const struct ring_part part =
      own_part(PROTOCOL_RING_PART_RESULT, s->parameters.node.address, bytes, sizeof bytes, 0);
  ring_reports_add(&s->reports, &part);
}

static unsigned free_orders(const struct ring_server *s) {
  unsigned count = 0;
  for (uint16_t i = 0; i < RING_SERVER_ORDERS; ++i) count += !s->orders[i].used;
  return count;
}

/* One for which there is no place is not taken: the server sends it again. The last one is for urgent ones,
 * also if the server does not know of the others, since it has restarted. */
static void take_order(struct ring_server *s, const struct ring_order *order) {
  if (order->destination == s->parameters.node.address || order->destination > RING_LAST_ADDRESS ||
      order->length == 0 || order->length > RING_SERVER_ORDER_BYTES) {
    if (ring_reports_free(&s->reports) == 0) return;
    ring_reports_take(&s->reports, order);
    tell_result(s, order->counter, PROTOCOL_RING_RESULT_REFUSED);
    return;
  }
  if (!order->urgent && free_orders(s) <= 1) return;
  for (uint16_t i = 0; i < RING_SERVER_ORDERS; ++i) {
    struct ring_server_order *place = &s->orders[i];
    if (place->used) continue;
    copy_bytes(place->data, order->data, order->length);
    if (!transport_send(&s->node.transport, i, order->destination, order->urgent, place->data, order->length,
                        0, s->node.now_us))
      return;
    place->used = true;
    place->counter = order->counter;
    place->taken_us = s->node.now_us;
    ring_reports_take(&s->reports, order);
    return;
  }
}

/* A node may be busy for ever (TB-06). */
static void give_up_orders(struct ring_server *s) {
  for (uint16_t i = 0; i < RING_SERVER_ORDERS; ++i)
    if (s->orders[i].used && s->node.now_us - s->orders[i].taken_us >= ORDER_US)
      transport_cancel(&s->node.transport, i);
}

static void end_orders(struct ring_server *s) {
  struct transport_end end;
  while (ring_reports_free(&s->reports) > 0 && transport_ended(&s->node.transport, &end)) {
    if (end.tag >= RING_SERVER_ORDERS || !s->orders[end.tag].used) continue;
    s->orders[end.tag].used = false;
    tell_result(s, s->orders[end.tag].counter,
                end.outcome == TRANSPORT_IS_DELIVERED ? PROTOCOL_RING_RESULT_DELIVERED
                : end.outcome == TRANSPORT_IS_REFUSED ? PROTOCOL_RING_RESULT_REFUSED
                                                      : PROTOCOL_RING_RESULT_NOT_CONFIRMED);
  }
}

/* --- the plant network --- */

static void receive(struct ring_server *s) {
  for (int i = 0; i < DATAGRAMS_A_PASS; ++i) {
    struct ring_order order;
    bool renewed;
    const uint16_t length = plant_port_receive(s->node.board, s->datagram, sizeof s->datagram);
    if (length == 0) return;
    if (ring_reports_receive(&s->reports, s->datagram, length, &order, &renewed, s->node.now_us) ==
        RING_DATAGRAM_ORDER)
      take_order(s, &order);
    if (!renewed) continue;
    for (unsigned a = 0; a < TRANSPORT_NODES; ++a) s->nodes[a].told = s->nodes[a].told && s->nodes[a].waits;
    s->ring.told = s->ring.waits;
    s->looked_us = s->node.now_us - look_us(s);
  }
}

static void send(struct ring_server *s) {
  if (read_number(s->node.board, NODE_PLANT_STATUS, 1) & NODE_PLANT_SENDING_MASK) {
    s->due_us = UINT64_MAX; /* its end is an event */
    return;
  }
  const uint16_t length = ring_reports_make(&s->reports, s->datagram, s->status, s->node.now_us, &s->due_us);
  if (length == 0) return;
  plant_port_send(s->node.board, s->datagram, length);
  s->due_us = UINT64_MAX;
}

static uint8_t status_of(const struct ring_server *s) {
  uint8_t status = 0;
  if (s->node.fault == RING_NODE_NO_CONTROLLER || s->node.fault == RING_NODE_SETTINGS)
    status |= PROTOCOL_RING_STATUS_CONTROLLER;
  if (s->node.fault == RING_NODE_STORE) status |= PROTOCOL_RING_STATUS_STORAGE;
  if (ring_node_conflict(&s->node)) status |= PROTOCOL_RING_STATUS_CONFLICT;
  if (s->node.status[0] & NODE_RING_ALONE_MASK) status |= PROTOCOL_RING_STATUS_ALONE;
  if (ring_reports_free(&s->reports) < PARTS_OF_MESSAGE + PARTS_FOR_OTHERS)
    status |= PROTOCOL_RING_STATUS_FULL;
  if (free_orders(s) <= 1) status |= PROTOCOL_RING_STATUS_BUSY;
  return status;
}

/* Without a random number there would be tags that come again. */
static void begin_reports(struct ring_server *s) {
  uint8_t life[PROTOCOL_LIFE_BYTES] = {0};
  if (!board_random(s->node.board, life, sizeof life) || !any_byte(life, sizeof life)) return;
  ring_reports_start(&s->reports, &s->parameters.reports, life, s->node.now_us);
  s->began = true;
}

enum ring_node_fault ring_server_start(struct ring_server *s, struct board *board,
                                       const struct ring_server_parameters *parameters) {
  for (uint32_t i = 0; i < sizeof *s; ++i) ((uint8_t *)s)[i] = 0; /* too large for a literal on a stack */
  s->parameters = *parameters;
  s->parameters.node.other_events = PLANT_EVENTS;
  return ring_node_start(&s->node, board, &s->parameters.node);
}

/* A number that came again would be taken for an old one. A restart loses nothing (GW-05). */
static void restart(struct ring_server *s) {
  const struct ring_server_parameters parameters = s->parameters;
  ring_server_start(s, s->node.board, &parameters);
}

void ring_server_serve(struct ring_server *s) {
  struct board *board = s->node.board;
  if (s->began && ring_reports_ends(&s->reports)) restart(s);
  ring_node_serve(&s->node);
  ring_conflict_look(&s->conflict, &s->node);
  s->due_us = s->node.now_us + look_us(s);
  if (!s->node.began) return;
  if (!s->began) begin_reports(s);
  /* A controller that was reset has forgotten its addresses, one that runs may have those of the program
   * before. */
  s->plant_works =
      (s->plant_works && plant_port_runs(board)) || plant_port_start(board, &s->parameters.plant);
  if (!s->began || !s->plant_works) return;
  receive(s);
  end_parts(s);
  give_up_orders(s);
  end_orders(s);
  take_messages(s);
  look_at_ring(s);
  const uint8_t status = status_of(s);
  if (status != s->status) s->reports.news = true;
  s->status = status;
  send(s);
  if (s->looked_us + look_us(s) < s->due_us) s->due_us = s->looked_us + look_us(s);
  /* What the server has acknowledged is to be told to the senders. */
  ring_node_poll(&s->node);
}

void ring_server_wait(struct ring_server *s, uint32_t most_us) {
  uint64_t us = most_us;
  if (s->due_us <= s->node.now_us) us = 0;
  else if (s->due_us - s->node.now_us < us) us = s->due_us - s->node.now_us;
  ring_node_wait(&s->node, (uint32_t)us);
}

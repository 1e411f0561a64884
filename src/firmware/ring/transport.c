/* What comes is sorted, what is due is done. */
#include "internal.h"

void transport_start(struct transport *t, struct can_port *port, const struct transport_config *config,
                     uint64_t now_us) {
  for (uint32_t i = 0; i < sizeof *t; ++i) ((uint8_t *)t)[i] = 0; /* too large for a literal on a stack */
  t->port = port;
  t->config = *config;
  t->now_us = now_us;
  if (config->slots < TRANSPORT_FEWEST_SLOTS || config->slots > TRANSPORT_SLOTS)
    t->config.slots = TRANSPORT_FEWEST_SLOTS;
  receiver_start(t);
  station_start(t, now_us);
}

/* Whether code, DLC, pipe, destination and life byte fit each other. */
static bool is_control(const struct ring_id *id, const struct ring_frame *f) {
  const bool to_all = id->destination == 0;
  const bool opening = id->pipe < RING_PIPES && ((f->data[1] & RING_TO_ALL) != 0) == to_all;
  const bool answer = id->pipe < RING_PIPES && !to_all;
  if (!id->end) return false;
  switch (id->number) {
    case RING_OPEN: return opening && f->dlc == 8;
    case RING_SHORT: return opening && f->dlc >= 3;
    case RING_CLOSE: return opening && f->dlc == 2;
    case RING_DONE: return answer && f->dlc == 4 && f->data[3] <= RING_WRONG_CRC;
    case RING_MISSING: return answer && f->dlc == 8;
    case RING_BUSY: return answer && f->dlc == 3;
    case RING_UNKNOWN: return answer && f->dlc == 1 && (f->data[0] & RING_LIFE_MASK) == 0;
    case RING_HELLO: return to_all && id->pipe == 0 && f->dlc == 8;
    default: return false;
  }
}

static void control(struct transport *t, const struct ring_id *id, const struct ring_frame *f,
                    uint64_t now_us) {
  if (!is_control(id, f)) {
    count(t, TRANSPORT_MALFORMED);
    return;
  }
  switch (id->number) {
    case RING_OPEN:
    case RING_SHORT: receiver_opening(t, id, f, now_us); break;
    case RING_CLOSE: receiver_close(t, id, f->data, now_us); break;
    case RING_HELLO:
      if (life_heard(t, id->source, f->data[0] & RING_LIFE_MASK, now_us) != 0)
        station_heard(t, id->source, f->data, now_us);
      break;
    default: sender_answer(t, id, f->data, now_us);
  }
}

void transport_receive(struct transport *t, const struct ring_frame *f, uint64_t now_us) {
  const struct ring_id id = ring_id_of(f->id);
  t->now_us = now_us;
  if (id.source == 0 || id.source > RING_LAST_ADDRESS) count(t, TRANSPORT_WRONG_SOURCE);
  else if (id.source == t->config.address) count(t, TRANSPORT_OWN_ADDRESS);
  else if (id.destination != 0 && id.destination != t->config.address) count(t, TRANSPORT_FOREIGN);
  else if (f->dlc > RING_FRAME_BYTES) count(t, TRANSPORT_MALFORMED);
  else if (!id.is_data) control(t, &id, f, now_us);
  else if (id.pipe != RING_PROCESS_DATA) receiver_data(t, &id, f, now_us);
  else if (!id.end) count(t, TRANSPORT_WRONG_END);
  else station_value(t, &id, f, now_us);
}

uint64_t transport_poll(struct transport *t, uint64_t now_us) {
  t->now_us = now_us;
  uint64_t due = slots_look(t, now_us);
  answers_look(t, now_us);
  due = earlier(due, sender_poll(t, now_us));
  due = earlier(due, receiver_poll(t, now_us));
  due = earlier(due, station_poll(t, now_us));
  while (answer_queue_one(t, true) || sender_queue_one(t, true) || answer_queue_one(t, false) ||
         station_queue_one(t) || sender_queue_one(t, false)) {
  }
  return earlier(due, slots_hold(t));
}

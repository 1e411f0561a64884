/* The frames that wait in the port: each once (TP-06). */
#include "internal.h"

/* What waits for so long is of no use when it leaves at last. */
enum { STALE_US = 1000000, STALE_BITS = 20000, STALE_PD = 3 };

/* While answers wait, data frames are held back and go free in turn, each for so long: half of the time after
 * which a receiver that hears nothing drops a message. */
enum { HOLD_US = 100000, HOLD_BITS = 10000 };

enum { DATA_LEAVE = 3, VALUES_LEAVE = 4 }; /* places in the port: to other frames (TB-04, TB-34) */

/* Half of the time after which a message of which no frame leaves ends. If it were shorter, nodes that fill
 * the bus together would send more to low addresses, and less to high ones would be confirmed (TB-23). */
enum { STUCK_US = 5000000 };

bool slot_waits(const struct transport *t, uint32_t id) {
  for (uint8_t i = 0; i < t->slot_count; ++i)
    if (t->slots[i].frame.id == id) return true;
  return false;
}

/* Those that a sender of messages has made, not answers. The port is asked, since what has left may not have
 * been looked at yet. */
bool slot_waits_of(const struct transport *t, uint8_t destination, uint8_t pipe) {
  for (uint8_t i = 0; i < t->slot_count; ++i) {
    const struct ring_id id = ring_id_of(t->slots[i].frame.id);
    if (id.destination == destination && id.pipe == pipe && (id.is_data || id.number <= RING_CLOSE) &&
        can_port_waits(t->port, t->slots[i].frame.id))
      return true;
  }
  return false;
}

static bool is_value(const struct ring_id *id) { return id->is_data && id->pipe == RING_PROCESS_DATA; }

static uint32_t hold_us(const struct transport *t) { return time_or_bits(t, HOLD_US, HOLD_BITS); }

/* How many of its times have passed: data frames are held back in the first one, go free in the second. */
static uint64_t holds_since(const struct transport *t) { return (t->now_us - t->held_from) / hold_us(t); }

static bool is_answer(const struct ring_id *id) {
  return !id->is_data && id->number >= RING_DONE && id->number <= RING_UNKNOWN;
}

/* There are times for answers and values, and times for data frames. */
static bool is_time_of_data(const struct transport *t) {
  return (t->holds ? holds_since(t) : t->now_us / hold_us(t)) % 2 != 0;
}

/* All data frames that wait are to other destinations, and have not left for so long. */
static bool others_are_stuck(const struct transport *t, uint8_t destination) {
  for (uint8_t i = 0; i < t->slot_count; ++i) {
    const struct ring_id id = ring_id_of(t->slots[i].frame.id);
    if (!id.is_data || is_value(&id)) continue;
    if (id.destination == destination || t->now_us < t->slots[i].put_at + STUCK_US) return false;
  }
  return true;
}

static unsigned waiting_values(const struct transport *t) {
  unsigned sum = 0;
  for (uint8_t i = 0; i < t->slot_count; ++i) {
    const struct ring_id id = ring_id_of(t->slots[i].frame.id);
    sum += is_value(&id);
  }
  return sum;
}

/* Where other nodes fill the bus, frames to high addresses do not leave. One place more is there for values,
 * and for a data frame while those to other destinations do not leave, in turn (TB-34). */
static bool has_one_more(const struct transport *t, const struct ring_id *id) {
  if (is_value(id)) return !is_time_of_data(t);
  return is_time_of_data(t) && others_are_stuck(t, id->destination);
}

/* Everything leaves a place for what is urgent, data frames leave two more for what must not wait behind
 * them, urgent ones one. */
static bool has_place(const struct transport *t, const struct ring_id *id) {
  const unsigned places = t->config.slots;
  unsigned left = id->urgent ? 0 : 1;
  if (id->is_data) left += (id->urgent ? 1u : 2u) - (has_one_more(t, id) ? 1u : 0u);
  return t->slot_count + left < places && (!is_value(id) || waiting_values(t) < places - VALUES_LEAVE);
}

/* A data frame that would leave before an answer that waits: a long message to a low address would keep it
 * from leaving. OPEN is held with its data: they would be taken for sent, and be asked for (TB-30). */
static bool is_held(const struct transport *t, const struct ring_id *id) {
  if (is_value(id) || (!id->is_data && id->number != RING_OPEN)) return false;
  if (!t->holds || is_time_of_data(t)) return false;
  for (uint8_t i = 0; i < t->slot_count; ++i) {
    const struct ring_id other = ring_id_of(t->slots[i].frame.id);
    if (is_answer(&other) && other.urgent == id->urgent && id->destination < other.destination) return true;
  }
  return false;
}

bool slot_put(struct transport *t, const struct ring_frame *frame) {
  const struct ring_id id = ring_id_of(frame->id);
  if (!has_place(t, &id) || is_held(t, &id) || !can_port_send(t->port, frame)) return false;
  t->slots[t->slot_count++] = (struct transport_slot){t->now_us, *frame};
  if (is_answer(&id) && !t->holds) {
    t->holds = true;
    t->held_from = t->now_us;
  }
  return true;
}

/* Judged when all has been put: where one answer follows another the times go on. */
uint64_t slots_hold(struct transport *t) {
  bool waits = false;
  for (uint8_t i = 0; i < t->slot_count; ++i) {
    const struct ring_id id = ring_id_of(t->slots[i].frame.id);
    waits |= is_answer(&id);
  }
  t->holds = waits;
  if (waits) return t->held_from + (holds_since(t) + 1) * hold_us(t);
  if (t->slot_count + DATA_LEAVE < t->config.slots) return UINT64_MAX;
  return (t->now_us / hold_us(t) + 1) * hold_us(t);
}

uint64_t stale_at(const struct transport *t, uint32_t id_word, uint64_t put_at) {
  const struct ring_id id = ring_id_of(id_word);
  const uint32_t value_us = (uint32_t)t->config.pd_ms * STALE_PD * US_IN_MS;
  return put_at + time_or_bits(t, is_value(&id) ? value_us : STALE_US, STALE_BITS);
}

uint64_t slots_look(struct transport *t, uint64_t now_us) {
  uint64_t due = UINT64_MAX;
  uint8_t kept = 0;
  for (uint8_t i = 0; i < t->slot_count; ++i) {
    const struct transport_slot slot = t->slots[i];
    const struct ring_id id = ring_id_of(slot.frame.id);
    if (!can_port_waits(t->port, slot.frame.id)) {
      sender_left(t, &id, now_us);
      continue;
    }
    t->slots[kept++] = slot;
    if (sender_has(t, &id)) continue; /* for 10 s at most, then the message has ended */
    const uint64_t end = stale_at(t, slot.frame.id, slot.put_at);
    if (now_us < end) {
      due = earlier(due, end);
      continue;
    }
    can_port_abort(t->port, slot.frame.id);
    if (!id.is_data && id.number == RING_HELLO) t->hello_due = true; /* a new one goes instead */
  }
  t->slot_count = kept;
  return due;
}

struct ring_frame control_frame(const struct transport *t, bool urgent, uint8_t destination,
                                enum ring_code code, uint8_t pipe, uint8_t dlc) {
  const struct ring_id id = {urgent, destination, false, t->config.address, (uint8_t)code, pipe, true};
  return (struct ring_frame){.id = ring_id_word(&id), .dlc = dlc};
}

/* The sending side: pipes, and messages under way in turn (TP-01, TP-02, TP-05, TP-31). */
#include "internal.h"

enum {
  MOST_ANSWERS = 200, /* of each member */
  MOST_UNHEARD = 100  /* numbers of a pipe: of 127 the last one still counts as newer */
};

static struct transport_outgoing *of_pipe(struct transport *t, uint8_t destination, uint8_t pipe) {
  for (uint8_t i = 0; i < TRANSPORT_OUTGOING; ++i) {
    struct transport_outgoing *m = &t->outgoing[i];
    if (m->used && !m->over && m->destination == destination && m->pipe == pipe) return m;
  }
  return 0;
}

static uint16_t seconds(uint64_t now_us) { return (uint16_t)(now_us / US_IN_S); }

/* Whether so many numbers were used that a receiver which has heard of none could take the next one for an
 * older one, or for the last one again. */
static bool is_used_up(const struct transport *t, uint8_t destination, uint8_t pipe) {
  return t->unheard[destination][pipe] >= MOST_UNHEARD;
}

/* All receivers have forgotten a pipe of which nothing has come for so long; their clocks may be slower. */
static uint16_t rest_s(const struct transport *t) { return (uint16_t)(forget_pipe_s(t) * 11 / 10); }

static bool rests(const struct transport *t, uint8_t destination, uint8_t pipe, uint64_t now_us) {
  return is_used_up(t, destination, pipe) &&
         (uint16_t)(seconds(now_us) - t->left_s[destination][pipe]) < rest_s(t);
}

/* The lowest free pipe, or RING_PIPES; the last one is for urgent messages only. One of which a frame still
 * waits is not free: that frame would get into the next message. */
static uint8_t free_pipe(struct transport *t, uint8_t destination, bool urgent, uint64_t now_us) {
  const uint8_t end = urgent ? RING_PIPES : RING_PIPES - 1;
  uint8_t pipe = 0;
  while (pipe < end && (of_pipe(t, destination, pipe) || slot_waits_of(t, destination, pipe) ||
                        rests(t, destination, pipe, now_us)))
    ++pipe;
  return pipe < end ? pipe : RING_PIPES;
}

/* A number of a pipe is used. A message to all counts whatever is answered: others may not have heard it. */
static uint8_t take_number(struct transport *t, uint8_t destination, uint8_t pipe, uint64_t now_us) {
  if (is_used_up(t, destination, pipe)) t->unheard[destination][pipe] = 0; /* it has rested */
  ++t->unheard[destination][pipe];
  t->left_s[destination][pipe] = seconds(now_us);
  return t->numbers[destination][pipe]++;
}

static struct transport_outgoing *free_place(struct transport *t, bool urgent) {
  struct transport_outgoing *place = 0;
  uint8_t free = 0;
  for (uint8_t i = 0; i < TRANSPORT_OUTGOING; ++i) {
    if (t->outgoing[i].used) continue;
    if (free++ == 0) place = &t->outgoing[i];
  }
  return free > (urgent ? 0 : 1) ? place : 0;
}

bool transport_send(struct transport *t, uint16_t tag, uint8_t destination, bool urgent, const uint8_t *data,
                    uint16_t length, const uint8_t *members, uint64_t now_us) {
  if (t->port == 0 || destination > RING_LAST_ADDRESS || destination == t->config.address) return false;
  if (length == 0 || length > TRANSPORT_MESSAGE_BYTES) return false;
  const uint8_t pipe = free_pipe(t, destination, urgent, now_us);
  struct transport_outgoing *m = free_place(t, urgent);
  if (pipe == RING_PIPES || m == 0) return false;
  *m = (struct transport_outgoing){.used = true,
                                   .urgent = urgent,
                                   .open = true,
                                   .destination = destination,
                                   .pipe = pipe,
                                   .number = take_number(t, destination, pipe, now_us),
                                   .tag = tag,
                                   .length = length,
                                   .crc = ring_crc32(data, length),
                                   .data = data,
                                   .restarted_at = now_us,
                                   .left_at = now_us,
                                   .progress_at = now_us};
  if (length > TRANSPORT_SHORT_BYTES)
    for (unsigned i = 0; RING_FRAME_BYTES * i < length; ++i) set_bit(m->todo, i);
  if (destination != 0) set_bit(m->awaited, destination);
  else if (members != 0) copy_bytes(m->awaited, members, TRANSPORT_MAP_BYTES);
  else transport_members(t, m->awaited, now_us);
  clear_bit(m->awaited, t->config.address);
  copy_bytes(m->unconfirmed, m->awaited, TRANSPORT_MAP_BYTES);
  for (unsigned a = 0; a < TRANSPORT_NODES; ++a) {
    if (bit_of(m->awaited, a)) m->most_answers += MOST_ANSWERS;
    /* Nodes answer whether they are awaited or not. */
    if (destination == 0 && (bit_of(m->awaited, a) || t->member[a])) ++m->answering;
  }
  return true;
}

void transport_cancel(struct transport *t, uint16_t tag) {
  for (uint8_t i = 0; i < TRANSPORT_OUTGOING; ++i)
    if (t->outgoing[i].used && t->outgoing[i].tag == tag) t->outgoing[i].closing = true;
}

bool transport_ended(struct transport *t, struct transport_end *end) {
  for (uint8_t i = 0; i < TRANSPORT_OUTGOING; ++i) {
    struct transport_outgoing *m = &t->outgoing[i];
    if (!m->used || !m->over) continue;
    end->tag = m->tag;
    end->outcome = m->outcome;
    copy_bytes(end->unconfirmed, m->unconfirmed, TRANSPORT_MAP_BYTES);
    m->used = false;
    return true;
  }
  return false;
}

static bool is_of_message(const struct ring_id *id) {
  return id->pipe != RING_PROCESS_DATA && (id->is_data || id->number <= RING_CLOSE);
}

bool sender_has(struct transport *t, const struct ring_id *id) {
  return is_of_message(id) && of_pipe(t, id->destination, id->pipe) != 0;
}

void sender_left(struct transport *t, const struct ring_id *id, uint64_t now_us) {
  if (!is_of_message(id)) return;
  struct transport_outgoing *m = of_pipe(t, id->destination, id->pipe);
  t->left_s[id->destination][id->pipe] = seconds(now_us);
  if (m != 0) outgoing_left(m, now_us);
}

void sender_answer(struct transport *t, const struct ring_id *id, const uint8_t *bytes, uint64_t now_us) {
  const uint8_t life = id->number == RING_UNKNOWN ? bytes[0] : bytes[1];
  const uint8_t destination = (life & RING_TO_ALL) != 0 ? 0 : id->source;
  struct transport_outgoing *m = of_pipe(t, destination, id->pipe);
  if (m == 0) count(t, TRANSPORT_UNEXPECTED);
  else outgoing_answer(t, m, id->source, (enum ring_code)id->number, bytes, now_us);
}

/* One frame of the message whose turn it is. */
bool sender_queue_one(struct transport *t, bool urgent) {
  for (uint8_t i = 0; i < TRANSPORT_OUTGOING; ++i) {
    const uint8_t place = (uint8_t)((t->turn[urgent] + i) % TRANSPORT_OUTGOING);
    struct transport_outgoing *m = &t->outgoing[place];
    struct ring_frame frame;
    if (!m->used || m->over || m->urgent != urgent) continue;
    if (!outgoing_next(t, m, &frame) || !slot_put(t, &frame)) continue;
    outgoing_sent(m);
    t->turn[urgent] = (uint8_t)(place + 1);
    return true;
  }
  return false;
}

uint64_t sender_poll(struct transport *t, uint64_t now_us) {
  uint64_t due = UINT64_MAX;
  for (uint8_t i = 0; i < TRANSPORT_OUTGOING; ++i)
    if (t->outgoing[i].used && !t->outgoing[i].over)
      due = earlier(due, outgoing_poll(t, &t->outgoing[i], now_us));
  return due;
}

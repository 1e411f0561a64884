/* The receiving side: pipes and buffers (TP-21 to TP-25, TP-30, TP-32). */
#include "internal.h"

enum {
  GAP_US = 20000, /* T_gap, or so many bits: a turn of all messages of a sender takes less */
  GAP_BITS = 4000,
  GAPS = 10 /* in a row, after which a message is dropped */
};

void receiver_start(struct transport *t) {
  for (unsigned i = 0; i < TRANSPORT_PLACES; ++i)
    t->incoming[i].data = i < TRANSPORT_BUFFERS ? t->buffers[i] : t->shorts[i - TRANSPORT_BUFFERS];
}

/* The message that a pipe has, open or waiting for the host. */
struct transport_incoming *receiver_find(struct transport *t, uint8_t source, bool to_all, uint8_t pipe) {
  for (unsigned i = 0; i < TRANSPORT_PLACES; ++i) {
    struct transport_incoming *m = &t->incoming[i];
    if (m->state != INCOMING_FREE && !m->detached && m->message.source == source &&
        m->message.to_all == to_all && m->message.pipe == pipe)
      return m;
  }
  return 0;
}

void receiver_drop(struct transport *t, struct transport_incoming *m) {
  count(t, TRANSPORT_DROPPED);
  m->state = INCOMING_FREE;
}

static struct transport_pipe *pipe_of(struct transport *t, const struct transport_message *m) {
  return &t->pipes[m->source][m->to_all ? 1 : 0][m->pipe];
}

/* For a message: the last place for short ones is left to urgent ones (TB-35). */
static struct transport_incoming *free_place(struct transport *t, bool is_short, bool urgent) {
  const unsigned end = is_short ? TRANSPORT_PLACES : TRANSPORT_BUFFERS;
  struct transport_incoming *place = 0;
  unsigned kept = is_short && !urgent ? 1 : 0;
  for (unsigned i = is_short ? TRANSPORT_BUFFERS : 0; i < end && place == 0; ++i)
    if (t->incoming[i].state == INCOMING_FREE && kept-- == 0) place = &t->incoming[i];
  return place;
}

static void forget_frames(struct transport_incoming *m) {
  for (unsigned i = 0; i < sizeof m->bitmap; ++i) m->bitmap[i] = 0;
  m->received = m->sent = 0;
  m->highest = -1;
}

static void hears(struct transport_incoming *m, uint64_t now_us) {
  m->heard_at = now_us;
  m->gaps = 0;
}

static void complete(struct transport *t, struct transport_incoming *m) {
  m->state = INCOMING_COMPLETE;
  m->order = t->order++;
  pipe_of(t, &m->message)->seen = true;
}

static void begin(struct transport *t, const struct transport_message *message, uint32_t crc,
                  const struct ring_frame *f, uint64_t now_us) {
  const bool is_short = message->length <= TRANSPORT_SHORT_BYTES;
  struct transport_incoming *m = free_place(t, is_short, message->urgent);
  if (m == 0) {
    count(t, TRANSPORT_NO_BUFFER);
    reply_busy(t, message, t->sources[message->source].life);
    return;
  }
  m->state = INCOMING_OPEN;
  m->held = m->detached = m->passed = false;
  m->parts = (uint16_t)((message->length + RING_FRAME_BYTES - 1) / RING_FRAME_BYTES);
  m->crc = crc;
  m->message = *message;
  m->message.repeat = !pipe_of(t, message)->seen;
  m->message.data = m->data;
  forget_frames(m);
  m->opened = true;
  hears(m, now_us);
  if (is_short) {
    copy_bytes(m->data, f->data + 2, message->length);
    complete(t, m);
  }
}

static bool is_older(uint8_t number, uint8_t than) { return (uint8_t)(number - than) > 127; }

/* Older than what the pipe has had last, or has now. */
static bool is_past(const struct transport_pipe *pipe, const struct transport_incoming *m, uint8_t number) {
  return (pipe->has_last && is_older(number, pipe->last)) ||
         (m != 0 && !m->passed && is_older(number, m->message.number));
}

static bool is_this(const struct transport_incoming *m, uint8_t number) {
  return m != 0 && !m->passed && m->message.number == number;
}

static void hears_pipe(struct transport_pipe *pipe, uint64_t now_us) {
  pipe->heard_s = (uint32_t)(now_us / US_IN_S);
}

/* Its last number is forgotten when nothing comes for long: its sender relies on that when it has used up the
 * numbers that count as newer (TB-26). */
static void forget_old(const struct transport *t, struct transport_pipe *pipe, struct transport_incoming *m,
                       uint64_t now_us) {
  if ((uint32_t)(now_us / US_IN_S) - pipe->heard_s < forget_pipe_s(t)) return;
  pipe->has_last = false;
  if (m != 0) m->passed = true;
}

/* A sender has one message of a pipe under way: all before this one have ended, whatever they were. Without
 * this 128 of them would make the next ones look old while one waits for the host, or no buffer is free. */
static void pass_to(struct transport_pipe *pipe, struct transport_incoming *m, uint8_t number) {
  const uint8_t before = (uint8_t)(number - 1);
  if (m == 0 && !pipe->has_last) return;
  if (m != 0) m->passed = true;
  if (pipe->has_last && pipe->last == before) return;
  pipe->has_last = pipe->refused = true;
  pipe->last = before;
}

/* OPEN and SHORT (TP-21). */
void receiver_opening(struct transport *t, const struct ring_id *id, const struct ring_frame *f,
                      uint64_t now_us) {
  const bool is_short = id->number == RING_SHORT;
  const uint32_t length = is_short ? f->dlc - 2u : get_number(f->data + 2, 2) + 1;
  if (!is_short && (length <= TRANSPORT_SHORT_BYTES || length > TRANSPORT_MESSAGE_BYTES)) {
    count(t, TRANSPORT_WRONG_LENGTH);
    return;
  }
  const uint8_t life = f->data[1] & RING_LIFE_MASK;
  if (life_heard(t, id->source, life, now_us) == 0) return;
  const struct transport_message message = {.source = id->source,
                                            .pipe = id->pipe,
                                            .number = f->data[0],
                                            .life = life,
                                            .to_all = id->destination == 0,
                                            .urgent = id->urgent,
                                            .length = (uint16_t)length};
  const uint32_t crc = is_short ? 0 : get_number(f->data + 4, 4);
  struct transport_pipe *pipe = pipe_of(t, &message);
  struct transport_incoming *m = receiver_find(t, id->source, message.to_all, id->pipe);
  forget_old(t, pipe, m, now_us);
  const bool is_last = pipe->has_last && pipe->last == message.number;
  if (!is_last && is_past(pipe, m, message.number)) {
    count(t, TRANSPORT_OLD_NUMBER);
    return;
  }
  hears_pipe(pipe, now_us);
  if (is_last) {
    reply_done(t, &message, life, pipe->refused ? RING_REFUSED : RING_DELIVERED);
    return;
  }
  const bool same = is_this(m, message.number);
  if (!same) pass_to(pipe, m, message.number);
  if (m != 0 && m->state == INCOMING_COMPLETE) {
    reply_busy(t, &message, life); /* until the host has taken it */
  } else if (same && m->message.length == length && m->crc == crc) {
    m->opened = true;
    hears(m, now_us);
  } else {
    if (m != 0) receiver_drop(t, m);
    begin(t, &message, crc, f, now_us);
  }
}

void receiver_close(struct transport *t, const struct ring_id *id, const uint8_t *bytes, uint64_t now_us) {
  if (life_heard(t, id->source, bytes[1] & RING_LIFE_MASK, now_us) == 0) return;
  const uint8_t number = bytes[0];
  struct transport_pipe *pipe = &t->pipes[id->source][id->destination == 0 ? 1 : 0][id->pipe];
  struct transport_incoming *m = receiver_find(t, id->source, id->destination == 0, id->pipe);
  forget_old(t, pipe, m, now_us);
  if (is_past(pipe, m, number) || (pipe->has_last && pipe->last == number) ||
      (is_this(m, number) && m->state == INCOMING_COMPLETE)) {
    count(t, TRANSPORT_UNEXPECTED);
    return;
  }
  hears_pipe(pipe, now_us);
  if (m != 0 && m->state == INCOMING_OPEN) receiver_drop(t, m);
  else if (m != 0) m->passed = true;
  pipe->has_last = pipe->refused = true;
  pipe->last = number;
}

static uint8_t part_length(const struct transport_incoming *m, uint8_t part) {
  return part == m->parts - 1 ? (uint8_t)(m->message.length - RING_FRAME_BYTES * (m->parts - 1))
                              : RING_FRAME_BYTES;
}

/* A data frame of a message that is whole now. */
static void whole(struct transport *t, struct transport_incoming *m, uint8_t life) {
  if (ring_crc32(m->data, m->message.length) == m->crc) {
    complete(t, m);
    return;
  }
  count(t, TRANSPORT_BAD_CRC);
  forget_frames(m);
  reply_done(t, &m->message, life, RING_WRONG_CRC);
}

void receiver_data(struct transport *t, const struct ring_id *id, const struct ring_frame *f,
                   uint64_t now_us) {
  struct transport_source *s = life_known(t, id->source, now_us);
  struct transport_incoming *m = receiver_find(t, id->source, id->destination == 0, id->pipe);
  struct transport_pipe *pipe = &t->pipes[id->source][id->destination == 0 ? 1 : 0][id->pipe];
  forget_old(t, pipe, m, now_us);
  hears_pipe(pipe, now_us); /* whatever it is good for: its sender counts what has left */
  if (m == 0) {
    count(t, TRANSPORT_NO_MESSAGE);
    reply_no_message(t, id, s, now_us);
  } else if (m->state == INCOMING_COMPLETE) {
    count(t, TRANSPORT_DOUBLE);
  } else if (id->number >= m->parts) {
    count(t, TRANSPORT_TOO_HIGH);
  } else if (id->end != (id->number == m->parts - 1)) {
    count(t, TRANSPORT_WRONG_END);
  } else if (f->dlc != part_length(m, id->number)) {
    count(t, TRANSPORT_WRONG_DLC);
  } else if (bit_of(m->bitmap, id->number)) {
    count(t, TRANSPORT_DOUBLE);
  } else {
    s->heard_at = now_us;
    m->opened = false;
    if (id->number >= m->sent) m->sent = (uint16_t)(id->number + 1u);
    set_bit(m->bitmap, id->number);
    copy_bytes(m->data + RING_FRAME_BYTES * id->number, f->data, f->dlc);
    hears(m, now_us);
    if (++m->received == m->parts) whole(t, m, s->life);
    else if (id->end || id->number == m->highest) reply_missing(t, m, s->life);
  }
}

uint64_t receiver_poll(struct transport *t, uint64_t now_us) {
  const uint64_t gap_us = time_or_bits(t, GAP_US, GAP_BITS);
  uint64_t due = UINT64_MAX;
  for (unsigned i = 0; i < TRANSPORT_PLACES; ++i) {
    struct transport_incoming *m = &t->incoming[i];
    if (m->state != INCOMING_OPEN) continue;
    if (now_us >= m->heard_at + gap_us) {
      m->heard_at = now_us;
      if (++m->gaps == GAPS) {
        receiver_drop(t, m);
        continue;
      }
      /* Its sender sends nothing behind OPEN: it has sent all, or has found the receiver busy. */
      if (m->opened) m->sent = m->parts;
      reply_missing(t, m, t->sources[m->message.source].life);
    }
    due = earlier(due, m->heard_at + gap_us);
  }
  return due;
}

const struct transport_message *transport_received(const struct transport *t) {
  const struct transport_incoming *first = 0;
  for (unsigned i = 0; i < TRANSPORT_PLACES; ++i) {
    const struct transport_incoming *m = &t->incoming[i];
    if (m->state != INCOMING_COMPLETE || m->held) continue;
    if (first == 0 || (m->message.urgent != first->message.urgent ? m->message.urgent
                                                                  : (int32_t)(m->order - first->order) < 0))
      first = m;
  }
  return first == 0 ? 0 : &first->message;
}

void transport_hold(struct transport *t, const struct transport_message *message) {
  for (unsigned i = 0; i < TRANSPORT_PLACES; ++i)
    if (&t->incoming[i].message == message) t->incoming[i].held = true;
}

void transport_take(struct transport *t, const struct transport_message *message, bool refuse) {
  for (unsigned i = 0; i < TRANSPORT_PLACES; ++i) {
    struct transport_incoming *m = &t->incoming[i];
    if (&m->message != message || m->state != INCOMING_COMPLETE) continue;
    struct transport_pipe *pipe = pipe_of(t, message);
    life_known(t, message->source, t->now_us);
    forget_old(t, pipe, m, t->now_us);
    m->state = INCOMING_FREE;
    /* Its sender would take DONE for that of another message, 256 later. */
    if (m->detached || m->passed) return;
    pipe->has_last = true;
    pipe->last = message->number;
    pipe->refused = refuse;
    reply_done(t, message, t->sources[message->source].life, refuse ? RING_REFUSED : RING_DELIVERED);
  }
}

/* A message under way at its sender (TP-03, TP-04, TP-10 to TP-13). */
#include "internal.h"

enum {
  RESTART_US = 10000, /* from OPEN on again at most so often */
  TRIES = 10,         /* without any answer */
  ANSWER_BITS = 5000, /* T_answer */
  MEMBER_BITS = 250,  /* more of it for each node that answers a message to all: its answer, and a HELLO */
  ANSWER_BITS_MOST = 50000,
  BUSY_UNIT_US = 10000,
  BUSY_BITS = 20000, /* a wait does not grow beyond that */
  BUSY_MEMBER_BITS = 750, /* of a message to all: six times what the answer of a node takes */
  BUSY_DOUBLES = 4,       /* up to sixteen times as long */
  BUSY_ALL_US = 5000000,  /* at most, or so many bits */
  BUSY_ALL_BITS = 100000,
  MAP_FRAMES = 40 /* that a MISSING names */
};
#define STALL_US 10000000u /* without an answer and without a frame that leaves */

static bool is_short(const struct transport_outgoing *m) { return m->length <= TRANSPORT_SHORT_BYTES; }

static unsigned parts_of(const struct transport_outgoing *m) {
  return is_short(m) ? 0 : (m->length + RING_FRAME_BYTES - 1u) / RING_FRAME_BYTES;
}

static uint8_t life_byte(const struct transport *t, const struct transport_outgoing *m) {
  return (uint8_t)(t->config.life | (m->destination == 0 ? RING_TO_ALL : 0));
}

static void end_with(struct transport_outgoing *m, enum transport_outcome outcome) {
  m->over = true;
  m->outcome = outcome;
}

void outgoing_left(struct transport_outgoing *m, uint64_t now_us) { m->left_at = m->progress_at = now_us; }

static struct ring_frame opening(const struct transport *t, const struct transport_outgoing *m) {
  struct ring_frame f = control_frame(t, m->urgent, m->destination, is_short(m) ? RING_SHORT : RING_OPEN,
                                      m->pipe, is_short(m) ? (uint8_t)(2 + m->length) : 8);
  f.data[0] = m->number;
  f.data[1] = life_byte(t, m);
  if (is_short(m)) {
    copy_bytes(f.data + 2, m->data, m->length);
  } else {
    put_number(f.data + 2, m->length - 1u, 2);
    put_number(f.data + 4, m->crc, 4);
  }
  return f;
}

static struct ring_frame part(const struct transport *t, const struct transport_outgoing *m, unsigned i) {
  const bool last = i == parts_of(m) - 1;
  const struct ring_id id = {m->urgent, m->destination, true, t->config.address, (uint8_t)i, m->pipe, last};
  struct ring_frame f = {.id = ring_id_word(&id), .dlc = RING_FRAME_BYTES};
  if (last) f.dlc = (uint8_t)(m->length - RING_FRAME_BYTES * i);
  copy_bytes(f.data, m->data + RING_FRAME_BYTES * i, f.dlc);
  return f;
}

static int first_todo(const struct transport_outgoing *m) {
  for (unsigned i = 0; i < parts_of(m); ++i)
    if (bit_of(m->todo, i)) return (int)i;
  return -1;
}

/* What still waits in the port is not sent once more (TP-06). */
bool outgoing_next(const struct transport *t, struct transport_outgoing *m, struct ring_frame *frame) {
  if (m->closing) {
    *frame = control_frame(t, m->urgent, m->destination, RING_CLOSE, m->pipe, 2);
    frame->data[0] = m->number;
    frame->data[1] = life_byte(t, m);
    return true;
  }
  if (m->waits && m->destination != 0) return false;
  if (m->open) {
    *frame = opening(t, m);
    if (!slot_waits(t, frame->id)) return true;
    m->open = false;
  }
  for (int i = first_todo(m); i >= 0; i = first_todo(m)) {
    *frame = part(t, m, (unsigned)i);
    if (!slot_waits(t, frame->id)) return true;
    clear_bit(m->todo, (unsigned)i);
  }
  return false;
}

/* The frame of `outgoing_next` was put into the port. */
void outgoing_sent(struct transport_outgoing *m) {
  if (m->closing) end_with(m, TRANSPORT_NOT_CONFIRMED);
  else if (m->open) m->open = false;
  else clear_bit(m->todo, (unsigned)first_todo(m));
}

/* T_answer, twice as long after each try: frames to lower addresses, this node's own ones too, go before the
 * answers, and each try makes more of them. */
static uint64_t answer_us(const struct transport *t, const struct transport_outgoing *m) {
  uint32_t bits = ANSWER_BITS + (uint32_t)m->answering * MEMBER_BITS;
  for (uint8_t i = 0; i < m->tries && bits < ANSWER_BITS_MOST; ++i)
    bits = 2 * bits < ANSWER_BITS_MOST ? 2 * bits : ANSWER_BITS_MOST;
  return time_or_bits(t, 50000, bits);
}

/* A message of which no answer comes ends after so long. */
static uint64_t unheard_us(const struct transport *t) {
  return forget_pipe_s(t) * (uint64_t)US_IN_S / 4 * 3;
}

uint64_t outgoing_poll(const struct transport *t, struct transport_outgoing *m, uint64_t now_us) {
  if (m->waits && m->closing) { /* CLOSE waits for nothing */
    m->waits = false;
    m->progress_at = now_us;
  }
  if (m->waits && now_us < m->wait_end) return m->wait_end;
  if (m->waits) {
    m->waits = false;
    if (m->waited < UINT8_MAX) ++m->waited;
    m->open = true;
    m->progress_at = now_us;
  }
  /* Asked for too long, whatever its frames do: its receiver must not have forgotten it (TB-26). */
  const uint64_t asked_end = m->went_out ? m->asked_from + unheard_us(t) : UINT64_MAX;
  if (m->closing || m->open || first_todo(m) >= 0 || slot_waits_of(t, m->destination, m->pipe)) {
    const uint64_t stalled_at = earlier(m->progress_at + STALL_US, asked_end);
    if (now_us >= stalled_at) end_with(m, TRANSPORT_NOT_CONFIRMED);
    return stalled_at;
  }
  /* Everything has left: the answers of those that are awaited are missing. */
  if (!m->went_out) m->asked_from = now_us;
  m->went_out = true;
  if (!any_byte(m->awaited, TRANSPORT_MAP_BYTES)) {
    end_with(m, TRANSPORT_NOT_CONFIRMED); /* nobody is there who could */
    return UINT64_MAX;
  }
  const uint64_t answer_end = m->left_at + answer_us(t, m);
  if (now_us < answer_end) return answer_end;
  m->left_at = m->progress_at = now_us;
  if (++m->tries == TRIES) m->closing = true;
  else m->open = true;
  return earlier(now_us + STALL_US, m->asked_from + unheard_us(t));
}

static void heard(struct transport_outgoing *m, uint64_t now_us) {
  m->tries = 0;
  m->asked_from = m->progress_at = now_us;
}

/* After answers something is sent again, but not for ever. */
static void again(struct transport_outgoing *m) {
  if (++m->answers >= m->most_answers) m->closing = true;
}

static void from_open_on(struct transport_outgoing *m, uint64_t now_us) {
  again(m);
  m->waits = false;
  m->open = true;
  m->restarted_at = now_us;
  for (unsigned i = 0; i < parts_of(m); ++i) set_bit(m->todo, i);
}

static void done(struct transport_outgoing *m, uint8_t from, uint8_t result, uint64_t now_us) {
  heard(m, now_us);
  if (result == RING_WRONG_CRC) {
    from_open_on(m, now_us);
    return;
  }
  clear_bit(m->awaited, from);
  if (result == RING_DELIVERED) clear_bit(m->unconfirmed, from);
  if (any_byte(m->awaited, TRANSPORT_MAP_BYTES)) return;
  end_with(m, any_byte(m->unconfirmed, TRANSPORT_MAP_BYTES) ? TRANSPORT_IS_REFUSED : TRANSPORT_IS_DELIVERED);
}

/* What a BUSY names, twice as much for each wait that has passed: many messages that wait for a receiver
 * which is busy for long would fill a slow bus with OPEN and BUSY. */
static uint64_t wait_us(const struct transport *t, const struct transport_outgoing *m, uint8_t named) {
  const uint64_t most = time_or_bits(t, 0, BUSY_BITS);
  uint64_t us = (uint64_t)(named == 0 ? 1 : named) * BUSY_UNIT_US;
  for (uint8_t i = 0; i < m->waited && us < most; ++i) us = earlier(2 * us, most);
  return us;
}

/* Of a message to all: each OPEN lets those answer again that have it already. MISSING of others comes T_gap
 * behind OPEN, and so between two of them. */
static uint64_t wait_all_us(const struct transport *t, const struct transport_outgoing *m) {
  const uint8_t doubles = m->waited < BUSY_DOUBLES ? m->waited : BUSY_DOUBLES;
  const uint64_t us = time_or_bits(t, 0, ((uint32_t)m->answering * BUSY_MEMBER_BITS) << doubles);
  const uint64_t most = time_or_bits(t, BUSY_ALL_US, BUSY_ALL_BITS);
  const uint64_t least = answer_us(t, m);
  return earlier(us, most) > least ? earlier(us, most) : least;
}

/* Of a message to all, those that are not busy get what they miss meanwhile. */
static void busy(const struct transport *t, struct transport_outgoing *m, uint8_t wait, uint64_t now_us) {
  heard(m, now_us);
  uint64_t us = wait_us(t, m, wait);
  if (m->destination == 0 && us < wait_all_us(t, m)) us = wait_all_us(t, m);
  if (!m->waits || now_us + us > m->wait_end) m->wait_end = now_us + us;
  m->waits = true;
  m->open = false;
  if (m->destination == 0) return;
  for (unsigned i = 0; i < sizeof m->todo; ++i) m->todo[i] = 0;
}

static void missing(struct transport *t, struct transport_outgoing *m, const uint8_t *bytes,
                    uint64_t now_us) {
  const uint8_t *map = bytes + 3; /* bit 7 of the first byte is the first frame */
  const unsigned first = bytes[2];
  unsigned behind = 0; /* the highest frame named, plus one */
  for (unsigned i = 0; i < MAP_FRAMES; ++i)
    if ((map[i / 8] << i % 8 & 0x80) != 0) behind = first + i + 1;
  if (behind == 0 || behind > parts_of(m)) {
    count(t, TRANSPORT_BEYOND_END);
    return;
  }
  heard(m, now_us);
  m->waited = 0; /* it was taken up */
  if (m->waits && m->destination != 0) return;
  again(m);
  for (unsigned i = 0; first + i < behind; ++i)
    if ((map[i / 8] << i % 8 & 0x80) != 0) set_bit(m->todo, first + i);
}

/* OPEN was lost: data frames found no open message. */
static void unknown(struct transport_outgoing *m, uint64_t now_us) {
  heard(m, now_us);
  if (!m->waits && now_us >= m->restarted_at + RESTART_US) from_open_on(m, now_us);
}

void outgoing_answer(struct transport *t, struct transport_outgoing *m, uint8_t from, enum ring_code code,
                     const uint8_t *bytes, uint64_t now_us) {
  bool good = bit_of(m->awaited, from) && (code == RING_UNKNOWN || bytes[1] == life_byte(t, m));
  if (code != RING_UNKNOWN && bytes[0] != m->number) {
    /* DONE of the message before says the same as UNKNOWN. */
    good = good && code == RING_DONE && bytes[0] == (uint8_t)(m->number - 1) && bytes[3] != RING_WRONG_CRC;
    code = RING_UNKNOWN;
  }
  if (good && code != RING_UNKNOWN && m->destination != 0) t->unheard[m->destination][m->pipe] = 0;
  if (!good || (code == RING_UNKNOWN && is_short(m))) count(t, TRANSPORT_UNEXPECTED);
  else if (code == RING_UNKNOWN) unknown(m, now_us);
  else if (code == RING_DONE) done(m, from, bytes[3], now_us);
  else if (code == RING_BUSY) busy(t, m, bytes[2], now_us);
  else missing(t, m, bytes, now_us);
}

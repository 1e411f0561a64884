/* What a receiver says to the source of a message. */
#include "internal.h"

enum { BUSY_WAIT = 2 /* in 10 ms */, MAP_FRAMES = 40, PAUSE_MS = 10 };

static uint8_t about(bool to_all, uint8_t life) { return (uint8_t)(life | (to_all ? RING_TO_ALL : 0)); }

static struct ring_frame reply(const struct transport *t, const struct transport_message *m,
                               enum ring_code code, uint8_t life, uint8_t dlc) {
  struct ring_frame f = control_frame(t, m->urgent, m->source, code, m->pipe, dlc);
  f.data[0] = m->number;
  f.data[1] = about(m->to_all, life);
  return f;
}

void reply_done(struct transport *t, const struct transport_message *m, uint8_t life,
                enum ring_result result) {
  struct ring_frame f = reply(t, m, RING_DONE, life, 4);
  f.data[2] = about(m->to_all, t->config.life);
  f.data[3] = (uint8_t)result;
  answer_put(t, &f, m->to_all);
}

void reply_busy(struct transport *t, const struct transport_message *m, uint8_t life) {
  struct ring_frame f = reply(t, m, RING_BUSY, life, 3);
  f.data[2] = BUSY_WAIT;
  answer_put(t, &f, m->to_all);
}

/* A frame that has not been sent yet is not missing: it comes later where the bus or its sender has much to
 * do. */
void reply_missing(struct transport *t, struct transport_incoming *m, uint8_t life) {
  struct ring_frame f = reply(t, &m->message, RING_MISSING, life, 8);
  unsigned first = 0;
  while (first < m->sent && bit_of(m->bitmap, first)) ++first;
  if (first == m->sent) return;
  f.data[2] = (uint8_t)first;
  for (unsigned i = 0; i < MAP_FRAMES && first + i < m->sent; ++i) {
    if (bit_of(m->bitmap, first + i)) continue;
    f.data[3 + i / 8] = (uint8_t)(f.data[3 + i / 8] | 0x80u >> i % 8);
    m->highest = (int16_t)(first + i);
  }
  answer_put(t, &f, m->message.to_all);
}

/* To data without an open message (TP-25): what the source must know to begin again, not too often. */
void reply_no_message(struct transport *t, const struct ring_id *id, const struct transport_source *source,
                      uint64_t now_us) {
  const struct transport_message m = {
      .source = id->source, .pipe = id->pipe, .to_all = id->destination == 0, .urgent = id->urgent};
  struct transport_pipe *pipe = &t->pipes[id->source][m.to_all ? 1 : 0][id->pipe];
  const uint16_t now_ms = (uint16_t)(now_us / US_IN_MS);
  /* The last time is rounded up, so that the pause is never shorter; it may be ahead by one. */
  if (pipe->answered && (uint16_t)(now_ms + 1 - pipe->answered_ms) <= PAUSE_MS) return;
  pipe->answered = true;
  pipe->answered_ms = (uint16_t)((now_us + US_IN_MS - 1) / US_IN_MS);
  if (source != 0 && pipe->has_last) {
    struct transport_message last = m;
    last.number = pipe->last;
    reply_done(t, &last, source->life, pipe->refused ? RING_REFUSED : RING_DELIVERED);
  } else {
    struct ring_frame f = control_frame(t, m.urgent, m.source, RING_UNKNOWN, m.pipe, 1);
    f.data[0] = about(m.to_all, 0);
    answer_put(t, &f, m.to_all);
  }
}

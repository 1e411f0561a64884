/* Sources and their lives: one life per source (TP-20). */
#include "internal.h"

enum { FORGET_US = 10000000, FORGET_BITS = 500000 };

/* What has come in stays for the host if it is complete; the rest is dropped. */
static void detach(struct transport *t, uint8_t source) {
  for (unsigned i = 0; i < TRANSPORT_PLACES; ++i) {
    struct transport_incoming *m = &t->incoming[i];
    if (m->state == INCOMING_FREE || m->message.source != source) continue;
    if (m->state == INCOMING_OPEN) receiver_drop(t, m);
    else m->detached = true;
  }
}

static struct transport_pipe *pipe_at(struct transport *t, uint8_t source, unsigned i) {
  return &t->pipes[source][i / RING_PIPES][i % RING_PIPES];
}

/* Null: nothing is known of it, or what was known is forgotten now. */
struct transport_source *life_known(struct transport *t, uint8_t source, uint64_t now_us) {
  struct transport_source *s = &t->sources[source];
  if (s->known && now_us >= s->heard_at + time_or_bits(t, FORGET_US, FORGET_BITS)) {
    s->known = false;
    detach(t, source);
    for (unsigned i = 0; i < 2 * RING_PIPES; ++i) *pipe_at(t, source, i) = (struct transport_pipe){0};
  }
  return s->known ? s : 0;
}

/* A frame shows a source's life. Null: an older life than the source has. */
struct transport_source *life_heard(struct transport *t, uint8_t source, uint8_t life, uint64_t now_us) {
  struct transport_source *s = &t->sources[source];
  if (life_known(t, source, now_us) == 0) {
    *s = (struct transport_source){.known = true, .life = life};
  } else if (s->life != life) {
    const uint8_t behind = (uint8_t)(s->life - life) & RING_LIFE_MASK;
    if (behind < 64) {
      count(t, TRANSPORT_OLD_LIFE);
      return 0;
    }
    s->life = life;
    detach(t, source);
    for (unsigned i = 0; i < 2 * RING_PIPES; ++i) pipe_at(t, source, i)->has_last = false;
  }
  s->heard_at = now_us;
  return s;
}

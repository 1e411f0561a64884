/* Answers that wait for a place in the port. */
#include "internal.h"

enum { FOR_URGENT = 4 };

static bool same_frame(const struct ring_frame *a, const struct ring_frame *b) {
  if (a->id != b->id || a->dlc != b->dlc) return false;
  for (uint8_t i = 0; i < a->dlc; ++i)
    if (a->data[i] != b->data[i]) return false;
  return true;
}

/* The newest of a kind takes the place of an older one. */
void answer_put(struct transport *t, const struct ring_frame *frame, bool to_all) {
  for (uint8_t i = 0; i < t->slot_count; ++i)
    if (same_frame(&t->slots[i].frame, frame) && can_port_waits(t->port, frame->id)) return;
  for (uint8_t i = 0; i < t->answer_count; ++i) {
    if (t->answers[i].frame.id == frame->id && t->answers[i].to_all == to_all) {
      t->answers[i].frame = *frame;
      t->answers[i].put_at = t->now_us;
      return;
    }
  }
  const uint8_t most = ring_id_of(frame->id).urgent ? TRANSPORT_ANSWERS : TRANSPORT_ANSWERS - FOR_URGENT;
  if (t->answer_count < most)
    t->answers[t->answer_count++] = (struct transport_answer){to_all, t->now_us, *frame};
  else count(t, TRANSPORT_ANSWER_LOST);
}

void answers_look(struct transport *t, uint64_t now_us) {
  uint8_t kept = 0;
  for (uint8_t i = 0; i < t->answer_count; ++i) {
    const struct transport_answer *a = &t->answers[i];
    if (now_us >= stale_at(t, a->frame.id, a->put_at)) count(t, TRANSPORT_ANSWER_LOST);
    else t->answers[kept++] = *a;
  }
  t->answer_count = kept;
}

bool answer_queue_one(struct transport *t, bool urgent) {
  for (uint8_t i = 0; i < t->answer_count; ++i) {
    const struct ring_frame *frame = &t->answers[i].frame;
    if (ring_id_of(frame->id).urgent != urgent || slot_waits(t, frame->id) || !slot_put(t, frame)) continue;
    --t->answer_count;
    for (uint8_t k = i; k < t->answer_count; ++k) t->answers[k] = t->answers[k + 1];
    return true;
  }
  return false;
}

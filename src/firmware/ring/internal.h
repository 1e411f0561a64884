/* What the parts of the transport use of each other. */
#ifndef FLYFRAME_RING_INTERNAL_H
#define FLYFRAME_RING_INTERNAL_H

#include "bytes.h"
#include "transport.h"

enum { US_IN_MS = 1000, US_IN_S = 1000000 };

static inline void count(struct transport *t, enum transport_counter counter) { ++t->counters[counter]; }
static inline uint64_t earlier(uint64_t a, uint64_t b) { return a < b ? a : b; }

/* The longer one of a fixed time and of so many bits, in us. */
static inline uint32_t time_or_bits(const struct transport *t, uint32_t us, uint32_t bits) {
  const uint32_t of_bits = bits * 1000u / t->config.kbps;
  return of_bits > us ? of_bits : us;
}

/* A pipe of which nothing has come for so many seconds is forgotten; its sender relies on that (TB-26). */
static inline uint32_t forget_pipe_s(const struct transport *t) {
  return time_or_bits(t, 20 * US_IN_S, 1000000) / US_IN_S;
}

/* slots.c: what waits in the port, each frame once. */
bool slot_waits(const struct transport *t, uint32_t id);
bool slot_waits_of(const struct transport *t, uint8_t destination, uint8_t pipe);
bool slot_put(struct transport *t, const struct ring_frame *frame); /* false: no room for it */
/* Which frames have left; those that wait for too long are taken back. When the next one will have. */
uint64_t slots_look(struct transport *t, uint64_t now_us);
/* Whether answers wait; when data frames are held back no longer, or anew (TB-31). */
uint64_t slots_hold(struct transport *t);
/* When a frame has waited for too long, in the port or for a place there (TB-27). */
uint64_t stale_at(const struct transport *t, uint32_t id, uint64_t put_at);
struct ring_frame control_frame(const struct transport *t, bool urgent, uint8_t destination,
                                enum ring_code code, uint8_t pipe, uint8_t dlc);

/* answers.c: answers that wait for a slot. */
void answer_put(struct transport *t, const struct ring_frame *frame, bool to_all);
void answers_look(struct transport *t, uint64_t now_us); /* those that wait for too long are dropped */
bool answer_queue_one(struct transport *t, bool urgent);

/* outgoing.c: one message under way. */
void outgoing_left(struct transport_outgoing *m, uint64_t now_us);
bool outgoing_next(const struct transport *t, struct transport_outgoing *m, struct ring_frame *frame);
void outgoing_sent(struct transport_outgoing *m);
uint64_t outgoing_poll(const struct transport *t, struct transport_outgoing *m, uint64_t now_us);
void outgoing_answer(struct transport *t, struct transport_outgoing *m, uint8_t from, enum ring_code code,
                     const uint8_t *bytes, uint64_t now_us);

/* sender.c: all of them. */
bool sender_has(struct transport *t, const struct ring_id *id); /* the message of a frame is under way */
void sender_left(struct transport *t, const struct ring_id *id, uint64_t now_us);
void sender_answer(struct transport *t, const struct ring_id *id, const uint8_t *bytes, uint64_t now_us);
bool sender_queue_one(struct transport *t, bool urgent);
uint64_t sender_poll(struct transport *t, uint64_t now_us);

/* lives.c: sources and their lives. */
struct transport_source *life_known(struct transport *t, uint8_t source, uint64_t now_us);
struct transport_source *life_heard(struct transport *t, uint8_t source, uint8_t life, uint64_t now_us);

/* receiver.c: messages that come in. */
void receiver_start(struct transport *t);
struct transport_incoming *receiver_find(struct transport *t, uint8_t source, bool to_all, uint8_t pipe);
void receiver_drop(struct transport *t, struct transport_incoming *m);
void receiver_opening(struct transport *t, const struct ring_id *id, const struct ring_frame *frame,
                      uint64_t now_us);
void receiver_close(struct transport *t, const struct ring_id *id, const uint8_t *bytes, uint64_t now_us);
void receiver_data(struct transport *t, const struct ring_id *id, const struct ring_frame *frame,
                   uint64_t now_us);
uint64_t receiver_poll(struct transport *t, uint64_t now_us);

/* replies.c: what a receiver says. */
void reply_done(struct transport *t, const struct transport_message *m, uint8_t life,
                enum ring_result result);
void reply_busy(struct transport *t, const struct transport_message *m, uint8_t life);
void reply_missing(struct transport *t, struct transport_incoming *m, uint8_t life);
void reply_no_message(struct transport *t, const struct ring_id *id, const struct transport_source *source,
                      uint64_t now_us);

/* station.c: HELLO and process data. */
void station_start(struct transport *t, uint64_t now_us);
void station_heard(struct transport *t, uint8_t source, const uint8_t *bytes, uint64_t now_us);
void station_value(struct transport *t, const struct ring_id *id, const struct ring_frame *frame,
                   uint64_t now_us);
bool station_queue_one(struct transport *t);
uint64_t station_poll(struct transport *t, uint64_t now_us);

#endif

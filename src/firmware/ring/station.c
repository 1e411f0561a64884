/* What needs no answer: HELLO (TP-31) and process data (TP-50). */
#include "internal.h"

enum {
  HELLO_US = 1000000,
  HELLO_BITS = 1000, /* of the bus for each node: HELLO of all take a sixth of it at most */
  NEWS_BITS = 10000, /* between two early ones, so that they change little of that */
  HELLO_MS_MOST = 2500, /* set by a program: four of them are 10 s (TP-20) */
  MEMBER_HELLOS = 3,
  PORTS = 1,      /* byte of HELLO behind the life, and its bits of which a change is told early */
  PORTS_UP = 0x44 /* signal, search and stuck levels may flicker */
};

/* On a ring with so many nodes. */
static uint64_t hello_us(const struct transport *t, unsigned nodes) {
  const uint16_t set = t->config.hello_ms < HELLO_MS_MOST ? t->config.hello_ms : HELLO_MS_MOST;
  if (set != 0) return set * (uint64_t)US_IN_MS;
  return time_or_bits(t, HELLO_US, HELLO_BITS * nodes);
}

void station_start(struct transport *t, uint64_t now_us) {
  t->hello_due = true;
  t->hello_at = now_us;
}

void station_heard(struct transport *t, uint8_t source, const uint8_t *bytes, uint64_t now_us) {
  if (!t->member[source]) ++t->known;
  if (!t->member[source] || !same_bytes(t->told[source], bytes, sizeof t->told[source])) ++t->news;
  t->member[source] = true;
  copy_bytes(t->told[source], bytes, sizeof t->told[source]);
  t->member_at[source] = now_us;
}

/* Another node may know of more nodes than this one, as many as there can be: it is not forgotten then. */
uint64_t transport_member_us(const struct transport *t) {
  return MEMBER_HELLOS * hello_us(t, RING_LAST_ADDRESS);
}

void transport_members(const struct transport *t, uint8_t map[TRANSPORT_MAP_BYTES], uint64_t now_us) {
  for (unsigned i = 0; i < TRANSPORT_MAP_BYTES; ++i) map[i] = 0;
  for (unsigned a = 0; a < TRANSPORT_NODES; ++a)
    if (t->member[a] && now_us < t->member_at[a] + transport_member_us(t)) set_bit(map, a);
}

bool transport_told(const struct transport *t, uint8_t source, uint8_t *life,
                    uint8_t bytes[TRANSPORT_HELLO_BYTES]) {
  *life = t->told[source][0] & RING_LIFE_MASK;
  copy_bytes(bytes, t->told[source] + 1, TRANSPORT_HELLO_BYTES);
  return t->member[source];
}

uint32_t transport_news(const struct transport *t) { return t->news; }

void transport_hello(struct transport *t, const uint8_t bytes[TRANSPORT_HELLO_BYTES]) {
  if (((bytes[PORTS] ^ t->config.hello[PORTS]) & PORTS_UP) != 0) t->hello_news = true;
  copy_bytes(t->config.hello, bytes, TRANSPORT_HELLO_BYTES);
}

bool transport_object(struct transport *t, uint8_t destination, uint8_t number, const uint8_t *data,
                      uint8_t length) {
  struct transport_object *place = 0;
  if (t->port == 0 || length > RING_FRAME_BYTES) return false;
  for (unsigned i = 0; i < TRANSPORT_OBJECTS; ++i) {
    struct transport_object *o = &t->objects[i];
    if (!o->used) {
      if (place == 0) place = o;
    } else if (o->destination == destination && o->number == number) {
      place = o;
      break;
    }
  }
  if (place == 0) return false;
  if (!place->used || place->length != length || !same_bytes(place->data, data, length)) place->due = true;
  place->used = true;
  place->destination = destination;
  place->number = number;
  place->length = length;
  copy_bytes(place->data, data, length);
  return true;
}

static struct transport_watched *watched(const struct transport *t, uint8_t source, uint8_t number) {
  for (unsigned i = 0; i < TRANSPORT_WATCHED; ++i) {
    const struct transport_watched *w = &t->watched[i];
    if (w->used && w->source == source && w->number == number) return (struct transport_watched *)w;
  }
  return 0;
}

bool transport_watch(struct transport *t, uint8_t source, uint8_t number) {
  if (t->port == 0) return false;
  if (watched(t, source, number) != 0) return true;
  for (unsigned i = 0; i < TRANSPORT_WATCHED; ++i) {
    struct transport_watched *w = &t->watched[i];
    if (w->used) continue;
    *w = (struct transport_watched){.used = true, .source = source, .number = number};
    return true;
  }
  return false;
}

void transport_forget_values(struct transport *t) {
  for (unsigned i = 0; i < TRANSPORT_OBJECTS; ++i) t->objects[i] = (struct transport_object){0};
  t->object_turn = 0;
  for (unsigned i = 0; i < TRANSPORT_WATCHED; ++i) t->watched[i] = (struct transport_watched){0};
}

void station_value(struct transport *t, const struct ring_id *id, const struct ring_frame *f,
                   uint64_t now_us) {
  struct transport_watched *w = watched(t, id->source, id->number);
  if (w == 0) {
    count(t, TRANSPORT_UNWATCHED);
    return;
  }
  ++t->heard;
  w->heard = true;
  w->heard_at = now_us;
  w->length = f->dlc;
  copy_bytes(w->data, f->data, f->dlc);
}

uint8_t transport_value(const struct transport *t, uint8_t source, uint8_t number, uint8_t data[8], bool *old,
                        uint64_t now_us) {
  const struct transport_watched *w = watched(t, source, number);
  *old = w == 0 || !w->heard || now_us >= w->heard_at + 3000u * (uint64_t)t->config.pd_ms;
  if (w == 0) return 0;
  copy_bytes(data, w->data, w->length);
  return w->length;
}

uint64_t station_poll(struct transport *t, uint64_t now_us) {
  const uint64_t every_us = hello_us(t, t->known + 1u); /* it grows as others tell of themselves */
  if (now_us >= t->hello_at + every_us) {
    t->hello_due = true;
    t->hello_news = false;
    t->hello_at = now_us;
  }
  if (t->hello_news && now_us >= t->news_from) {
    t->hello_due = true;
    t->hello_news = false;
    t->news_from = now_us + time_or_bits(t, 0, NEWS_BITS * (t->known + 1u));
  }
  uint64_t due = t->hello_at + every_us;
  if (t->hello_news) due = earlier(due, t->news_from);
  for (unsigned i = 0; i < TRANSPORT_OBJECTS; ++i) {
    struct transport_object *o = &t->objects[i];
    if (!o->used) continue;
    if (o->due || now_us >= o->due_at) {
      o->due = true;
      o->due_at = now_us + 1000u * (uint64_t)t->config.pd_ms;
    }
    due = earlier(due, o->due_at);
  }
  return due;
}

/* A value that still waits in the port is followed by the newest one when it has left. Values go in turn:
 * when they are due faster than the ring carries them, each still goes. */
bool station_queue_one(struct transport *t) {
  if (t->hello_due) {
    struct ring_frame f = control_frame(t, false, 0, RING_HELLO, 0, 8);
    f.data[0] = t->config.life;
    copy_bytes(f.data + 1, t->config.hello, TRANSPORT_HELLO_BYTES);
    if (!slot_waits(t, f.id) && slot_put(t, &f)) {
      t->hello_due = false;
      return true;
    }
  }
  for (unsigned k = 0; k < TRANSPORT_OBJECTS; ++k) {
    const unsigned i = (t->object_turn + k) % TRANSPORT_OBJECTS;
    struct transport_object *o = &t->objects[i];
    if (!o->due) continue;
    const struct ring_id id = {false,     o->destination,    true, t->config.address,
                               o->number, RING_PROCESS_DATA, true};
    struct ring_frame f = {.id = ring_id_word(&id), .dlc = o->length};
    copy_bytes(f.data, o->data, o->length);
    if (slot_waits(t, f.id) || !slot_put(t, &f)) continue;
    o->due = false;
    t->object_turn = (uint8_t)((i + 1) % TRANSPORT_OBJECTS);
    return true;
  }
  return false;
}

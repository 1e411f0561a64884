/* A node's transport as a program that a test drives through its pipes: commands in, answers out, numbers
 * little endian. NodeInC.scala is the other end. The port is a list of frames, which must never hold more
 * than it was told, nor two with the same identifier (TP-06). */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "ring/transport.h"

struct can_port {
  struct ring_frame waiting[TRANSPORT_SLOTS];
  unsigned count, places;
  struct ring_frame fresh[TRANSPORT_SLOTS]; /* not told yet */
  unsigned fresh_count;
  uint32_t aborts[TRANSPORT_SLOTS]; /* identifiers, not told yet */
  unsigned abort_count;
};

/* Where the bytes of a message stay until it has ended; ASan sees to it that nobody reads them then. */
struct store {
  uint16_t tag;
  uint8_t* bytes;
};

static struct can_port port;
static struct store stores[TRANSPORT_OUTGOING];
static struct transport transport;

static void fail(const char* why) {
  fprintf(stderr, "%s\n", why);
  abort();
}

static void take(void* bytes, size_t count) {
  if (fread(bytes, 1, count, stdin) != count) exit(0); /* the test has ended */
}
static uint64_t number(unsigned bytes) {
  uint8_t raw[8];
  uint64_t n = 0;
  take(raw, bytes);
  for (unsigned i = 0; i < bytes; ++i) n |= (uint64_t)raw[i] << 8 * i;
  return n;
}
static void give(const void* bytes, size_t count) { fwrite(bytes, 1, count, stdout); }
static void say(uint64_t n, unsigned bytes) {
  for (unsigned i = 0; i < bytes; ++i) putchar((int)(n >> 8 * i & 0xff));
}

bool can_port_waits(const struct can_port* b, uint32_t id) {
  for (unsigned i = 0; i < b->count; ++i)
    if (b->waiting[i].id == id) return true;
  return false;
}

bool can_port_send(struct can_port* b, const struct ring_frame* frame) {
  if (b->count >= b->places) fail("more frames in the port than it has places");
  if (can_port_waits(b, frame->id)) fail("TP-06: the frame waits already");
  b->waiting[b->count++] = *frame;
  b->fresh[b->fresh_count++] = *frame;
  return true;
}

void can_port_abort(struct can_port* b, uint32_t id) {
  if (!can_port_waits(b, id)) fail("a frame that does not wait is taken back");
  if (b->abort_count == TRANSPORT_SLOTS) fail("more frames are taken back than there may be");
  b->aborts[b->abort_count++] = id;
}

static void frame_left(uint32_t id) {
  unsigned kept = 0;
  for (unsigned i = 0; i < port.count; ++i)
    if (port.waiting[i].id != id) port.waiting[kept++] = port.waiting[i];
  port.count = kept;
}

static void forget(struct store* s) {
  free(s->bytes);
  s->bytes = NULL;
}

static void start(void) {
  struct transport_config config = {0};
  for (unsigned i = 0; i < TRANSPORT_OUTGOING; ++i) forget(&stores[i]);
  memset(&port, 0, sizeof port);
  config.address = (uint8_t)number(1);
  config.life = (uint8_t)number(1);
  config.kbps = (uint16_t)number(2);
  config.pd_ms = (uint16_t)number(2);
  config.slots = (uint8_t)number(1);
  port.places = config.slots;
  take(config.hello, sizeof config.hello);
  transport_start(&transport, &port, &config, number(8));
}

static struct ring_frame frame_in(void) {
  struct ring_frame f = {.id = (uint32_t)number(4)};
  f.dlc = (uint8_t)number(1);
  take(f.data, sizeof f.data);
  return f;
}

static void poll(void) {
  struct transport_end ends[TRANSPORT_OUTGOING];
  uint8_t count = 0;
  say(transport_poll(&transport, number(8)), 8);
  say(port.fresh_count, 1);
  for (unsigned i = 0; i < port.fresh_count; ++i) {
    say(port.fresh[i].id, 4);
    say(port.fresh[i].dlc, 1);
    give(port.fresh[i].data, 8);
  }
  port.fresh_count = 0;
  say(port.abort_count, 1);
  for (unsigned i = 0; i < port.abort_count; ++i) say(port.aborts[i], 4);
  port.abort_count = 0;
  while (transport_ended(&transport, &ends[count])) {
    for (unsigned i = 0; i < TRANSPORT_OUTGOING; ++i)
      if (stores[i].bytes != NULL && stores[i].tag == ends[count].tag) forget(&stores[i]);
    ++count;
  }
  say(count, 1);
  for (unsigned i = 0; i < count; ++i) {
    say(ends[i].tag, 2);
    say(ends[i].outcome, 1);
    give(ends[i].unconfirmed, TRANSPORT_MAP_BYTES);
  }
  say(transport_received(&transport) != NULL, 1);
}

static void send_message(void) {
  uint8_t members[TRANSPORT_MAP_BYTES];
  const uint64_t now = number(8);
  const uint16_t tag = (uint16_t)number(2);
  const uint8_t destination = (uint8_t)number(1);
  const bool urgent = number(1) != 0;
  const bool given = number(1) != 0;
  take(members, sizeof members);
  const uint16_t length = (uint16_t)number(2);
  uint8_t* bytes = malloc(length + 1u);
  if (bytes == NULL) fail("no memory");
  take(bytes, length);
  const bool sent =
      transport_send(&transport, tag, destination, urgent, bytes, length, given ? members : NULL, now);
  for (unsigned i = 0; sent && i < TRANSPORT_OUTGOING; ++i) {
    if (stores[i].bytes != NULL) continue;
    stores[i] = (struct store){tag, bytes};
    bytes = NULL;
    break;
  }
  if (sent && bytes != NULL) fail("more messages under way than there may be");
  free(bytes);
  say(sent, 1);
}

static void received(void) {
  const struct transport_message* m = transport_received(&transport);
  if (m == NULL) fail("no message");
  say(m->source, 1);
  say(m->to_all, 1);
  say(m->pipe, 1);
  say(m->number, 1);
  say(m->urgent, 1);
  say(m->repeat, 1);
  say(m->length, 2);
  give(m->data, m->length);
}

static void object_out(void) {
  uint8_t data[8];
  const uint8_t destination = (uint8_t)number(1);
  const uint8_t object = (uint8_t)number(1);
  const uint8_t length = (uint8_t)number(1);
  take(data, sizeof data);
  say(transport_object(&transport, destination, object, data, length), 1);
}

static void value_in(void) {
  uint8_t data[8] = {0};
  bool old;
  const uint8_t source = (uint8_t)number(1);
  const uint8_t object = (uint8_t)number(1);
  say(transport_value(&transport, source, object, data, &old, number(8)), 1);
  say(old, 1);
  give(data, sizeof data);
}

/* False: it has no answer. */
static bool execute(int command) {
  uint8_t map[TRANSPORT_MAP_BYTES], hello[TRANSPORT_HELLO_BYTES];
  struct ring_frame frame;
  switch (command) {
    case 'B': start(); return false;
    case 'F':
      frame = frame_in();
      transport_receive(&transport, &frame, number(8));
      return false;
    case 'L': frame_left((uint32_t)number(4)); return false;
    case 'C': transport_cancel(&transport, (uint16_t)number(2)); return false;
    case 'T': transport_take(&transport, transport_received(&transport), number(1) != 0); return false;
    case 'H':
      take(hello, sizeof hello);
      transport_hello(&transport, hello);
      return false;
    case 'P': poll(); return true;
    case 'S': send_message(); return true;
    case 'R': received(); return true;
    case 'M':
      transport_members(&transport, map, number(8));
      give(map, sizeof map);
      return true;
    case 'O': object_out(); return true;
    case 'W': {
      const uint8_t source = (uint8_t)number(1);
      say(transport_watch(&transport, source, (uint8_t)number(1)), 1);
      return true;
    }
    case 'D': transport_forget_values(&transport); return false;
    case 'V': value_in(); return true;
    case 'N':
      for (unsigned i = 0; i < TRANSPORT_COUNTERS; ++i) say(transport.counters[i], 4);
      return true;
    default: fail("no such command");
  }
  return false;
}

int main(void) {
  int command;
  while ((command = getchar()) != EOF)
    if (execute(command)) fflush(stdout);
  for (unsigned i = 0; i < TRANSPORT_OUTGOING; ++i) forget(&stores[i]);
  return 0;
}

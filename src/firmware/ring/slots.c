/* The frames that wait in the port: each once (TP-06). */
#include "internal.h"

bool slot_waits(const struct transport *t, uint32_t id) {
  for (uint8_t i = 0; i < t->slot_count; ++i)
    if (t->slots[i].id == id) return true;
  return false;
}

/* Those that a sender of messages has made, not answers. The port is asked, since what has left may not have
 * been looked at yet. */
bool slot_waits_of(const struct transport *t, uint8_t destination, uint8_t pipe) {
  for (uint8_t i = 0; i < t->slot_count; ++i) {
    const struct ring_id id = ring_id_of(t->slots[i].id);
    if (id.destination == destination && id.pipe == pipe && (id.is_data || id.number <= RING_CLOSE) &&
        can_port_waits(t->port, t->slots[i].id))
      return true;
  }
  return false;
}

/* Data frames leave three places for what must not wait behind them, everything leaves one for what is
 * urgent. */
static unsigned places_for(const struct transport *t, const struct ring_id *id) {
  const unsigned places = t->config.slots;
  if (id->urgent) return places;
  return id->is_data && id->pipe != RING_PROCESS_DATA ? places - 3 : places - 1;
}

bool slot_put(struct transport *t, const struct ring_frame *frame) {
  const struct ring_id id = ring_id_of(frame->id);
  if (t->slot_count >= places_for(t, &id) || !can_port_send(t->port, frame)) return false;
  t->slots[t->slot_count++] = *frame;
  return true;
}

void slots_look(struct transport *t, uint64_t now_us) {
  uint8_t kept = 0;
  for (uint8_t i = 0; i < t->slot_count; ++i) {
    if (can_port_waits(t->port, t->slots[i].id)) {
      t->slots[kept++] = t->slots[i];
    } else {
      const struct ring_id id = ring_id_of(t->slots[i].id);
      sender_left(t, &id, now_us);
    }
  }
  t->slot_count = kept;
}

struct ring_frame control_frame(const struct transport *t, bool urgent, uint8_t destination,
                                enum ring_code code, uint8_t pipe, uint8_t dlc) {
  const struct ring_id id = {urgent, destination, false, t->config.address, (uint8_t)code, pipe, true};
  return (struct ring_frame){.id = ring_id_word(&id), .dlc = dlc};
}

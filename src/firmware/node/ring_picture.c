#include "ring_picture.h"

#include "../ring/bytes.h"
#include "ring-node-tp.h"

enum { PORTS_AT = 1 }; /* in HELLO behind the life */

void ring_picture_look(struct ring_picture *picture, const struct ring_node *node) {
  const struct transport *t = &node->transport;
  const uint8_t own = node->parameters.address;
  const bool starts = picture->starts != node->starts;
  *picture = (struct ring_picture){.starts = node->starts,
                                   .since_us = starts ? node->now_us : picture->since_us,
                                   .open_us = starts ? node->now_us : picture->open_us};
  transport_members(t, picture->present, node->now_us);
  set_bit(picture->present, own);
  uint8_t behind_1 = 0, behind_2 = 0; /* the nodes with port 1 and port 2 at a break */
  bool is_told = false;               /* by another one */
  for (unsigned a = 1; a < TRANSPORT_NODES; ++a) {
    uint8_t life, hello[TRANSPORT_HELLO_BYTES];
    if (!bit_of(picture->present, a)) continue;
    ++picture->count;
    if (a != own) transport_told(t, (uint8_t)a, &life, hello);
    const uint8_t ports = a == own ? node->status[PORTS_AT] : hello[PORTS_AT];
    const bool up_1 = (ports & NODE_RING_UP1_MASK) != 0, up_2 = (ports & NODE_RING_UP2_MASK) != 0;
    if (!up_1 && behind_1 == 0) behind_1 = (uint8_t)a;
    if (!up_2 && behind_2 == 0) behind_2 = (uint8_t)a;
    if (a != own && !(up_1 && up_2)) is_told = true;
  }
  /* A piece has two ends; of one that does not fit NODE-01, or changes now, one may not be known. */
  picture->ends[0] = behind_2;
  picture->ends[1] = behind_1;
  const uint64_t member_us = transport_member_us(t);
  const bool heard_out = node->now_us - picture->since_us >= member_us;
  if (heard_out && picture->count == 1) picture->ends[0] = picture->ends[1] = own;
  const bool is_open = picture->ends[0] != 0 || picture->ends[1] != 0;
  /* Of nodes behind a break nothing was heard. They may have one of their own, of which they tell with their
   * next HELLO only. */
  if (is_open || picture->count == 1) picture->open_us = node->now_us;
  picture->known = is_told || (is_open ? heard_out : node->now_us - picture->open_us >= member_us);
}

/* The ring as a node sees it: who is there, and where it is broken (GW-02, GW-04). */
#ifndef FLYFRAME_RING_PICTURE_H
#define FLYFRAME_RING_PICTURE_H

#include "ring_node.h"

struct ring_picture {
  uint8_t present[TRANSPORT_MAP_BYTES]; /* the nodes of which a HELLO came (TB-28), and this one */
  uint8_t count;                        /* how many */
  /* The addresses at both sides of a break, the one with port 2 there first: the ends of the piece in which
   * this node is. 0, 0: the ring is whole, if that is known. */
  uint8_t ends[2];
  bool known;        /* another node tells of a break, or each had the time to tell of one */
  uint32_t starts;   /* of the node's controller */
  uint64_t since_us; /* the last of these */
  uint64_t open_us;  /* the last time that the ring was open, as far as was known, or the last start */
};

/* The picture is all 0 before the first look. */
void ring_picture_look(struct ring_picture *picture, const struct ring_node *node);

#endif

/* What a gateway does when another node has its address (FR-62): nobody may be there who would tell it that
 * the other one is gone. */
#ifndef FLYFRAME_RING_CONFLICT_H
#define FLYFRAME_RING_CONFLICT_H

#include "ring_node.h"

struct ring_conflict {
  bool lasts;
  uint64_t since_us; /* it does, or does not; or it was cleared last */
  uint32_t wait_s;   /* then it is cleared; 0: as at first */
};

/* To be called often, behind `ring_node_serve`. Clears a conflict that has lasted. All 0 at the start. */
void ring_conflict_look(struct ring_conflict *conflict, struct ring_node *node);

#endif

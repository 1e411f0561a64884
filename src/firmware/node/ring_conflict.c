#include "ring_conflict.h"

/* Ever more rarely: each time the other one stops, if it is still there, and may do the same. */
enum { FIRST_S = 10, LAST_S = 640, QUIET_S = 3600 };
#define US_IN_S 1000000u

void ring_conflict_look(struct ring_conflict *c, struct ring_node *node) {
  const bool lasts = ring_node_conflict(node);
  if (lasts != c->lasts) c->since_us = node->now_us;
  c->lasts = lasts;
  const uint64_t seconds = (node->now_us - c->since_us) / US_IN_S;
  if (c->wait_s == 0 || (!lasts && seconds >= QUIET_S)) c->wait_s = FIRST_S;
  if (!lasts || seconds < c->wait_s) return;
  if (!ring_node_runs(node)) return;
  ring_node_clear_conflict(node);
  c->since_us = node->now_us;
  if (c->wait_s < LAST_S) c->wait_s *= 2;
}

/* What a ring's gateway reports to the plant server: parts, numbered in each life, which are kept until the
 * server has them on its disk, and their datagrams with tags. It knows neither ring nor network.
 * docs/rules/gateways.md has the rules. */
#ifndef FLYFRAME_RING_REPORTS_H
#define FLYFRAME_RING_REPORTS_H

#include <stdbool.h>
#include <stdint.h>

#include "protocol.h"

enum {
  RING_REPORTS_PARTS = 64, /* that are kept */
  RING_REPORTS_OWN_BYTES = 12,
  RING_REPORTS_MOST_BYTES = 1472, /* of a datagram */
  /* For so many results there is room in each: as many messages of the server may wait (GWB-10). */
  RING_REPORTS_RESULTS = 16,
  RING_REPORTS_RESULT_BYTES = 5,
  RING_REPORTS_ROOM_BYTES =
      RING_REPORTS_RESULTS * (PROTOCOL_RING_PART_HEAD_BYTES + RING_REPORTS_RESULT_BYTES),
  RING_REPORTS_DATA_BYTES = RING_REPORTS_MOST_BYTES - PROTOCOL_RING_REPORT_BYTES -
                            PROTOCOL_RING_PART_HEAD_BYTES - RING_REPORTS_ROOM_BYTES -
                            PROTOCOL_RING_REPORT_END_BYTES
};

struct ring_reports_config {
  uint16_t gateway; /* ID, not 0 */
  uint8_t key[PROTOCOL_KEY_BYTES];
  uint16_t repeat_ms;       /* parts that are not acknowledged: 1 to 10,000 */
  uint16_t heartbeat_ms;    /* without parts: 1 to 10,000 */
  uint16_t silent_after_ms; /* without a right answer the server is silent */
};

/* A part; fields as in the datagram. */
struct ring_part {
  uint8_t type, source, pipe, number, life, flags;
  uint16_t total, offset, length;
  const uint8_t *data;                 /* must stay until the part is gone; null: `own` */
  uint8_t own[RING_REPORTS_OWN_BYTES]; /* up to so many bytes are kept here */
  const void *ends;                    /* told when the server has the part; may be null */
};

/* A message of the server for a node. */
struct ring_order {
  uint32_t counter;
  uint8_t destination;
  bool urgent;
  uint16_t length;
  const uint8_t *data; /* in the datagram */
};

enum ring_datagram { RING_DATAGRAM_NONE, RING_DATAGRAM_ANSWER, RING_DATAGRAM_ORDER };

struct ring_reports {
  struct ring_reports_config config;
  uint8_t life[PROTOCOL_LIFE_BYTES],
      server[PROTOCOL_LIFE_BYTES]; /* the server's: 0 as long as it is unknown */
  uint32_t counter, echo;          /* of the last report; of the last answer */
  uint32_t oldest;                 /* number of the first part that is kept */
  uint32_t taken;                  /* counter of the last order that was taken */
  struct ring_part parts[RING_REPORTS_PARTS];
  unsigned first, count; /* place of the oldest; how many there are */
  unsigned sent, stored; /* how many of these have left, and so have their numbers; how many the server has */
  bool news, trouble;            /* a report is due; the server cannot write its log */
  uint64_t reported_us, heard_us;
  uint32_t refused; /* datagrams that were none of the server, or not for this life */
};

/* Begins a life: a random number that is not 0. */
void ring_reports_start(struct ring_reports *r, const struct ring_reports_config *config,
                        const uint8_t life[PROTOCOL_LIFE_BYTES], uint64_t now_us);

/* Places for parts. */
unsigned ring_reports_free(const struct ring_reports *r);

/* There must be a place. A result goes before what has not left yet. */
void ring_reports_add(struct ring_reports *r, const struct ring_part *part);

/* The oldest part that the server has, once; false: there is none. */
bool ring_reports_done(struct ring_reports *r, struct ring_part *part);

/* Makes the datagram that is due; its length, 0: none is. When none was due, `due_us` says when one may be.
 */
uint16_t ring_reports_make(struct ring_reports *r, uint8_t datagram[RING_REPORTS_MOST_BYTES], uint8_t status,
                           uint64_t now_us, uint64_t *due_us);

/* A datagram has come. An order is the next one, and counts as taken with `ring_reports_take`; else it comes
 * again. `renewed`: the server has another life than before, and knows nothing of the ring. */
enum ring_datagram ring_reports_receive(struct ring_reports *r, const uint8_t *datagram, uint16_t length,
                                        struct ring_order *order, bool *renewed, uint64_t now_us);
void ring_reports_take(struct ring_reports *r, const struct ring_order *order);

/* Numbers of parts, reports or orders come to their end: it is time for another life. */
bool ring_reports_ends(const struct ring_reports *r);

bool ring_reports_silent(const struct ring_reports *r, uint64_t now_us);

#endif

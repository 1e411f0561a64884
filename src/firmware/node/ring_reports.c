#include "ring_reports.h"

#include "../ascon.h"
#include "../ring/bytes.h"

enum {
  US_IN_MS = 1000,
  PAUSE_US = 2000 /* between two reports: what has come meanwhile goes together */
};
/* Behind it there are enough for what comes in one pass of the main loop. */
#define LAST_NUMBER (UINT32_MAX - 1000)

static void tag_of(const struct ring_reports *r, uint8_t tag[ASCON_TAG_BYTES], const uint8_t *life,
                   uint8_t origin, uint32_t counter, const uint8_t *message, uint16_t length) {
  uint8_t nonce[ASCON_NONCE_BYTES] = {0};
  copy_bytes(nonce + PROTOCOL_NONCE_LIFE_AT, life, PROTOCOL_LIFE_BYTES);
  nonce[PROTOCOL_NONCE_ORIGIN_AT] = origin;
  put_number(nonce + PROTOCOL_NONCE_COUNTER_AT, counter, PROTOCOL_NONCE_COUNTER_BYTES);
  ascon_tag(tag, r->config.key, nonce, message, length);
}

static uint64_t ms(uint16_t time_ms) { return (uint64_t)time_ms * US_IN_MS; }

static struct ring_part *part_at(struct ring_reports *r, unsigned i) {
  return &r->parts[(r->first + i) % RING_REPORTS_PARTS];
}

void ring_reports_start(struct ring_reports *r, const struct ring_reports_config *config,
                        const uint8_t life[PROTOCOL_LIFE_BYTES], uint64_t now_us) {
  *r = (struct ring_reports){.config = *config, .news = true, .reported_us = now_us, .heard_us = now_us};
  copy_bytes(r->life, life, PROTOCOL_LIFE_BYTES);
}

unsigned ring_reports_free(const struct ring_reports *r) { return RING_REPORTS_PARTS - r->count; }

static bool is_result(const struct ring_part *part) { return part->type == PROTOCOL_RING_PART_RESULT; }

void ring_reports_add(struct ring_reports *r, const struct ring_part *part) {
  unsigned at = r->count++;
  for (; is_result(part) && at > r->sent && !is_result(part_at(r, at - 1)); --at)
    *part_at(r, at) = *part_at(r, at - 1);
  *part_at(r, at) = *part;
  r->news = true;
}

/* --- reports --- */

static uint16_t put_part(uint8_t *to, const struct ring_part *p) {
  put_number(to + PROTOCOL_RING_PART_HEAD_TYPE_AT, p->type, 1);
  put_number(to + PROTOCOL_RING_PART_HEAD_SOURCE_AT, p->source, 1);
  put_number(to + PROTOCOL_RING_PART_HEAD_PIPE_AT, p->pipe, 1);
  put_number(to + PROTOCOL_RING_PART_HEAD_NUMBER_AT, p->number, 1);
  put_number(to + PROTOCOL_RING_PART_HEAD_LIFE_AT, p->life, 1);
  put_number(to + PROTOCOL_RING_PART_HEAD_FLAGS_AT, p->flags, 1);
  put_number(to + PROTOCOL_RING_PART_HEAD_TOTAL_AT, p->total, 2);
  put_number(to + PROTOCOL_RING_PART_HEAD_OFFSET_AT, p->offset, 2);
  put_number(to + PROTOCOL_RING_PART_HEAD_LENGTH_AT, p->length, 2);
  copy_bytes(to + PROTOCOL_RING_PART_HEAD_BYTES, p->data != 0 ? p->data : p->own, p->length);
  return (uint16_t)(PROTOCOL_RING_PART_HEAD_BYTES + p->length);
}

static uint64_t due_at(const struct ring_reports *r) {
  return r->reported_us +
         (r->news ? PAUSE_US : ms(r->count > 0 ? r->config.repeat_ms : r->config.heartbeat_ms));
}

uint16_t ring_reports_make(struct ring_reports *r, uint8_t datagram[RING_REPORTS_MOST_BYTES], uint8_t status,
                           uint64_t now_us, uint64_t *due_us) {
  *due_us = due_at(r);
  /* No tag may be made twice. */
  if (r->counter == UINT32_MAX || now_us < *due_us) return 0;
  ++r->counter;
  uint16_t at = PROTOCOL_RING_REPORT_BYTES;
  uint8_t parts = 0;
  for (; parts < r->count; ++parts) {
    const struct ring_part *p = part_at(r, parts);
    const int room = is_result(p) ? 0 : RING_REPORTS_ROOM_BYTES;
    if (at + PROTOCOL_RING_PART_HEAD_BYTES + p->length + room + PROTOCOL_RING_REPORT_END_BYTES >
        RING_REPORTS_MOST_BYTES)
      break;
    at = (uint16_t)(at + put_part(datagram + at, p));
  }
  if (parts > r->sent) r->sent = parts;
  for (unsigned i = 0; i < PROTOCOL_RING_REPORT_BYTES; ++i) datagram[i] = 0;
  put_number(datagram + PROTOCOL_RING_REPORT_MAGIC_AT, PROTOCOL_MAGIC, PROTOCOL_RING_REPORT_MAGIC_BYTES);
  put_number(datagram + PROTOCOL_RING_REPORT_VERSION_AT, PROTOCOL_VERSION, 1);
  put_number(datagram + PROTOCOL_RING_REPORT_KIND_AT, PROTOCOL_KIND_RING, 1);
  put_number(datagram + PROTOCOL_RING_REPORT_MASTER_AT, r->config.gateway, 2);
  copy_bytes(datagram + PROTOCOL_RING_REPORT_LIFE_AT, r->life, PROTOCOL_LIFE_BYTES);
  copy_bytes(datagram + PROTOCOL_RING_REPORT_SERVER_AT, r->server, PROTOCOL_LIFE_BYTES);
  put_number(datagram + PROTOCOL_RING_REPORT_COUNTER_AT, r->counter, 4);
  put_number(datagram + PROTOCOL_RING_REPORT_NUMBER_AT, r->oldest, 4);
  put_number(datagram + PROTOCOL_RING_REPORT_TAKEN_AT, r->taken, 4);
  put_number(datagram + PROTOCOL_RING_REPORT_PARTS_AT, parts, 1);
  put_number(datagram + PROTOCOL_RING_REPORT_STATUS_AT, status, 1);
  tag_of(r, datagram + at, r->life, PROTOCOL_OF_MASTER, r->counter, datagram, at);
  r->news = false;
  r->reported_us = now_us;
  return (uint16_t)(at + PROTOCOL_RING_REPORT_END_BYTES);
}

/* --- what comes --- */

/* Whether the head is that of a datagram of this kind to this life. */
static bool is_headed(const struct ring_reports *r, const uint8_t *d, uint8_t kind) {
  return get_number(d + PROTOCOL_ANSWER_MAGIC_AT, 2) == PROTOCOL_MAGIC &&
         d[PROTOCOL_ANSWER_VERSION_AT] == PROTOCOL_VERSION && d[PROTOCOL_ANSWER_KIND_AT] == kind &&
         get_number(d + PROTOCOL_ANSWER_MASTER_AT, 2) == r->config.gateway &&
         same_bytes(d + PROTOCOL_ANSWER_LIFE_AT, r->life, PROTOCOL_LIFE_BYTES);
}

static bool is_tagged(const struct ring_reports *r, const uint8_t *d, uint16_t tag_at) {
  uint8_t tag[ASCON_TAG_BYTES];
  tag_of(r, tag, d + PROTOCOL_ANSWER_SERVER_AT, PROTOCOL_OF_SERVER,
         get_number(d + PROTOCOL_ANSWER_TURN_AT, 4), d, tag_at);
  return ascon_same(tag, d + tag_at);
}

/* Only one that is behind the last one: so an old one changes nothing. */
static bool takes_answer(struct ring_reports *r, const uint8_t *d, uint16_t length, bool *renewed,
                         uint64_t now_us) {
  if (length != PROTOCOL_ANSWER_BYTES || !is_headed(r, d, PROTOCOL_KIND_ANSWER)) return false;
  const uint32_t echo = get_number(d + PROTOCOL_ANSWER_ECHO_AT, 4);
  if (!is_tagged(r, d, PROTOCOL_ANSWER_TAG_AT) || echo <= r->echo || echo > r->counter) return false;
  r->echo = echo;
  const uint32_t stored = get_number(d + PROTOCOL_ANSWER_NUMBER_AT, 4) - r->oldest;
  *renewed = !same_bytes(r->server, d + PROTOCOL_ANSWER_SERVER_AT, PROTOCOL_LIFE_BYTES);
  copy_bytes(r->server, d + PROTOCOL_ANSWER_SERVER_AT, PROTOCOL_LIFE_BYTES);
  /* More than has left cannot be stored. */
  if (stored <= r->sent) r->stored = stored > r->stored ? stored : r->stored;
  /* The first report that knows the life of the server counts there; one datagram may not hold all parts. */
  if (*renewed || r->stored > 0) r->news = true;
  r->trouble = d[PROTOCOL_ANSWER_TROUBLE_AT] != 0;
  if (!r->trouble) r->heard_us = now_us;
  return true;
}

/* Of the life of the server that is known; the next one. */
static bool is_order(const struct ring_reports *r, const uint8_t *d, uint16_t length,
                     struct ring_order *order) {
  if (length < PROTOCOL_RING_SEND_BYTES + PROTOCOL_RING_REPORT_END_BYTES ||
      length > RING_REPORTS_MOST_BYTES || !is_headed(r, d, PROTOCOL_KIND_SEND))
    return false;
  const uint16_t end = (uint16_t)(length - PROTOCOL_RING_REPORT_END_BYTES);
  *order = (struct ring_order){.counter = get_number(d + PROTOCOL_RING_SEND_COUNTER_AT, 4),
                               .destination = d[PROTOCOL_RING_SEND_DESTINATION_AT],
                               .urgent = (d[PROTOCOL_RING_SEND_FLAGS_AT] & PROTOCOL_RING_FLAG_URGENT) != 0,
                               .length = (uint16_t)get_number(d + PROTOCOL_RING_SEND_LENGTH_AT, 2),
                               .data = d + PROTOCOL_RING_SEND_BYTES};
  return order->length == end - PROTOCOL_RING_SEND_BYTES && is_tagged(r, d, end) &&
         same_bytes(d + PROTOCOL_RING_SEND_SERVER_AT, r->server, PROTOCOL_LIFE_BYTES) &&
         order->counter == r->taken + 1;
}

enum ring_datagram ring_reports_receive(struct ring_reports *r, const uint8_t *datagram, uint16_t length,
                                        struct ring_order *order, bool *renewed, uint64_t now_us) {
  *renewed = false;
  if (takes_answer(r, datagram, length, renewed, now_us)) return RING_DATAGRAM_ANSWER;
  if (is_order(r, datagram, length, order)) return RING_DATAGRAM_ORDER;
  ++r->refused;
  return RING_DATAGRAM_NONE;
}

void ring_reports_take(struct ring_reports *r, const struct ring_order *order) {
  r->taken = order->counter;
  r->news = true;
}

bool ring_reports_done(struct ring_reports *r, struct ring_part *part) {
  if (r->stored == 0) return false;
  *part = *part_at(r, 0);
  r->first = (r->first + 1) % RING_REPORTS_PARTS;
  ++r->oldest;
  --r->count;
  --r->sent;
  --r->stored;
  return true;
}

bool ring_reports_ends(const struct ring_reports *r) {
  return r->counter > LAST_NUMBER || r->taken > LAST_NUMBER || r->oldest > LAST_NUMBER;
}

bool ring_reports_silent(const struct ring_reports *r, uint64_t now_us) {
  return now_us - r->heard_us >= ms(r->config.silent_after_ms);
}

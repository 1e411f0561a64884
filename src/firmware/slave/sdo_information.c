/* SDO information: which objects there are, and what they are. */
#include "internal.h"

enum { OPCODE = 2, FRAGMENTS = 4, BODY = 6 }; /* in a message, counted from the CoE header */
enum { LIST = 1, OBJECT = 3, ENTRY = 5, ERROR = 7, REPLY = 1, INCOMPLETE = 0x80 };
enum { LIST_COUNTS = 0, LIST_ALL = 1, LIST_RX = 2, LIST_TX = 3, LISTS = 5 };
enum { ENTRY_BODY = 10 };
enum {
  HAS_ACCESS = 0x07,
  HAS_RANGE = 0x60
}; /* what an entry description tells: access; minimum and maximum */

static uint16_t begin(struct slave *slave, uint8_t opcode, uint16_t fragments) {
  uint8_t *reply = reply_of(slave);
  coe_header(reply, COE_SDO_INFORMATION);
  reply[OPCODE] = (uint8_t)(opcode | (fragments > 0 ? INCOMPLETE : 0));
  reply[OPCODE + 1] = 0;
  number_to(reply + FRAGMENTS, 2, fragments);
  return BODY;
}

static uint16_t refuse(struct slave *slave, uint32_t code) {
  const uint16_t at = begin(slave, ERROR, 0);
  number_to(reply_of(slave) + at, 4, code);
  return (uint16_t)(at + 4);
}

/* Objects of a list: all, or those with an entry that can be mapped. Nothing is stored or set at start-up. */
static bool is_in(const struct object *object, uint16_t list) {
  if (list == LIST_ALL) return true;
  if (list != LIST_RX && list != LIST_TX) return false;
  for (uint16_t i = 0; i <= object->highest; ++i)
    if (object->entries[i].access & (list == LIST_RX ? ACCESS_RX : ACCESS_TX)) return true;
  return false;
}

static uint16_t count_of(const struct slave *slave, uint16_t list) {
  uint16_t count = 0;
  for (uint16_t i = 0; i < slave->device->object_count; ++i) count += is_in(&slave->device->objects[i], list);
  return count;
}

/* The first fragment has the number of the list before the indexes. */
static uint16_t room(const struct slave *slave, bool first) {
  return (uint16_t)((reply_most(slave) - BODY - (first ? 2 : 0)) / 2);
}

static uint16_t add_indexes(struct slave *slave, uint16_t at, uint16_t most) {
  for (uint16_t n = 0; n < most && slave->list.left > 0; ++slave->list.at) {
    const struct object *object = &slave->device->objects[slave->list.at];
    if (!is_in(object, slave->list.kind)) continue;
    number_to(reply_of(slave) + at, 2, object->index);
    at = (uint16_t)(at + 2);
    --slave->list.left;
    ++n;
  }
  return at;
}

static uint16_t list(struct slave *slave, uint16_t kind) {
  if (kind > LISTS) return refuse(slave, SDO_RANGE);
  uint8_t *reply = reply_of(slave);
  if (kind == LIST_COUNTS) {
    uint16_t at = begin(slave, LIST + REPLY, 0);
    number_to(reply + at, 2, kind);
    for (uint16_t i = 1; i <= LISTS; ++i) number_to(reply + at + 2 * i, 2, count_of(slave, i));
    return (uint16_t)(at + 2 + 2 * LISTS);
  }
  const uint16_t first = room(slave, true), next = room(slave, false);
  slave->list.kind = kind;
  slave->list.at = 0;
  slave->list.left = count_of(slave, kind);
  const uint16_t rest = (uint16_t)(slave->list.left > first ? slave->list.left - first : 0);
  slave->list.fragments = (uint16_t)((rest + next - 1) / next);
  uint16_t at = begin(slave, LIST + REPLY, slave->list.fragments);
  number_to(reply + at, 2, kind);
  return add_indexes(slave, (uint16_t)(at + 2), first);
}

uint16_t sdo_information_next(struct slave *slave) {
  return add_indexes(slave, begin(slave, LIST + REPLY, --slave->list.fragments), room(slave, false));
}

/* As much of a name as the mailbox takes. */
static uint16_t add_name(struct slave *slave, uint16_t at, const char *name) {
  for (uint16_t i = 0; name[i] != 0 && at < reply_most(slave); ++i) reply_of(slave)[at++] = (uint8_t)name[i];
  return at;
}

static uint16_t describe_object(struct slave *slave, uint16_t index) {
  const struct object *object = slave_object(slave, index);
  if (!object) return refuse(slave, SDO_NO_OBJECT);
  const uint16_t at = begin(slave, OBJECT + REPLY, 0);
  uint8_t *body = reply_of(slave) + at;
  number_to(body, 2, index);
  number_to(body + 2, 2, object->type);
  body[4] = object->highest;
  body[5] = object->code;
  return add_name(slave, (uint16_t)(at + 6), object->name);
}

static uint16_t describe_entry(struct slave *slave, uint16_t index, uint8_t subindex, uint8_t asked) {
  const struct object *object = slave_object(slave, index);
  if (!object) return refuse(slave, SDO_NO_OBJECT);
  const struct object_entry *entry = entry_of(object, subindex);
  if (!entry) return refuse(slave, SDO_NO_SUBINDEX);
  /* A range only where the mailbox has room for it. */
  const bool fits = BODY + ENTRY_BODY + 2 * entry_bytes(entry) <= reply_most(slave);
  const uint8_t told = asked & (entry->range && fits ? HAS_ACCESS | HAS_RANGE : HAS_ACCESS);
  uint16_t at = begin(slave, ENTRY + REPLY, 0);
  uint8_t *body = reply_of(slave) + at;
  number_to(body, 2, index);
  body[2] = subindex;
  body[3] = told;
  number_to(body + 4, 2, entry->type);
  number_to(body + 6, 2, entry->bits);
  number_to(body + 8, 2, entry->access);
  at = (uint16_t)(at + ENTRY_BODY);
  for (uint8_t bit = 0x20; bit <= 0x40; bit = (uint8_t)(bit << 1)) {
    if (!(told & bit)) continue;
    const uint64_t limit = (uint64_t)(bit == 0x20 ? entry->range->low : entry->range->high);
    for (uint16_t i = 0; i < entry_bytes(entry); ++i) reply_of(slave)[at++] = (uint8_t)(limit >> (8 * i));
  }
  return add_name(slave, at, entry->name);
}

uint16_t sdo_information(struct slave *slave, const uint8_t *request, uint16_t length) {
  const uint16_t index = (uint16_t)number_at(request + BODY, 2);
  const uint8_t opcode = request[OPCODE] & 0x7f;
  /* The shortest request has an index: 8 bytes are there in any case. */
  if (opcode == LIST) return list(slave, index);
  if (opcode == OBJECT) return describe_object(slave, index);
  if (opcode == ENTRY && length >= BODY + 4)
    return describe_entry(slave, index, request[BODY + 2], request[BODY + 3]);
  return refuse(slave, SDO_SPECIFIER);
}

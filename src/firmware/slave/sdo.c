/* SDOs: expedited, normal and segmented, single entries and complete objects. A value goes through the
 * transfer memory, so that a long one is of one moment, and nothing is changed before all of it is there. */
#include "internal.h"

enum { COMMAND = 2, INDEX = 3, SUBINDEX = 5, DATA = 6, NORMAL_DATA = 10, SEGMENT_DATA = 3 };
enum { TOGGLE = 0x10, COMPLETE = 0x10, EXPEDITED = 0x02, SIZED = 0x01, LAST = 0x01 };
enum { DOWNLOAD_SEGMENT = 0, DOWNLOAD = 1, UPLOAD = 2, UPLOAD_SEGMENT = 3, ABORT = 4 };
enum { SEGMENT_TAKEN = 1, DOWNLOADED = 3 }; /* answers to the first two; those to uploads have their data */
enum { SHORTEST_SEGMENT = 7, SYNCHRONIZATION = 0x1c30 };

/* An object or one of its entries, as a request names it. */
struct target {
  const struct object *object;
  uint8_t subindex;
  bool complete;
};

uint32_t slave_value(const struct slave *slave, uint16_t index, uint8_t subindex) {
  uint8_t bytes[8] = {0};
  const struct object *object = slave_object(slave, index);
  const struct object_entry *entry = object ? entry_of(object, subindex) : 0;
  if (!entry || entry->bits > 32) return 0;
  entry_load(slave->memory.objects, entry, bytes);
  return number_at(bytes, 4);
}

static uint16_t start_reply(struct slave *slave, uint8_t command, uint16_t index, uint8_t subindex) {
  uint8_t *reply = reply_of(slave);
  coe_header(reply, COE_SDO_RESPONSE);
  reply[COMMAND] = command;
  number_to(reply + INDEX, 2, index);
  reply[SUBINDEX] = subindex;
  number_to(reply + DATA, 4, 0);
  return SDO_BYTES;
}

static uint16_t abort_reply(struct slave *slave, uint16_t index, uint8_t subindex, uint32_t code) {
  slave->sdo.kind = SDO_NONE;
  start_reply(slave, ABORT << 5, index, subindex);
  coe_header(reply_of(slave), COE_SDO_REQUEST); /* as ETG.1000.6 has it */
  number_to(reply_of(slave) + DATA, 4, code);
  return SDO_BYTES;
}

/* An abort code if this state gives no access; `access` has a bit for PREOP, SAFEOP and OP each. */
static uint32_t access_check(const struct slave *slave, uint16_t access, uint32_t never) {
  if (access == 0) return never;
  const uint16_t now = slave->state == AL_PREOP ? 1 : slave->state == AL_SAFEOP ? 2 : 4;
  return access & now ? 0 : SDO_STATE;
}
static uint32_t may_read(const struct slave *slave, const struct object_entry *entry) {
  return access_check(slave, entry->access & ACCESS_READ, SDO_WRITE_ONLY);
}
static uint32_t may_write(const struct slave *slave, const struct object_entry *entry) {
  const uint32_t code = access_check(slave, (entry->access & ACCESS_WRITE) >> 3, SDO_READ_ONLY);
  if (code) return code;
  return slave->state == AL_OP && pdo_maps_output(slave, entry) ? SDO_MAPPED : 0;
}

static uint32_t target_check(const struct target *t) {
  if (!t->object) return SDO_NO_OBJECT;
  if (t->complete) return t->subindex > 1 || t->object->code == OBJECT_VARIABLE ? SDO_UNSUPPORTED : 0;
  return entry_of(t->object, t->subindex) ? 0 : SDO_NO_SUBINDEX;
}

/* Subindexes of an object that a complete access covers, and where entry 1 begins in it, in bits: subindex 0
 * takes 16. Where masters may write subindex 0 the object is as long as that says. */
static uint8_t covered(const struct target *t, uint32_t count) {
  const bool grows = (t->object->entries[0].access & ACCESS_WRITE) != 0;
  return grows && count < t->object->highest ? (uint8_t)count : t->object->highest;
}
static uint32_t complete_bits(const struct target *t, uint8_t last) {
  uint32_t bits = t->subindex == 0 ? 16 : 0;
  for (uint16_t i = 1; i <= last; ++i) bits += t->object->entries[i].bits;
  return bits;
}

static void reads(const struct slave *slave, const struct target *t, uint8_t subindex) {
  const struct slave_application *a = slave->application;
  if (a->reads) a->reads(a->context, t->object->index, subindex);
}

/* ---- to the master ---- */

/* Everything that is asked for into the transfer memory. */
static uint32_t gather(struct slave *slave, const struct target *t, uint16_t *size) {
  uint8_t *to = slave->memory.transfer;
  if (!t->complete) {
    const struct object_entry *entry = entry_of(t->object, t->subindex);
    const uint32_t code = may_read(slave, entry);
    if (code) return code;
    reads(slave, t, t->subindex);
    entry_load(slave->memory.objects, entry, to);
    *size = entry_bytes(entry);
    return 0;
  }
  const uint8_t last = covered(t, slave_value(slave, t->object->index, 0));
  for (uint16_t i = t->subindex; i <= last; ++i) {
    const struct object_entry *entry = entry_of(t->object, (uint8_t)i);
    const uint32_t code = entry ? may_read(slave, entry) : 0;
    if (code) return code;
  }
  uint32_t at = t->subindex == 0 ? 16 : 0;
  if (t->subindex == 0) number_to(to, 2, slave_value(slave, t->object->index, 0));
  for (uint16_t i = 1; i <= last; ++i) {
    const struct object_entry *entry = entry_of(t->object, (uint8_t)i);
    if (!entry) continue;
    reads(slave, t, (uint8_t)i);
    if (entry->type == TYPE_TEXT) {
      entry_load(slave->memory.objects, entry, to + at / 8);
    } else {
      uint8_t bytes[8];
      entry_load(slave->memory.objects, entry, bytes);
      bits_write(to, at, entry->bits, bytes);
    }
    at += entry->bits;
  }
  for (; at % 8; ++at) bits_write(to, at, 1, (const uint8_t[]){0});
  *size = (uint16_t)(at / 8);
  return 0;
}

/* As much as the mailbox takes from `done` on; the length of the message. */
static uint16_t add_data(struct slave *slave, uint16_t where, uint16_t *added) {
  const uint16_t room = (uint16_t)(reply_most(slave) - where);
  const uint16_t left = (uint16_t)(slave->sdo.size - slave->sdo.done);
  *added = left < room ? left : room;
  for (uint16_t i = 0; i < *added; ++i)
    reply_of(slave)[where + i] = slave->memory.transfer[slave->sdo.done + i];
  slave->sdo.done = (uint16_t)(slave->sdo.done + *added);
  const uint16_t length = (uint16_t)(where + *added);
  return length < SDO_BYTES ? SDO_BYTES : length;
}

static uint16_t upload(struct slave *slave, const struct target *t, uint16_t index) {
  uint16_t size = 0, added;
  uint32_t code = target_check(t);
  if (!code) code = gather(slave, t, &size);
  if (code) return abort_reply(slave, index, t->subindex, code);
  slave->sdo.index = index;
  slave->sdo.subindex = t->subindex;
  slave->sdo.size = size;
  slave->sdo.done = 0;
  slave->sdo.toggle = false;
  const uint8_t command = UPLOAD << 5 | SIZED;
  const uint8_t complete = t->complete ? COMPLETE : 0;
  if (size > 0 && size <= 4) {
    start_reply(slave, (uint8_t)(command | complete | EXPEDITED | (4 - size) << 2), index, t->subindex);
    return add_data(slave, DATA, &added);
  }
  start_reply(slave, (uint8_t)(command | complete), index, t->subindex);
  number_to(reply_of(slave) + DATA, 4, size);
  if (size <= reply_most(slave) - NORMAL_DATA) return add_data(slave, NORMAL_DATA, &added);
  /* All of it in segments: there are masters that expect none before them. */
  slave->sdo.kind = SDO_UPLOAD;
  return SDO_BYTES;
}

static uint16_t upload_segment(struct slave *slave, uint8_t command) {
  if (slave->sdo.kind != SDO_UPLOAD) return abort_reply(slave, 0, 0, SDO_SPECIFIER);
  if (((command & TOGGLE) != 0) != slave->sdo.toggle)
    return abort_reply(slave, slave->sdo.index, slave->sdo.subindex, SDO_TOGGLE);
  slave->sdo.toggle = !slave->sdo.toggle;
  start_reply(slave, 0, 0, 0);
  uint16_t added;
  const uint16_t length = add_data(slave, SEGMENT_DATA, &added);
  const bool last = slave->sdo.done == slave->sdo.size;
  const uint8_t unused = added < SHORTEST_SEGMENT ? (uint8_t)(SHORTEST_SEGMENT - added) : 0;
  for (uint8_t i = 0; i < unused; ++i) reply_of(slave)[SEGMENT_DATA + added + i] = 0;
  reply_of(slave)[COMMAND] = (uint8_t)((command & TOGGLE) | unused << 1 | (last ? LAST : 0));
  if (last) slave->sdo.kind = SDO_NONE;
  return length;
}

/* ---- from the master ---- */

/* Whether these bytes can be a value of the entry. */
static uint32_t entry_may_be(const struct slave *slave, const struct target *t, uint8_t subindex,
                             const uint8_t *bytes) {
  const struct object_entry *entry = entry_of(t->object, subindex);
  const struct slave_application *a = slave->application;
  uint32_t code = may_write(slave, entry);
  if (!code) code = entry_check(entry, bytes);
  if (!code && (t->object->index & 0xfff0) == SYNCHRONIZATION && subindex == 1)
    code = process_type_check(slave, (uint16_t)number_at(bytes, 2));
  if (!code && a->may_write)
    code = a->may_write(a->context, t->object->index, subindex, bytes, entry_bytes(entry));
  return code;
}

static void written(const struct slave *slave, const struct target *t, uint8_t subindex) {
  const struct slave_application *a = slave->application;
  if (a->written) a->written(a->context, t->object->index, subindex);
}

/* The value at bit `at` of the transfer memory changes places with that of the object. */
static void exchange(struct slave *slave, const struct object_entry *entry, uint32_t at) {
  uint8_t *values = slave->memory.objects, *transfer = slave->memory.transfer;
  if (entry->type == TYPE_TEXT) {
    for (uint16_t i = 0; i < entry_bytes(entry); ++i) {
      const uint8_t before = values[entry->offset + i];
      values[entry->offset + i] = transfer[at / 8 + i];
      transfer[at / 8 + i] = before;
    }
    return;
  }
  uint8_t before[8], after[8];
  entry_load(values, entry, before);
  bits_read(transfer, at, entry->bits, after);
  entry_store(values, entry, after);
  bits_write(transfer, at, entry->bits, before);
}

/* Whether what PDOs count can be used. */
static uint32_t pdo_refusal(const struct slave *slave, const struct object *object) {
  return pdo_is_configuration(object->index) ? pdo_check(slave, object) : 0;
}

static uint32_t store_entry(struct slave *slave, const struct target *t, uint16_t size) {
  const struct object_entry *entry = entry_of(t->object, t->subindex);
  const uint16_t needed = entry_bytes(entry);
  if (size > needed) return SDO_TOO_LONG;
  if (size < needed && entry->type != TYPE_TEXT) return SDO_TOO_SHORT;
  for (uint16_t i = size; i < needed; ++i) slave->memory.transfer[i] = 0;
  const uint32_t code = entry_may_be(slave, t, t->subindex, slave->memory.transfer);
  if (code) return code;
  if (pdo_is_configuration(t->object->index) && t->subindex > 0 &&
      slave_value(slave, t->object->index, 0) > 0)
    return SDO_COUNT_NOT_0;
  exchange(slave, entry, 0);
  const uint32_t refused = t->subindex == 0 ? pdo_refusal(slave, t->object) : 0;
  if (refused) exchange(slave, entry, 0);
  else written(slave, t, t->subindex);
  return refused;
}

/* The bytes of an entry in the transfer memory, from bit `at` on. */
static const uint8_t *part(const struct slave *slave, const struct object_entry *entry, uint32_t at,
                           uint8_t bytes[8]) {
  if (entry->type == TYPE_TEXT) return slave->memory.transfer + at / 8;
  bits_read(slave->memory.transfer, at, entry->bits, bytes);
  return bytes;
}

/* All entries from subindex 1 to `last`, and their number. */
static void exchange_all(struct slave *slave, const struct target *t, uint8_t last, bool counts) {
  uint32_t at = t->subindex == 0 ? 16 : 0;
  for (uint16_t i = 1; i <= last; ++i) {
    const struct object_entry *entry = entry_of(t->object, (uint8_t)i);
    if (!entry) continue;
    exchange(slave, entry, at);
    at += entry->bits;
  }
  if (counts) exchange(slave, &t->object->entries[0], 0);
}

/* All or nothing: first every entry is checked. A count that nobody may write must be what it is. */
static uint32_t store_complete(struct slave *slave, const struct target *t, uint16_t size) {
  const struct object *object = t->object;
  uint8_t bytes[8];
  uint32_t count = slave_value(slave, object->index, 0);
  const bool counts = t->subindex == 0 && (object->entries[0].access & ACCESS_WRITE);
  if (t->subindex == 0) {
    if (size < 2) return SDO_TOO_SHORT;
    const uint32_t told = number_at(slave->memory.transfer, 1);
    if (!counts && told != count) return SDO_RANGE;
    if (told > object->highest) return SDO_TOO_HIGH;
    count = told;
    const uint32_t code = counts ? entry_may_be(slave, t, 0, slave->memory.transfer) : 0;
    if (code) return code;
  }
  const uint8_t last = covered(t, count);
  const uint32_t needed = (complete_bits(t, last) + 7) / 8;
  if (size != needed) return size < needed ? SDO_TOO_SHORT : SDO_TOO_LONG;
  const bool pdo = pdo_is_configuration(object->index);
  /* What is read by the count must not change under it. */
  if (pdo && !counts && count > 0) return SDO_COUNT_NOT_0;
  uint32_t at = t->subindex == 0 ? 16 : 0;
  for (uint16_t i = 1; i <= last; ++i) {
    const struct object_entry *entry = entry_of(object, (uint8_t)i);
    if (!entry) continue;
    const uint32_t code = entry_may_be(slave, t, (uint8_t)i, part(slave, entry, at, bytes));
    if (code) return code;
    at += entry->bits;
  }
  exchange_all(slave, t, last, counts);
  const uint32_t refused = counts ? pdo_refusal(slave, object) : 0;
  if (refused) {
    exchange_all(slave, t, last, counts);
    return refused;
  }
  for (uint16_t i = 1; i <= last; ++i)
    if (entry_of(object, (uint8_t)i)) written(slave, t, (uint8_t)i);
  if (counts) written(slave, t, 0);
  return 0;
}

static uint16_t finish_download(struct slave *slave, const struct target *t, uint16_t index, uint16_t reply) {
  const uint16_t size = slave->sdo.done;
  slave->sdo.kind = SDO_NONE;
  const uint32_t code = t->complete ? store_complete(slave, t, size) : store_entry(slave, t, size);
  return code ? abort_reply(slave, index, t->subindex, code) : reply;
}

static void take(struct slave *slave, const uint8_t *bytes, uint16_t count) {
  for (uint16_t i = 0; i < count; ++i) slave->memory.transfer[slave->sdo.done + i] = bytes[i];
  slave->sdo.done = (uint16_t)(slave->sdo.done + count);
}

static uint16_t download(struct slave *slave, const struct target *t, uint16_t index, const uint8_t *request,
                         uint16_t length) {
  const uint8_t command = request[COMMAND];
  uint32_t code = target_check(t);
  uint32_t most = 0, size;
  if (!code)
    most = t->complete ? (complete_bits(t, t->object->highest) + 7) / 8
                       : entry_bytes(entry_of(t->object, t->subindex));
  if (!code && !t->complete) code = may_write(slave, entry_of(t->object, t->subindex));
  const uint8_t *data = request + DATA;
  uint32_t there = 4;
  if (command & EXPEDITED) {
    size = command & SIZED ? 4u - (command >> 2 & 3) : most < 4 ? most : 4;
    there = size;
  } else {
    size = number_at(request + DATA, 4);
    data = request + NORMAL_DATA;
    there = length - (uint32_t)NORMAL_DATA;
  }
  if (!code && size > most) code = SDO_TOO_LONG;
  if (!code && there > size) code = SDO_LENGTH;
  if (code) return abort_reply(slave, index, t->subindex, code);
  slave->sdo.index = index;
  slave->sdo.subindex = t->subindex;
  slave->sdo.complete = t->complete;
  slave->sdo.size = (uint16_t)size;
  slave->sdo.done = 0;
  slave->sdo.toggle = false;
  take(slave, data, (uint16_t)there);
  const uint16_t reply =
      start_reply(slave, (uint8_t)(DOWNLOADED << 5 | (t->complete ? COMPLETE : 0)), index, t->subindex);
  if (there == size) return finish_download(slave, t, index, reply);
  slave->sdo.kind = SDO_DOWNLOAD;
  return reply;
}

static uint16_t download_segment(struct slave *slave, const uint8_t *request, uint16_t length) {
  const uint16_t index = slave->sdo.index;
  const struct target t = {slave_object(slave, index), slave->sdo.subindex, slave->sdo.complete};
  const uint8_t command = request[COMMAND];
  if (slave->sdo.kind != SDO_DOWNLOAD) return abort_reply(slave, 0, 0, SDO_SPECIFIER);
  if (((command & TOGGLE) != 0) != slave->sdo.toggle)
    return abort_reply(slave, index, t.subindex, SDO_TOGGLE);
  uint16_t count = (uint16_t)(length - SEGMENT_DATA);
  if (count == SHORTEST_SEGMENT) count = (uint16_t)(count - (command >> 1 & 7));
  if (count > slave->sdo.size - slave->sdo.done) return abort_reply(slave, index, t.subindex, SDO_TOO_LONG);
  take(slave, request + SEGMENT_DATA, count);
  slave->sdo.toggle = !slave->sdo.toggle;
  const uint16_t reply = start_reply(slave, (uint8_t)(SEGMENT_TAKEN << 5 | (command & TOGGLE)), 0, 0);
  if (!(command & LAST)) return reply;
  if (slave->sdo.done < slave->sdo.size) return abort_reply(slave, index, t.subindex, SDO_TOO_SHORT);
  return finish_download(slave, &t, index, reply);
}

uint16_t sdo_request(struct slave *slave, const uint8_t *request, uint16_t length) {
  const uint8_t command = request[COMMAND];
  const uint16_t index = (uint16_t)number_at(request + INDEX, 2);
  switch (command >> 5) {
    case DOWNLOAD_SEGMENT: return download_segment(slave, request, length);
    case UPLOAD_SEGMENT: return upload_segment(slave, command);
    case ABORT: slave->sdo.kind = SDO_NONE; return 0;
    default: break;
  }
  /* A new transfer ends one that was not finished. */
  slave->sdo.kind = SDO_NONE;
  const struct target t = {slave_object(slave, index), request[SUBINDEX], (command & COMPLETE) != 0};
  if (command >> 5 == DOWNLOAD) return download(slave, &t, index, request, length);
  if (command >> 5 == UPLOAD) return upload(slave, &t, index);
  return abort_reply(slave, index, t.subindex, SDO_SPECIFIER);
}

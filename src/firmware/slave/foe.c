/* FoE: files to and from the device, packet by packet, each acknowledged. */
#include "internal.h"

enum { OPCODE = 0, NUMBER = 2, DATA = 6 }; /* in a message; NUMBER: password, packet or error */
enum { READ = 1, WRITE = 2, PACKET = 3, ACKNOWLEDGE = 4, ERROR = 5, BUSY = 6 };

static uint16_t reply(struct slave *slave, uint8_t opcode, uint32_t number) {
  uint8_t *to = reply_of(slave);
  to[OPCODE] = opcode;
  to[OPCODE + 1] = 0;
  number_to(to + NUMBER, 4, number);
  return DATA;
}

static void close(struct slave *slave, bool complete) {
  const struct slave_application *a = slave->application;
  const bool open = slave->foe.kind != FOE_NONE || slave->foe.waits == FOE_FOR_OPENING;
  slave->foe.kind = FOE_NONE;
  slave->foe.waits = FOE_FOR_NOTHING;
  if (open && a->files.close) a->files.close(a->context, complete);
}

void foe_end(struct slave *slave) { close(slave, false); }

static uint16_t fail(struct slave *slave, uint32_t error) {
  close(slave, false);
  return reply(slave, ERROR, error);
}

/* Done and all in percent, as nobody knows how long it takes. */
static uint16_t busy(struct slave *slave) {
  reply(slave, BUSY, 0);
  number_to(reply_of(slave) + NUMBER, 2, 0);
  number_to(reply_of(slave) + NUMBER + 2, 2, 100);
  return DATA;
}

/* No answer before the program has one. */
static uint16_t wait(struct slave *slave, bool opening) {
  slave->foe.waits = opening ? FOE_FOR_OPENING : FOE_FOR_PACKET;
  return 0;
}

/* The packet at slave->foe.offset: the first time, or again. */
static uint16_t send_packet(struct slave *slave) {
  const struct slave_application *a = slave->application;
  const uint16_t most = (uint16_t)(reply_most(slave) - DATA);
  uint16_t length = 0;
  const uint32_t error = a->files.read(a->context, slave->foe.offset, reply_of(slave) + DATA, most, &length);
  if (error == SLAVE_FILE_BUSY) return wait(slave, false);
  if (error) return fail(slave, error);
  slave->foe.length = length < most ? length : most;
  reply(slave, PACKET, slave->foe.packet);
  return (uint16_t)(DATA + slave->foe.length);
}

static uint16_t open(struct slave *slave, const uint8_t *request, uint16_t length) {
  const struct slave_application *a = slave->application;
  const bool to_write = request[OPCODE] == WRITE;
  if (!a->files.open || (to_write ? !a->files.write : !a->files.read)) return fail(slave, FOE_NOT_FOUND);
  const uint32_t error = a->files.open(a->context, (const char *)request + DATA, (uint16_t)(length - DATA),
                                       number_at(request + NUMBER, 4), to_write);
  slave->foe.length = length;
  if (error == SLAVE_FILE_BUSY) return wait(slave, true);
  slave->foe.waits = FOE_FOR_NOTHING;
  if (error) return fail(slave, error);
  slave->foe.kind = to_write ? FOE_WRITING : FOE_READING;
  slave->foe.packet = 1;
  slave->foe.offset = 0;
  return to_write ? reply(slave, ACKNOWLEDGE, 0) : send_packet(slave);
}

static uint16_t take_packet(struct slave *slave, const uint8_t *request, uint16_t length) {
  const struct slave_application *a = slave->application;
  if (slave->foe.kind != FOE_WRITING) return fail(slave, FOE_ILLEGAL);
  if (number_at(request + NUMBER, 4) != slave->foe.packet) return fail(slave, FOE_PACKET);
  const uint16_t count = (uint16_t)(length - DATA);
  const bool last = length < slave->receive.length - MAILBOX_HEADER;
  const uint32_t error = a->files.write(a->context, slave->foe.offset, request + DATA, count, last);
  if (error == SLAVE_FILE_BUSY) return busy(slave);
  if (error) return fail(slave, error);
  slave->foe.offset += count;
  if (last) close(slave, true);
  return reply(slave, ACKNOWLEDGE, slave->foe.packet++);
}

static uint16_t go_on(struct slave *slave, uint32_t packet) {
  if (slave->foe.kind != FOE_READING) return fail(slave, FOE_ILLEGAL);
  if (packet != slave->foe.packet) return fail(slave, FOE_PACKET);
  const uint16_t most = (uint16_t)(reply_most(slave) - DATA);
  if (slave->foe.length < most) {
    close(slave, true);
    return 0;
  }
  slave->foe.offset += slave->foe.length;
  ++slave->foe.packet;
  return send_packet(slave);
}

/* A request for a file is still where it was: no other one is taken meanwhile. */
uint16_t foe_again(struct slave *slave) {
  if (slave->foe.waits == FOE_FOR_OPENING)
    return open(slave, slave->memory.request + MAILBOX_HEADER, slave->foe.length);
  slave->foe.waits = FOE_FOR_NOTHING;
  return send_packet(slave);
}

uint16_t foe_request(struct slave *slave, const uint8_t *request, uint16_t length) {
  switch (request[OPCODE]) {
    case READ:
    case WRITE: close(slave, false); return open(slave, request, length);
    case PACKET: return take_packet(slave, request, length);
    case ACKNOWLEDGE: return go_on(slave, number_at(request + NUMBER, 4));
    case BUSY: return slave->foe.kind == FOE_READING ? send_packet(slave) : fail(slave, FOE_ILLEGAL);
    case ERROR: close(slave, false); return 0;
    default: return fail(slave, FOE_ILLEGAL);
  }
}

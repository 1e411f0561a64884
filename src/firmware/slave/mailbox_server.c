/* The mailbox: one message in, one out. A request is taken only when the reply before it was read, so that
 * every reply finds its place; emergencies go first, but leave every other place to what waits beside them.
 */
#include "internal.h"

void mailbox_begin(struct slave *slave, const struct slave_mailbox *receive,
                   const struct slave_mailbox *send) {
  slave->receive = (struct mailbox_area){receive->start, receive->length};
  slave->send = (struct mailbox_area){send->start, send->length};
  slave->received_counter = slave->sent_counter = 0;
  slave->anything_sent = slave->older_sent = slave->older_due = slave->newest_due = false;
  slave->repeated_waits = slave->blocked = slave->taking_back = false;
  slave->emergency_count = 0;
  slave->emergency_sent = slave->repeat_asked = false;
  slave->list.fragments = 0;
  slave->sdo.kind = SDO_NONE;
  if (mailbox_repeat_asked(slave->board)) mailbox_repeated(slave->board);
  sync_manager_switch(slave->board, MAILBOX_RECEIVE, true);
  sync_manager_switch(slave->board, MAILBOX_SEND, true);
}

void mailbox_end(struct slave *slave) {
  foe_end(slave);
  sync_manager_switch(slave->board, MAILBOX_RECEIVE, false);
  sync_manager_switch(slave->board, MAILBOX_SEND, false);
}

static void send(struct slave *slave, uint8_t type, uint16_t address, uint16_t length) {
  const struct mailbox_header header = {length, address, 0, type,
                                        slave->sent_counter = (uint8_t)(slave->sent_counter % 7 + 1)};
  slave->older_sent = slave->anything_sent;
  slave->anything_sent = true;
  slave->repeated_waits = false;
  slave->newest = !slave->newest;
  uint8_t *bytes = slave->memory.reply[slave->newest];
  mailbox_header_write(bytes, &header);
  mailbox_put(slave->board, &slave->send, bytes);
}

static void put_again(struct slave *slave, bool newest) {
  mailbox_put(slave->board, &slave->send, slave->memory.reply[newest ? slave->newest : !slave->newest]);
}

static void repeated(struct slave *slave) {
  slave->repeat_asked = false;
  mailbox_repeated(slave->board);
}

/* The last message that the master has read is lost; behind it may be one that was not read yet. A repeated
 * one that was not read is there already. */
static void repeat(struct slave *slave, bool full) {
  if (full && slave->older_sent && !slave->newest_due && !slave->repeated_waits) {
    slave->taking_back = true;
    sync_manager_switch(slave->board, MAILBOX_SEND, false);
    return;
  }
  if (!full && slave->anything_sent) {
    put_again(slave, !slave->newest_due);
    slave->repeated_waits = true;
  }
  repeated(slave);
}

static uint16_t error_reply(struct slave *slave, enum mailbox_error detail) {
  uint8_t *reply = reply_of(slave);
  number_to(reply, 2, 1); /* an error of the mailbox */
  number_to(reply + 2, 2, detail);
  return 4;
}

static uint16_t emergency_message(struct slave *slave) {
  const struct slave_emergency *e = &slave->emergencies[slave->first_emergency];
  uint8_t *reply = reply_of(slave);
  coe_header(reply, COE_EMERGENCY);
  number_to(reply + 2, 2, e->code);
  reply[4] = e->error_register;
  for (uint8_t i = 0; i < SLAVE_EMERGENCY_DATA; ++i) reply[5 + i] = e->data[i];
  slave->first_emergency = (uint8_t)((slave->first_emergency + 1) % SLAVE_EMERGENCIES);
  --slave->emergency_count;
  return SDO_BYTES;
}

/* An error of the mailbox itself; 0: the request is for its protocol. */
static uint8_t mistake(const struct slave *slave, const struct mailbox_header *header,
                       const uint8_t *request) {
  if (header->length > slave->receive.length - MAILBOX_HEADER) return MAILBOX_INVALID_SIZE;
  if (header->channel & 0x3f) return MAILBOX_CHANNEL;
  const uint8_t protocols = slave->device->protocols;
  if (header->type == MAILBOX_COE && (protocols & SLAVE_COE) && slave->state != AL_BOOT) {
    if (header->length < INFORMATION_BYTES) return MAILBOX_TOO_SHORT;
    const uint8_t service = request[1] >> 4;
    if (service == COE_SDO_REQUEST) return header->length < SDO_BYTES ? MAILBOX_TOO_SHORT : 0;
    return service == COE_SDO_INFORMATION ? 0 : MAILBOX_SERVICE;
  }
  if (header->type == MAILBOX_FOE && (protocols & SLAVE_FOE))
    return header->length < 6 ? MAILBOX_TOO_SHORT : 0;
  return MAILBOX_UNSUPPORTED;
}

static void answer(struct slave *slave) {
  struct mailbox_header header;
  mailbox_take(slave->board, &slave->receive, slave->memory.request, slave->by_write);
  mailbox_header_read(slave->memory.request, &header);
  /* The same counter: the master has sent it again and got the answer already. Nobody answers an error. */
  const bool again = header.counter != 0 && header.counter == slave->received_counter;
  slave->received_counter = header.counter;
  if (again || header.type == MAILBOX_ERROR) return;
  const uint8_t *request = slave->memory.request + MAILBOX_HEADER;
  const uint8_t wrong = mistake(slave, &header, request);
  uint8_t type = header.type;
  uint16_t length;
  if (wrong) type = MAILBOX_ERROR, length = error_reply(slave, wrong);
  else if (type == MAILBOX_FOE) length = foe_request(slave, request, header.length);
  else if (request[1] >> 4 == COE_SDO_REQUEST) length = sdo_request(slave, request, header.length);
  else length = sdo_information(slave, request, header.length);
  slave->reply_address = header.address;
  if (length > 0) send(slave, type, header.address, length);
}

/* The switch off has acted, perhaps long after it was asked for: on again, and both messages are due. */
static void take_back(struct slave *slave) {
  if (!slave->taking_back || sync_manager_is_on(slave->board, MAILBOX_SEND)) return;
  slave->taking_back = false;
  slave->older_due = slave->newest_due = true;
  sync_manager_switch(slave->board, MAILBOX_SEND, true);
}

/* What was begun goes on before a request is taken. */
static void go_on(struct slave *slave) {
  if (slave->list.fragments > 0) {
    send(slave, MAILBOX_COE, slave->reply_address, sdo_information_next(slave));
  } else if (slave->foe.waits) {
    const uint16_t length = foe_again(slave);
    if (length > 0) send(slave, MAILBOX_FOE, slave->reply_address, length);
  } else if (mailbox_is_full(slave->board, MAILBOX_RECEIVE)) {
    answer(slave);
  }
}

/* The next message to the master, as its mailbox is empty. */
static void send_next(struct slave *slave) {
  if (slave->older_due) {
    slave->older_due = false;
    put_again(slave, false);
    repeated(slave);
    return;
  }
  if (slave->newest_due) {
    slave->newest_due = false;
    put_again(slave, true);
    return;
  }
  if (slave->emergency_sent || slave->emergency_count == 0) {
    slave->emergency_sent = false;
    go_on(slave);
    if (slave->emergency_count == 0 || mailbox_is_full(slave->board, MAILBOX_SEND)) return;
  }
  send(slave, MAILBOX_COE, 0, emergency_message(slave));
  slave->emergency_sent = true;
}

void mailbox_serve(struct slave *slave) {
  take_back(slave);
  /* Until frames have passed nothing can be written. */
  if (slave->taking_back || !sync_manager_is_on(slave->board, MAILBOX_SEND)) return;
  bool full = mailbox_is_full(slave->board, MAILBOX_SEND);
  if (!full) slave->repeated_waits = false;
  if (!slave->older_due && slave->repeat_asked) {
    repeat(slave, full);
    take_back(slave);
    full = mailbox_is_full(slave->board, MAILBOX_SEND);
  }
  if (!full && !slave->taking_back && sync_manager_is_on(slave->board, MAILBOX_SEND)) {
    send_next(slave);
    full = mailbox_is_full(slave->board, MAILBOX_SEND);
  }
  slave->blocked = full;
}

void mailbox_switched(struct slave *slave) { slave->repeat_asked = mailbox_repeat_asked(slave->board); }

uint32_t mailbox_events(const struct slave *slave) {
  if (slave->blocked) return event_of(MAILBOX_SEND);
  return slave->foe.waits ? 0 : event_of(MAILBOX_RECEIVE); /* what waits for the program waits for no event */
}

bool slave_emergency(struct slave *slave, uint16_t code, uint8_t error_register, const uint8_t *data) {
  const bool has_coe =
      slave->device->protocols & SLAVE_COE && slave->state != AL_INIT && slave->state != AL_BOOT;
  if (!has_coe || slave->emergency_count == SLAVE_EMERGENCIES) return false;
  struct slave_emergency *e =
      &slave->emergencies[(slave->first_emergency + slave->emergency_count) % SLAVE_EMERGENCIES];
  e->code = code;
  e->error_register = error_register;
  for (uint8_t i = 0; i < SLAVE_EMERGENCY_DATA; ++i) e->data[i] = data ? data[i] : 0;
  ++slave->emergency_count;
  return true;
}

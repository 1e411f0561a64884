/* What the files of the stack know of each other. */
#ifndef FLYFRAME_SLAVE_INTERNAL_H
#define FLYFRAME_SLAVE_INTERNAL_H

#include "slave_stack.h"

/* state_machine.c */
void slave_fall(struct slave *slave, uint8_t state, uint16_t code);

/* mailbox_server.c: on and off; the next message. */
void mailbox_begin(struct slave *slave, const struct slave_mailbox *receive,
                   const struct slave_mailbox *send);
void mailbox_end(struct slave *slave);
void mailbox_serve(struct slave *slave);
void mailbox_switched(struct slave *slave);         /* the master has written an activation */
uint32_t mailbox_events(const struct slave *slave); /* those that are served */
/* Where the next message to the master is put together, and how long it may be. It leaves when its handler
 * returns its length; 0: there is none. */
static inline uint8_t *reply_of(struct slave *slave) {
  return slave->memory.reply[!slave->newest] + MAILBOX_HEADER;
}
static inline uint16_t reply_most(const struct slave *slave) {
  return (uint16_t)(slave->send.length - MAILBOX_HEADER);
}

/* Handlers: a request of `length` bytes behind the mailbox header; the length of the reply. */
enum { COE_HEADER = 2, SDO_BYTES = 10, INFORMATION_BYTES = 8 }; /* the shortest, with the CoE header */
enum { COE_EMERGENCY = 1, COE_SDO_REQUEST = 2, COE_SDO_RESPONSE = 3, COE_SDO_INFORMATION = 8 };
uint16_t sdo_request(struct slave *slave, const uint8_t *request, uint16_t length);     /* sdo.c */
uint16_t sdo_information(struct slave *slave, const uint8_t *request, uint16_t length); /* and _next: */
uint16_t sdo_information_next(struct slave *slave);                                     /* the list */
uint16_t foe_request(struct slave *slave, const uint8_t *request, uint16_t length);     /* foe.c */
uint16_t foe_again(struct slave *slave); /* of what the program was busy for; 0: it still is */
void foe_end(struct slave *slave);
static inline void coe_header(uint8_t *reply, uint8_t service) {
  number_to(reply, COE_HEADER, (uint32_t)service << 12);
}

static inline const struct object *slave_object(const struct slave *slave, uint16_t index) {
  return object_find(slave->device->objects, slave->device->object_count, index);
}
/* A number of up to 32 bits among the values; 0 if there is no such entry. */
uint32_t slave_value(const struct slave *slave, uint16_t index, uint8_t subindex);

/* pdo.c: whether the mapping or assignment `object` can be used as it stands, as an SDO abort code. */
bool pdo_is_configuration(uint16_t index);
uint32_t pdo_check(const struct slave *slave, const struct object *object);
/* Makes the lists of what is mapped; an AL status code if something cannot be. */
uint16_t pdo_resolve(struct slave *slave);
bool pdo_maps_output(const struct slave *slave, const struct object_entry *entry);

/* process_data.c */
uint32_t process_type_check(const struct slave *slave, uint16_t type); /* of synchronization: an abort code */
uint16_t process_check(struct slave *slave);          /* AL status code: may SAFEOP be entered? */
uint16_t outputs_check(struct slave *slave);          /* the same for OP */
uint16_t process_settings(const struct slave *slave); /* the SyncManagers, as they must be in SAFEOP and OP */
void process_begin(struct slave *slave);
void process_switched(struct slave *slave); /* SyncManagers may have been off: inputs are written again */
void outputs_begin(struct slave *slave);
void process_end(struct slave *slave);
bool process_receive(struct slave *slave, uint32_t events); /* takes outputs; whether there are new ones */
void process_serve(struct slave *slave, uint32_t events, bool received);
uint32_t process_events(const struct slave *slave); /* those that are served */

#endif

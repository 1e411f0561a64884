/* Mailboxes: messages of a master in SyncManager 0, those to it in SyncManager 1, and their repetition. */
#ifndef FLYFRAME_MAILBOX_H
#define FLYFRAME_MAILBOX_H

#include "controller.h"

enum { MAILBOX_RECEIVE = 0, MAILBOX_SEND = 1 }; /* numbers of SyncManagers, as the host sees them */
enum { MAILBOX_HEADER = 6 };                    /* bytes before the message (chapter 15 of the rule book) */
enum { MAILBOX_ERROR = 0, MAILBOX_COE = 3, MAILBOX_FOE = 4 }; /* types */

struct mailbox_header {
  uint16_t length;  /* of the message, without this header */
  uint16_t address; /* station address of who has sent it first; 0 is the master */
  uint8_t channel;  /* bits 0 to 5; 6 and 7 are the priority */
  uint8_t type;
  uint8_t counter; /* 1 to 7 in turns; 0: not counted */
};
void mailbox_header_read(const uint8_t *bytes, struct mailbox_header *header);
void mailbox_header_write(uint8_t *bytes, const struct mailbox_header *header);

/* Where a mailbox lies. */
struct mailbox_area {
  uint16_t start, length;
};

bool mailbox_is_full(struct board *board, uint8_t number);
/* Takes the message out of a full mailbox: all of its `area->length` bytes, which empties it. */
void mailbox_take(struct board *board, const struct mailbox_area *area, uint8_t *bytes, bool by_write);
/* Puts a message, with its header, into an empty mailbox: what its header counts, and the last byte, which
 * fills it. */
void mailbox_put(struct board *board, const struct mailbox_area *area, const uint8_t *bytes);

/* The master asks for the last message again (SM-35): true until mailbox_repeated(). It ends the event of the
 * activation, and so whoever asks looks at that again. */
bool mailbox_repeat_asked(struct board *board);
void mailbox_repeated(struct board *board); /* of a mailbox that the host has on */

#endif

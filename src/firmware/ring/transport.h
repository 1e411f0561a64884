/* Messages of up to 2 KiB between the nodes of a fibre ring, delivered exactly once, and process data. The
 * rules: docs/rules/transport.md. No function waits; what is due is done by `transport_poll`. */
#ifndef FLYFRAME_RING_TRANSPORT_H
#define FLYFRAME_RING_TRANSPORT_H

#include "port.h"

/* Buffers for messages of more than six bytes that come in (TP-32), at least 4. */
#ifndef TRANSPORT_BUFFERS
#define TRANSPORT_BUFFERS 4
#endif

enum {
  TRANSPORT_MESSAGE_BYTES = 2048,
  TRANSPORT_SHORT_BYTES = 6, /* a message of so many goes as SHORT */
  TRANSPORT_SHORTS = 8,      /* such messages that wait for the host */
  TRANSPORT_SLOTS = 16,      /* frames in the port, at most */
  TRANSPORT_FEWEST_SLOTS = 8,
  TRANSPORT_OUTGOING = 16, /* messages under way, the last place for urgent ones only */
  TRANSPORT_ANSWERS = 16,  /* answers that wait for a slot, the last four places for urgent ones only */
  TRANSPORT_OBJECTS = 64,  /* values of process data that are sent */
  TRANSPORT_WATCHED = 64,  /* values of process data that are followed */
  TRANSPORT_NODES = RING_LAST_ADDRESS + 1,
  TRANSPORT_MAP_BYTES = (TRANSPORT_NODES + 7) / 8, /* a bit per address, bit a % 8 of byte a / 8 */
  TRANSPORT_PARTS = TRANSPORT_MESSAGE_BYTES / RING_FRAME_BYTES,
  TRANSPORT_HELLO_BYTES = 7
};

struct transport_config {
  uint8_t address;                      /* 1 to 125 */
  uint8_t life;                         /* number of the start, mod 128, from non-volatile memory */
  uint16_t kbps;                        /* of the ring, 5 to 2000 */
  uint8_t slots;                        /* frames in the port, 8 to 16, else 8 (TB-04) */
  uint16_t pd_ms;                       /* process data are sent again after this time, 1 to 1000 */
  uint16_t hello_ms;                    /* between two HELLO, the same in all, up to 2,500; 0: by TB-28 */
  uint8_t hello[TRANSPORT_HELLO_BYTES]; /* HELLO behind the life: ring state, ports, ... */
};

/* What is counted; each frame that is ignored counts once. */
enum transport_counter {
  TRANSPORT_MALFORMED,    /* control frames that are none; DLC above 8 */
  TRANSPORT_WRONG_SOURCE, /* source 0, 126 or 127 */
  TRANSPORT_OWN_ADDRESS,  /* from the own address */
  TRANSPORT_FOREIGN,      /* to another node */
  TRANSPORT_OLD_LIFE,     /* of a life older than the source's */
  TRANSPORT_OLD_NUMBER,   /* OPEN or SHORT of a message before the last one */
  TRANSPORT_WRONG_LENGTH, /* OPEN of a message that is too long, or would go as SHORT */
  TRANSPORT_NO_BUFFER,    /* OPEN or SHORT that found no buffer */
  TRANSPORT_TOO_HIGH,     /* data behind the end of their message */
  TRANSPORT_WRONG_DLC,
  TRANSPORT_WRONG_END,   /* data with a wrong end mark */
  TRANSPORT_DOUBLE,      /* data that came already */
  TRANSPORT_NO_MESSAGE,  /* data of no open message */
  TRANSPORT_UNEXPECTED,  /* answers that no message awaits; CLOSE of one that has ended */
  TRANSPORT_BEYOND_END,  /* MISSING that names nothing, or a frame behind the end */
  TRANSPORT_BAD_CRC,     /* messages that came whole, with a wrong CRC */
  TRANSPORT_DROPPED,     /* open messages that were dropped */
  TRANSPORT_ANSWER_LOST, /* answers for which there was no place, in time */
  TRANSPORT_UNWATCHED,   /* process data of an object that is not followed */
  TRANSPORT_COUNTERS
};

/* A message for the host. */
struct transport_message {
  uint8_t source, pipe, number;
  uint8_t life; /* of its sender */
  bool to_all, urgent;
  bool repeat; /* it may be a repeat */
  uint16_t length;
  const uint8_t *data;
};

enum transport_outcome { TRANSPORT_IS_DELIVERED, TRANSPORT_IS_REFUSED, TRANSPORT_NOT_CONFIRMED };

/* How a message of the host has ended. */
struct transport_end {
  uint16_t tag;
  enum transport_outcome outcome;
  uint8_t unconfirmed[TRANSPORT_MAP_BYTES]; /* the nodes that have not delivered it */
};

#include "state.h"

/* Begins a life. Nothing of an earlier one may wait in the port. A transport of zeros has not begun: it takes
 * nothing, and has nothing. */
void transport_start(struct transport *transport, struct can_port *port,
                     const struct transport_config *config, uint64_t now_us);

/* A frame has come. */
void transport_receive(struct transport *transport, const struct ring_frame *frame, uint64_t now_us);

/* Does what is due. To be called after frames have come or left and after any other call, and at the time
 * that it returns. */
uint64_t transport_poll(struct transport *transport, uint64_t now_us);

/* Sends a message of 1 to 2,048 bytes, which must stay where they are until it has ended. `tag` is the host's
 * own number of it. `members`: who has to confirm a message to all (destination 0); null: everyone of whom a
 * HELLO came within `transport_member_us`. If that is nobody it ends as not confirmed. False: it is
 * impossible, or there is no place. */
bool transport_send(struct transport *transport, uint16_t tag, uint8_t destination, bool urgent,
                    const uint8_t *data, uint16_t length, const uint8_t *members, uint64_t now_us);

/* Gives a message up: it ends as not confirmed, unless it is delivered before that. */
void transport_cancel(struct transport *transport, uint16_t tag);

/* The next message that has ended; false: there is none. */
bool transport_ended(struct transport *transport, struct transport_end *end);

/* The message that the host is to take next, urgent ones first; null: there is none. It stays until the host
 * takes or refuses it; only then its sender is told. */
const struct transport_message *transport_received(const struct transport *transport);
void transport_take(struct transport *transport, const struct transport_message *message, bool refuse);

/* The host has the message in work: it stays until it is taken, but the next one is received now. */
void transport_hold(struct transport *transport, const struct transport_message *message);

/* The nodes of which a HELLO came within `transport_member_us`. */
void transport_members(const struct transport *transport, uint8_t map[TRANSPORT_MAP_BYTES], uint64_t now_us);

/* What a node has told in its last HELLO: its life, then as in the configuration. False: there was none. */
bool transport_told(const struct transport *transport, uint8_t source, uint8_t *life,
                    uint8_t bytes[TRANSPORT_HELLO_BYTES]);

/* A node of which no HELLO has come for so long is there no more. */
uint64_t transport_member_us(const struct transport *transport);

/* Changes when a HELLO tells something else than the node's last one. */
uint32_t transport_news(const struct transport *transport);

/* HELLO has other bytes from now on; that a port has come up or gone down is told early (TB-33). */
void transport_hello(struct transport *transport, const uint8_t bytes[TRANSPORT_HELLO_BYTES]);

/* A value of process data, `length` 1 to 8 bytes; 0: no valid value. False: there is no place. */
bool transport_object(struct transport *transport, uint8_t destination, uint8_t number, const uint8_t *data,
                      uint8_t length);

/* Follows an object of a node; false: there is no place. */
bool transport_watch(struct transport *transport, uint8_t source, uint8_t number);

/* Follows and sends no values from now on. */
void transport_forget_values(struct transport *transport);

/* The newest value of an object that is followed: its length, 0 without a valid one. `old`: none has come for
 * three times `pd_ms`. */
uint8_t transport_value(const struct transport *transport, uint8_t source, uint8_t number, uint8_t data[8],
                        bool *old, uint64_t now_us);

#endif

/* What a transport remembers. Included by transport.h; nothing of it is for the host. */
#ifndef FLYFRAME_RING_STATE_H
#define FLYFRAME_RING_STATE_H

/* A message under way. */
struct transport_outgoing {
  bool used, over, urgent;
  bool open;     /* OPEN or SHORT is to be sent */
  bool closing;  /* CLOSE is to be sent */
  bool waits;    /* for the time that a BUSY has named */
  bool went_out; /* all of its frames have left once */
  uint8_t destination, pipe, number, tries;
  uint8_t waited;    /* waits that have passed since its receiver was found busy */
  uint8_t answering; /* of a message to all: nodes that may answer */
  uint16_t tag, length;
  uint32_t crc, answers, most_answers;
  uint8_t todo[TRANSPORT_PARTS / 8]; /* data frames to be sent */
  uint8_t awaited[TRANSPORT_MAP_BYTES], unconfirmed[TRANSPORT_MAP_BYTES];
  enum transport_outcome outcome;
  const uint8_t *data;
  uint64_t wait_end, restarted_at, left_at, progress_at;
  uint64_t asked_from; /* it had gone out, or the last answer behind that has come */
};

/* A buffer for a message that comes in. */
struct transport_incoming {
  enum { INCOMING_FREE, INCOMING_OPEN, INCOMING_COMPLETE } state;
  bool held;     /* the host has it in work */
  bool detached; /* its source has begun a new life, or is forgotten */
  bool passed;   /* a newer one of its pipe has come, or nothing for long: it is not awaited (TB-25) */
  uint16_t parts, received;
  uint16_t sent;   /* frames before this one have left their sender, as far as is known */
  bool opened;     /* OPEN has come last */
  int16_t highest; /* the highest frame that a MISSING has named, or -1 */
  uint8_t gaps;
  uint8_t bitmap[TRANSPORT_PARTS / 8];
  uint32_t crc, order;
  uint64_t heard_at;
  struct transport_message message;
  uint8_t *data;
};

struct transport_source {
  bool known;
  uint8_t life;
  uint64_t heard_at;
};

/* A pipe of a source. There are many: they are kept small. */
struct transport_pipe {
  bool has_last : 1, refused : 1; /* the last message delivered or refused */
  bool seen : 1;                  /* the host has got a message of it */
  bool answered : 1;
  uint8_t last;
  uint16_t answered_ms; /* rounded up, mod 65,536 */
  uint32_t heard_s;     /* something of it has come last */
};

struct transport_slot {
  uint64_t put_at;
  struct ring_frame frame;
};

struct transport_answer {
  bool to_all;
  uint64_t put_at;
  struct ring_frame frame;
};

struct transport_object {
  bool used, due;
  uint8_t destination, number, length;
  uint8_t data[RING_FRAME_BYTES];
  uint64_t due_at;
};

struct transport_watched {
  bool used, heard;
  uint8_t source, number, length;
  uint8_t data[RING_FRAME_BYTES];
  uint64_t heard_at;
};

enum { TRANSPORT_PLACES = TRANSPORT_BUFFERS + TRANSPORT_SHORTS };

struct transport {
  struct can_port *port;
  struct transport_config config;
  uint64_t now_us; /* when a frame came, or was looked, last */
  uint32_t counters[TRANSPORT_COUNTERS];

  /* What waits in the port, and answers that wait for a place there, the oldest first. */
  struct transport_slot slots[TRANSPORT_SLOTS];
  uint8_t slot_count;
  bool holds; /* answers are among them; data frames are held back, and go free, since `held_from` (TB-31) */
  uint64_t held_from;
  struct transport_answer answers[TRANSPORT_ANSWERS];
  uint8_t answer_count;

  struct transport_outgoing outgoing[TRANSPORT_OUTGOING];
  uint8_t turn[2]; /* of each urgency: the place behind the one that has sent last */
  uint8_t numbers[TRANSPORT_NODES][RING_PIPES]; /* of the next message */
  uint8_t unheard[TRANSPORT_NODES][RING_PIPES]; /* numbers used of which nobody may have heard (TB-26) */
  uint16_t left_s[TRANSPORT_NODES][RING_PIPES]; /* a frame of it has left last, mod 65,536 */

  struct transport_source sources[TRANSPORT_NODES];
  struct transport_pipe pipes[TRANSPORT_NODES][2][RING_PIPES]; /* to this node, to all */
  struct transport_incoming incoming[TRANSPORT_PLACES];
  uint32_t order;
  uint8_t buffers[TRANSPORT_BUFFERS][TRANSPORT_MESSAGE_BYTES];
  uint8_t shorts[TRANSPORT_SHORTS][TRANSPORT_SHORT_BYTES];

  bool hello_due;
  uint64_t hello_at;  /* when the last one was due */
  bool hello_news;    /* a port has come up or gone down since */
  uint64_t news_from; /* from then on that may be told early again (TB-33) */
  uint8_t known;      /* nodes of which a HELLO has come */
  bool member[TRANSPORT_NODES];
  uint8_t told[TRANSPORT_NODES][1 + TRANSPORT_HELLO_BYTES]; /* in the last HELLO */
  uint32_t news;                                            /* times that a HELLO told something else */
  uint64_t member_at[TRANSPORT_NODES];
  struct transport_object objects[TRANSPORT_OBJECTS];
  uint8_t object_turn; /* the place behind the one that has sent last */
  struct transport_watched watched[TRANSPORT_WATCHED];
  uint32_t heard; /* values that were followed */
};

#endif

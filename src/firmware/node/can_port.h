/* Frames of the transport through the CAN port that a ring node has on its ring (presets ring-bus and, in
 * relay mode, too, ring-node): its registers are reached by the driver's `board_read` and `board_write`. */
#ifndef FLYFRAME_CAN_PORT_H
#define FLYFRAME_CAN_PORT_H

#include "../driver/transport.h"
#include "../ring/port.h"

enum {
  CAN_PORT_SLOTS = 16,    /* in relay mode */
  CAN_PORT_BUS_SLOTS = 8, /* in bus mode: slots 0 to 7; the others are not touched */
};

struct can_port {
  struct board *board;
  bool relay;
  bool works;    /* it was started, and is not lost */
  uint8_t slots; /* that are used, see can_port_slots */
  uint32_t ids[CAN_PORT_SLOTS]; /* of the frame that was put into each slot last */
};

struct can_port_config {
  uint8_t address;  /* 1 to 125 */
  bool home;        /* bus mode: in one node of the ring, normally the server's (FR-30) */
  bool relay;       /* relay mode, in all nodes of the ring */
  uint16_t kbps;    /* bus mode: 5 to 1000, core_mhz * 40 must be a multiple of it; relay mode: 400 to 2000,
                       core_mhz * 1000 must be */
  uint8_t core_mhz; /* core clock, 50 or 100 */
  uint8_t up_ms;    /* until a port comes up (FR-12), the same in all nodes; 0: 10, as out of reset */
  /* Relay mode: */
  uint32_t confirm_us; /* until a frame is repeated, up to 655,350; 0: 20,000 bits (FR-58) */
  uint8_t life;        /* number of this start, modulo 128, from memory that keeps it (FR-61) */
  /* Nodes with a twisted pair (preset ring-node-tp): */
  uint16_t pair_kbps; /* 5 to 1000, core_mhz * 40 must be a multiple of it; 0: it is not used, and stopped */
  bool bridge;        /* whatever is neither to this node nor to all passes between ring and pair (BR-01) */
};

/* What the transport may have there (its `slots`); a bridge has 8 to 15. */
uint8_t can_port_slots(bool relay, bool bridge);

/* Sets up the node, in bus mode with the bit timing of FR-38, forgets what waits and what came, and takes
 * part. It receives data frames of 29 bits to its address and to all. False: the bit rate is impossible, or
 * there is no such node. */
bool can_port_start(struct can_port *port, struct board *board, const struct can_port_config *config);

/* Whether the node still runs as it was started: after a reset of its own it does not. */
bool can_port_runs(const struct can_port *port);

/* There is no such node any more, until the next start: nothing waits there, and nothing can be sent. */
void can_port_lose(struct can_port *port);

/* The oldest frame received that is no bridge's alone; false: there is none. */
bool can_port_receive(struct can_port *port, struct ring_frame *frame);

#endif

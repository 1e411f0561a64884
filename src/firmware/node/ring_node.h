/* The host program of a ring node (presets ring-bus and ring-node): sets the node up, and moves frames
 * between its CAN port and the transport. What the device does with messages and process data, its main loop
 * does through the functions of the transport:
 *
 *   ring_node_start(&node, board, &parameters);
 *   for (;;) {
 *     ring_node_wait(&node, 1000);
 *     ring_node_serve(&node);
 *     while ((message = transport_received(&node.transport)) != 0) ...
 *   }
 */
#ifndef FLYFRAME_RING_NODE_PROGRAM_H
#define FLYFRAME_RING_NODE_PROGRAM_H

#include "../port.h"
#include "../ring/transport.h"
#include "can_port.h"

struct ring_node_parameters {
  uint8_t address;     /* 1, the server or gateway, to 125 */
  bool home;           /* bus mode: the ring is open here (FR-30) */
  bool relay;          /* relay mode, in all nodes of the ring */
  uint16_t kbps;       /* as in struct can_port_config */
  uint8_t core_mhz;    /* 50 or 100 */
  uint32_t confirm_us; /* relay mode, as in struct can_port_config */
  uint8_t up_ms;       /* as in struct can_port_config */
  uint16_t pair_kbps;  /* twisted pair, as in struct can_port_config */
  bool bridge;
  uint16_t pd_ms;       /* process data are sent again after this time, 1 to 1000 */
  uint16_t hello_ms;    /* between two HELLO, the same in all nodes, for demonstrations; 0: by TB-28 */
  uint16_t device_type; /* of the device, for HELLO */
  uint8_t version;
  uint16_t other_events; /* of the controller that wake the host beside those of the node */
};

enum ring_node_fault {
  RING_NODE_GOOD,
  RING_NODE_NO_CONTROLLER, /* nothing answers, or another controller */
  RING_NODE_SETTINGS,      /* a parameter is impossible, or the controller does not hold it: nothing runs */
  /* The non-volatile memory does not work. The life is one or two ahead of the last, as long as the
   * controller has that; behind a loss of power a random one: others may ignore this node for 10 s,
   * on slow rings for longer (TP-20, TB-28). */
  RING_NODE_STORE
};

struct ring_node {
  struct board *board;
  struct ring_node_parameters parameters;
  enum ring_node_fault fault;
  bool began;               /* the transport has begun its life: the parameters are possible */
  uint8_t life, link_life;  /* of the controller's last start; of the node for its links now (FR-61) */
  bool life_is_new, stored; /* no start has used it yet; it is in memory */
  uint32_t starts;          /* of the controller since this program began; above 1 it was reset meanwhile */
  uint64_t now_us, due_us;
  bool more;      /* frames are left in the controller */
  uint32_t timer; /* the board's clock, when it was last read */
  uint8_t status[TRANSPORT_HELLO_BYTES];
  struct can_port port;
  struct transport transport;
};

/* Begins a life, also where there is no controller yet: what the transport is given waits for it. A fault is
 * told, and ends nothing that can go on. */
enum ring_node_fault ring_node_start(struct ring_node *node, struct board *board,
                                     const struct ring_node_parameters *parameters);

/* Does what is due, without waiting. A controller that was reset meanwhile, or has come back, is set up
 * anew; messages under way go on. While there is none they end in their time, and values become old. */
void ring_node_serve(struct ring_node *node);

/* Its two halves, for a program that has to see a start of the controller before anything leaves: the first
 * one sets up and receives, only the second one sends. */
void ring_node_look(struct ring_node *node);
void ring_node_poll(struct ring_node *node);

/* Whether frames can be sent and received. */
bool ring_node_runs(const struct ring_node *node);

/* Waits until something has come or is due, at most for so long, and for half a second. */
void ring_node_wait(struct ring_node *node, uint32_t most_us);

/* FR-62: another node has the same address. Own frames stop until this is called. */
bool ring_node_conflict(const struct ring_node *node);
void ring_node_clear_conflict(struct ring_node *node);

#endif

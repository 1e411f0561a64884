/* The host program of a ring under an EtherCAT master (preset ring-gateway, GW-01 to GW-03): the slave stack
 * on one side of the controller, the program of a ring node on the other. Process data of nodes become
 * inputs, outputs become process data for nodes, as the tables in objects 0x8010 and 0x8020 say; their
 * initial values are those of the device file.
 *
 *   gateway_start(&gateway, board, ring_board, &parameters);
 *   for (;;) {
 *     gateway_wait(&gateway, 1000);
 *     gateway_serve(&gateway);
 *   }
 */
#ifndef FLYFRAME_RING_GATEWAY_PROGRAM_H
#define FLYFRAME_RING_GATEWAY_PROGRAM_H

#include "ring-gateway.objects.h"
#include "ring_conflict.h"
#include "ring_node.h"
#include "ring_picture.h"

enum { GATEWAY_SLOTS = 64, GATEWAY_SLOT_BYTES = 8 };

/* An object of a node, in a slot of inputs or outputs. */
struct gateway_slot {
  uint8_t node; /* 0: the slot is not used */
  uint8_t object;
};

/* The slots of one direction, and the objects of the dictionary with their values and with their table. */
struct gateway_slots {
  const struct object *values, *table;
  struct gateway_slot slots[GATEWAY_SLOTS];
};

struct gateway {
  struct ring_gateway device;
  struct slave_application application;
  struct ring_node node;
  struct ring_picture picture;
  struct ring_conflict conflict;
  struct board *board;
  struct gateway_slots inputs, outputs;
  bool follows; /* the transport knows the tables */
  bool valid;   /* outputs */
  /* The same as the transport has been told last; `told`: anything. */
  bool told, told_valid;
  uint8_t told_values[GATEWAY_SLOTS][GATEWAY_SLOT_BYTES];
  uint32_t starts; /* of the ring's controller, for which the stack has started */
  uint32_t heard;  /* values of process data, when they were looked at last */
  uint32_t news;   /* of HELLO, likewise */
  uint8_t ports;
  uint64_t looked_us;
};

/* `board`: the controller as a slave. `ring_board`: the same one as a ring node, so that ESC_RING_SPACE
 * (ring-gateway.h) is added to addresses, and with the node's memory (port.h). Its board_wait() waits for
 * either interrupt pin of the controller. A fault of the ring is told, and ends nothing that can go on. */
enum ring_node_fault gateway_start(struct gateway *gateway, struct board *board, struct board *ring_board,
                                   const struct ring_node_parameters *parameters);

/* Does what is due, without waiting. */
void gateway_serve(struct gateway *gateway);

/* Waits until something has come or is due, at most for so long. */
void gateway_wait(struct gateway *gateway, uint32_t most_us);

#endif

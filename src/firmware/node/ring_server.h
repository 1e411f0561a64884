/* The host program of a ring's gateway to the plant server (preset ring-server; GW-04 to GW-06): node 1 of
 * the ring. Messages to it go to the server, and their senders are told that they are delivered when the
 * server has them on its disk; messages of the server go to nodes. It tells the server who is on the ring and
 * where the ring is broken. */
#ifndef FLYFRAME_RING_SERVER_PROGRAM_H
#define FLYFRAME_RING_SERVER_PROGRAM_H

#include "plant_port.h"
#include "ring_conflict.h"
#include "ring_node.h"
#include "ring_picture.h"
#include "ring_reports.h"

enum {
  RING_SERVER_ORDERS = 4, /* messages of the server that are under way */
  RING_SERVER_ORDER_BYTES = 1024,
  RING_SERVER_PORTS = 2,
  RING_SERVER_NODE_BYTES = 2 + TRANSPORT_HELLO_BYTES + RING_SERVER_PORTS /* there, life, HELLO, distances */
};

struct ring_server_parameters {
  struct ring_node_parameters node; /* its address is 1; `other_events` is set by this program */
  struct plant_config plant;
  struct ring_reports_config reports;
};

/* What the server has been told of a node, or is being told. */
struct ring_server_node {
  bool told, waits; /* anything; a part of it is not acknowledged yet */
  bool was_there;   /* in this life of the gateway */
  uint8_t length, bytes[RING_SERVER_NODE_BYTES];
  uint8_t distances[RING_SERVER_PORTS]; /* by port, and when they were heard last */
  uint64_t heard_us[RING_SERVER_PORTS];
};

struct ring_server_order {
  bool used;
  uint32_t counter;
  uint64_t taken_us;
  uint8_t data[RING_SERVER_ORDER_BYTES];
};

struct ring_server {
  struct ring_node node;
  struct ring_server_parameters parameters;
  struct ring_picture picture;
  struct ring_conflict conflict;
  struct ring_reports reports;
  bool began; /* the reports have their life: there was a random number */
  bool plant_works;
  uint8_t status;
  uint64_t looked_us, due_us;
  uint32_t news; /* of the transport, when the nodes were looked at last */
  uint8_t ports; /* of the own node then */
  struct ring_server_node nodes[TRANSPORT_NODES];
  struct ring_server_node ring; /* likewise, its ends */
  struct ring_server_order orders[RING_SERVER_ORDERS];
  uint8_t datagram[RING_REPORTS_MOST_BYTES];
};

/* Begins a life. A fault is told, and ends nothing that can go on. */
enum ring_node_fault ring_server_start(struct ring_server *server, struct board *board,
                                       const struct ring_server_parameters *parameters);

/* Does what is due, without waiting. */
void ring_server_serve(struct ring_server *server);

/* Waits until something has come or is due, at most for so long. */
void ring_server_wait(struct ring_server *server, uint32_t most_us);

#endif

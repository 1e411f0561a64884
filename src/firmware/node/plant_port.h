/* The port of a ring node to the plant network (preset ring-server): UDP datagrams to and from one server. */
#ifndef FLYFRAME_PLANT_PORT_H
#define FLYFRAME_PLANT_PORT_H

#include "../driver/transport.h"

enum { PLANT_MAC_BYTES = 6, PLANT_IP_BYTES = 4, PLANT_MOST_BYTES = 1472 };

struct plant_config {
  uint8_t mac[PLANT_MAC_BYTES], server_mac[PLANT_MAC_BYTES]; /* as written, first byte first */
  uint8_t ip[PLANT_IP_BYTES], server_ip[PLANT_IP_BYTES];
  uint16_t udp_port, server_port; /* not 0 */
};

/* False: a setting is impossible, or the controller does not hold it; the port hears and sends nothing. */
bool plant_port_start(struct board *board, const struct plant_config *config);

/* Whether it has been started and not been reset since. */
bool plant_port_runs(struct board *board);

/* Hands a datagram of up to PLANT_MOST_BYTES to the controller; false: it still sends the one before. */
bool plant_port_send(struct board *board, const uint8_t *data, uint16_t length);

/* Takes the oldest datagram that has come, of which `most` bytes at most; its length, 0: there is none. */
uint16_t plant_port_receive(struct board *board, uint8_t *data, uint16_t most);

#endif

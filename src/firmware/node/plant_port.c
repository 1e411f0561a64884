#include "plant_port.h"

#include "../driver/registers.h"
#include "../ring/bytes.h"
#include "ring-server.h"

enum { PORT_BYTES = 2 };

static bool port_holds(struct board *board, uint16_t address, uint16_t port) {
  uint8_t bytes[PORT_BYTES];
  put_number(bytes, port, sizeof bytes);
  return write_holds(board, address, bytes, sizeof bytes);
}

bool plant_port_start(struct board *board, const struct plant_config *c) {
  const bool possible = any_byte(c->mac, sizeof c->mac) && (c->mac[0] & 1) == 0 &&
                        any_byte(c->server_mac, sizeof c->server_mac) && any_byte(c->ip, sizeof c->ip) &&
                        any_byte(c->server_ip, sizeof c->server_ip) && c->udp_port != 0 &&
                        c->server_port != 0;
  write_number(board, NODE_PLANT_CONTROL, 1, 0);
  return possible && write_holds(board, NODE_PLANT_SERVER_MAC, c->server_mac, sizeof c->server_mac) &&
         write_holds(board, NODE_PLANT_MAC, c->mac, sizeof c->mac) &&
         write_holds(board, NODE_PLANT_IP, c->ip, sizeof c->ip) &&
         write_holds(board, NODE_PLANT_SERVER_IP, c->server_ip, sizeof c->server_ip) &&
         port_holds(board, NODE_PLANT_UDP_PORT, c->udp_port) &&
         port_holds(board, NODE_PLANT_SERVER_PORT, c->server_port) &&
         number_holds(board, NODE_PLANT_CONTROL, 1, NODE_PLANT_RUN_MASK);
}

bool plant_port_runs(struct board *board) {
  return read_number(board, NODE_PLANT_CONTROL, 1) == NODE_PLANT_RUN_MASK;
}

bool plant_port_send(struct board *board, const uint8_t *data, uint16_t length) {
  if (read_number(board, NODE_PLANT_STATUS, 1) & NODE_PLANT_SENDING_MASK) return false;
  board_write(board, NODE_PLANT_SEND_DATA, data, length);
  write_number(board, NODE_PLANT_SEND_LENGTH, 2, length);
  write_number(board, NODE_PLANT_COMMAND, 1, NODE_PLANT_SEND_MASK);
  return true;
}

uint16_t plant_port_receive(struct board *board, uint8_t *data, uint16_t most) {
  if ((read_number(board, NODE_PLANT_STATUS, 1) & NODE_PLANT_WAITING_MASK) == 0) return 0;
  const uint16_t length = (uint16_t)read_number(board, NODE_PLANT_RECEIVED_LENGTH, 2);
  board_read(board, NODE_PLANT_RECEIVED_DATA, data, length < most ? length : most);
  write_number(board, NODE_PLANT_COMMAND, 1, NODE_PLANT_RELEASE_MASK);
  return length;
}

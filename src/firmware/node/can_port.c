#include "can_port.h"

#include "../driver/registers.h"
#include "ring-bus.h"

enum {
  QUANTA = 25, /* FR-38: 1 + 18 + 3 + 3, SJW 3 */
  TSEG1 = 21,
  TSEG2 = 3,
  SJW = 3,
  PRESCALER_MAX = 2048,
  KBPS_MAX = 1000,
  FILTERS = 2, /* to the own address, to all */
  DESTINATION_SHIFT = 21,
  DESTINATION_MASK = 0x7f,
  DATA_AT = 8, /* of the bytes of a frame in memory */
  FRAME_BYTES = 16,
  FIFO_MOST = 128
};

static bool filter(struct board *board, uint16_t entry, uint8_t destination) {
  const uint32_t kinds = NODE_CAN_F_FILTERN_EXTENDED_MASK | NODE_CAN_F_FILTERN_REMOTE_MASK;
  uint8_t bytes[8];
  number_to(bytes, 4,
            NODE_CAN_F_FILTERN_IN_USE_MASK | NODE_CAN_F_FILTERN_EXTENDED_MASK |
                (uint32_t)destination << DESTINATION_SHIFT);
  number_to(bytes + 4, 4, kinds | (uint32_t)DESTINATION_MASK << DESTINATION_SHIFT);
  return write_holds(board, (uint16_t)NODE_CAN_F_FILTERN(entry), bytes, sizeof bytes);
}

bool can_port_start(struct can_port *port, struct board *board, const struct can_port_config *config) {
  const uint32_t clocks = config->core_mhz * 1000u;
  const uint32_t bit = config->kbps * (uint32_t)QUANTA;
  const uint32_t prescaler = bit == 0 ? 0 : clocks / bit;
  *port = (struct can_port){.board = board};
  if (config->kbps > KBPS_MAX || prescaler == 0 || prescaler > PRESCALER_MAX || prescaler * bit != clocks)
    return false;

  /* What is on the wire is taken off by the stop; then nothing waits. */
  write_number(board, NODE_CAN_F_CONTROL, 1, 0);
  write_number(board, NODE_CAN_F_COMMAND, 1, NODE_CAN_F_ABORT_ALL_MASK);
  for (int i = 0; i < FIFO_MOST && read_number(board, NODE_CAN_F_RX_LEVEL, 1) != 0; ++i)
    write_number(board, NODE_CAN_F_RX_RELEASE, 1, 1);

  const uint32_t timing = (prescaler - 1) << NODE_CAN_F_PRESCALER_SHIFT |
                          (TSEG1 - 1u) << NODE_CAN_F_TSEG1_SHIFT | (TSEG2 - 1u) << NODE_CAN_F_TSEG2_SHIFT |
                          (SJW - 1u) << NODE_CAN_F_SJW_SHIFT;
  const uint32_t control = NODE_CAN_F_RUN_MASK | NODE_CAN_F_RECOVER_ITSELF_MASK;
  return number_holds(board, NODE_CAN_F_TIMING, 4, timing) && filter(board, 0, config->address) &&
         filter(board, FILTERS - 1, 0) && number_holds(board, NODE_RING_ADDRESS, 1, config->address) &&
         number_holds(board, NODE_RING_CONTROL, 1, config->home ? NODE_RING_HOME_MASK : 0) &&
         number_holds(board, NODE_CAN_F_CONTROL, 1, control);
}

bool can_port_runs(const struct can_port *port) {
  return (read_number(port->board, NODE_CAN_F_CONTROL, 1) & NODE_CAN_F_RUN_MASK) != 0;
}

/* One byte: a host with narrow words reads it at once. */
static uint8_t pending(const struct can_port *port) {
  return (uint8_t)read_number(port->board, NODE_CAN_F_REQUEST, 1);
}

bool can_port_send(struct can_port *port, const struct ring_frame *frame) {
  const uint8_t waiting = pending(port);
  for (uint16_t n = 0; n < CAN_PORT_SLOTS; ++n) {
    if ((waiting >> n & 1) != 0) continue;
    const uint16_t slot = (uint16_t)NODE_CAN_F_SLOTN(n);
    uint8_t head[5];
    number_to(head, 4, frame->id | NODE_CAN_F_SLOTN_EXTENDED_MASK);
    head[4] = frame->dlc;
    board_write(port->board, slot, head, sizeof head);
    board_write(port->board, (uint16_t)(slot + DATA_AT), frame->data, RING_FRAME_BYTES);
    port->ids[n] = frame->id;
    write_number(port->board, NODE_CAN_F_REQUEST, 1, 1u << n);
    return true;
  }
  return false;
}

bool can_port_waits(const struct can_port *port, uint32_t id) {
  const uint8_t waiting = pending(port);
  for (unsigned n = 0; n < CAN_PORT_SLOTS; ++n)
    if ((waiting >> n & 1) != 0 && port->ids[n] == id) return true;
  return false;
}

bool can_port_receive(struct can_port *port, struct ring_frame *frame) {
  uint8_t bytes[FRAME_BYTES];
  if (read_number(port->board, NODE_CAN_F_RX_LEVEL, 1) == 0) return false;
  board_read(port->board, NODE_CAN_F_RX_FRAME, bytes, sizeof bytes);
  write_number(port->board, NODE_CAN_F_RX_RELEASE, 1, 1);
  frame->id = number_at(bytes, 4) & NODE_CAN_F_RX_IDENTIFIER_MASK;
  frame->dlc = bytes[4] & 0x0f;
  for (unsigned i = 0; i < RING_FRAME_BYTES; ++i) frame->data[i] = bytes[DATA_AT + i];
  return true;
}

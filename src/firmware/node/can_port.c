#include "can_port.h"

#include "../driver/registers.h"
#include "ring-node-tp.h"

enum {
  QUANTA = 25, /* FR-38: 1 + 18 + 3 + 3, SJW 3 */
  TSEG1 = 21,
  TSEG2 = 3,
  SJW = 3,
  PRESCALER_MAX = 2048,
  KBPS_MAX = 1000,
  LINK_KBPS_MIN = 400, /* FR-40 */
  LINK_KBPS_MAX = 2000,
  CONFIRM_UNIT_US = 10,
  CONFIRM_BITS = 20000, /* FR-58: 10 ms at 2 Mbit/s */
  RETRIES = 15,
  UP_MS = 10,
  LIFE_MASK = 0x7f,
  FILTERS = 2, /* to the own address, to all */
  FILTER_MASK = 0x1f,
  BRIDGE_FILTER = 8,
  DESTINATION_SHIFT = 21,
  DESTINATION_MASK = 0x7f,
  FILTER_AT = 5, /* of the bytes of a frame in memory: which has accepted it */
  DATA_AT = 8,
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

/* Of a port: what no filter before it takes is the bridge's. */
static bool bridge_filter(struct board *board, uint16_t first, bool in_use) {
  uint8_t bytes[8];
  number_to(bytes, 4, in_use ? NODE_CAN_F_FILTERN_IN_USE_MASK : 0);
  number_to(bytes + 4, 4, 0);
  return write_holds(board, (uint16_t)(first + BRIDGE_FILTER * sizeof bytes), bytes, sizeof bytes);
}

static uint32_t timing_of(uint32_t prescaler) {
  return (prescaler - 1) << NODE_CAN_F_PRESCALER_SHIFT | (TSEG1 - 1u) << NODE_CAN_F_TSEG1_SHIFT |
         (TSEG2 - 1u) << NODE_CAN_F_TSEG2_SHIFT | (SJW - 1u) << NODE_CAN_F_SJW_SHIFT;
}

/* How many of `part` kHz there are in a clock; 0: not a whole number of them. */
static uint32_t divide(uint8_t core_mhz, uint32_t part) {
  const uint32_t clocks = core_mhz * 1000u;
  return part == 0 || clocks % part != 0 ? 0 : clocks / part;
}

static uint32_t joins(const struct can_port_config *config) {
  return config->bridge ? NODE_CAN_F_BRIDGE_MASK : 0;
}

/* An earlier start may have used it: then it would go on, and its bridge fill slots that are the host's now.
 * Without such a port its control reads as 0. True: it was used. */
static bool stop_pair(struct board *board) {
  if (read_number(board, NODE_CAN_T_CONTROL, 1) == 0) return false;
  write_number(board, NODE_CAN_T_CONTROL, 1, 0);
  return true;
}

/* Of an earlier start: the host would receive all that it takes. */
static bool forgets_bridge(struct board *board) {
  const uint32_t entry = read_number(board, NODE_CAN_F_FILTERN(BRIDGE_FILTER), 4);
  return (entry & NODE_CAN_F_FILTERN_IN_USE_MASK) == 0 ||
         bridge_filter(board, NODE_CAN_F_FILTERN(0), false);
}

static bool starts_pair(struct board *board, const struct can_port_config *config) {
  const uint32_t prescaler = divide(config->core_mhz, config->pair_kbps * (uint32_t)QUANTA);
  const uint32_t control = NODE_CAN_T_RUN_MASK | NODE_CAN_T_RECOVER_ITSELF_MASK | joins(config);
  write_number(board, NODE_CAN_T_COMMAND, 1, NODE_CAN_T_ABORT_ALL_MASK);
  return prescaler != 0 && prescaler <= PRESCALER_MAX && config->pair_kbps <= KBPS_MAX &&
         bridge_filter(board, NODE_CAN_T_FILTERN(0), config->bridge) &&
         bridge_filter(board, NODE_CAN_F_FILTERN(0), config->bridge) &&
         number_holds(board, NODE_CAN_T_TIMING, 4, timing_of(prescaler)) &&
         number_holds(board, NODE_CAN_T_CONTROL, 1, control);
}

static bool starts_bus(struct board *board, const struct can_port_config *config, uint32_t prescaler) {
  const uint32_t control = NODE_CAN_F_RUN_MASK | NODE_CAN_F_RECOVER_ITSELF_MASK | joins(config);
  return number_holds(board, NODE_CAN_F_TIMING, 4, timing_of(prescaler)) &&
         number_holds(board, NODE_RING_CONTROL, 1, config->home ? NODE_RING_HOME_MASK : 0) &&
         number_holds(board, NODE_CAN_F_CONTROL, 1, control);
}

static bool starts_relay(struct board *board, const struct can_port_config *config, uint32_t cycles) {
  uint32_t confirm = config->confirm_us / CONFIRM_UNIT_US;
  if (confirm == 0) confirm = CONFIRM_BITS * 1000u / config->kbps / CONFIRM_UNIT_US;
  return number_holds(board, NODE_RING_LINK_BIT, 2, cycles) &&
         number_holds(board, NODE_RING_CONFIRM, 2, confirm) &&
         number_holds(board, NODE_RING_RETRIES, 1, RETRIES) &&
         number_holds(board, NODE_RING_LIFE, 1, config->life & LIFE_MASK) &&
         number_holds(board, NODE_CAN_F_CONTROL, 1, joins(config)) &&
         number_holds(board, NODE_RING_CONTROL, 1, NODE_RING_RELAY_MASK);
}

uint8_t can_port_slots(bool relay, bool bridge) {
  return relay && !bridge ? CAN_PORT_SLOTS : CAN_PORT_BUS_SLOTS;
}

bool can_port_start(struct can_port *port, struct board *board, const struct can_port_config *config) {
  const bool relay = config->relay;
  const uint32_t part = relay ? config->kbps : config->kbps * (uint32_t)QUANTA;
  const uint32_t cycles = divide(config->core_mhz, part); /* of a link's bit, or of a quantum */
  *port = (struct can_port){.board = board, .relay = relay};
  port->slots = can_port_slots(relay, config->bridge);
  if (cycles == 0 || cycles > PRESCALER_MAX || config->kbps > (relay ? LINK_KBPS_MAX : KBPS_MAX) ||
      (relay && config->kbps < LINK_KBPS_MIN) || (config->bridge && config->pair_kbps == 0) ||
      config->confirm_us / CONFIRM_UNIT_US > UINT16_MAX)
    return false;

  const bool was_paired = stop_pair(board);
  /* What is on the wire is taken off by the stop, and by the end of relay mode; then nothing waits. Who is
   * `home` stays so: written anew it would open the ring (FB-05), which may be open elsewhere. */
  const uint32_t home = config->home && !relay ? NODE_RING_HOME_MASK : 0;
  write_number(board, NODE_RING_CONTROL, 1, read_number(board, NODE_RING_CONTROL, 1) & home);
  /* A port that waits already does so for the time that was written before (FB-04). Its neighbour would be up
   * long before it, and send it what it does not hear: both begin anew. */
  const uint8_t up_ms = config->up_ms != 0 ? config->up_ms : UP_MS;
  if (read_number(board, NODE_RING_UP_MS, 1) != up_ms) {
    write_number(board, NODE_RING_CONTROL, 1, NODE_RING_OFF_MASK);
    if (!number_holds(board, NODE_RING_UP_MS, 1, up_ms)) return false;
    write_number(board, NODE_RING_CONTROL, 1, 0);
  }
  write_number(board, NODE_CAN_F_CONTROL, 1, 0);
  write_number(board, NODE_CAN_F_COMMAND, 1, NODE_CAN_F_ABORT_ALL_MASK);
  for (int i = 0; i < FIFO_MOST && read_number(board, NODE_CAN_F_RX_LEVEL, 1) != 0; ++i)
    write_number(board, NODE_CAN_F_RX_RELEASE, 1, 1);

  port->works = filter(board, 0, config->address) && filter(board, FILTERS - 1, 0) &&
                number_holds(board, NODE_RING_ADDRESS, 1, config->address) && forgets_bridge(board);
  /* Once more: the bridge may have been at the last frame of the pair when that was stopped; and what it took
   * for the pair until both stood still. */
  write_number(board, NODE_CAN_F_COMMAND, 1, NODE_CAN_F_ABORT_ALL_MASK);
  if (was_paired) write_number(board, NODE_CAN_T_COMMAND, 1, NODE_CAN_T_ABORT_ALL_MASK);
  port->works = port->works && (config->pair_kbps == 0 || starts_pair(board, config)) &&
                (relay ? starts_relay(board, config, cycles) : starts_bus(board, config, cycles));
  return port->works;
}

void can_port_lose(struct can_port *port) { port->works = false; }

bool can_port_runs(const struct can_port *port) {
  return port->relay ? (read_number(port->board, NODE_RING_CONTROL, 1) & NODE_RING_RELAY_MASK) != 0
                     : (read_number(port->board, NODE_CAN_F_CONTROL, 1) & NODE_CAN_F_RUN_MASK) != 0;
}

/* A host with narrow words reads one byte after the other: meanwhile slots may become free, and no other
 * ones are filled. */
static uint16_t pending(const struct can_port *port) {
  return (uint16_t)read_number(port->board, NODE_CAN_F_REQUEST, port->slots > 8 ? 2 : 1);
}

bool can_port_send(struct can_port *port, const struct ring_frame *frame) {
  if (!port->works) return false;
  const uint16_t waiting = pending(port);
  for (uint16_t n = 0; n < port->slots; ++n) {
    if ((waiting >> n & 1) != 0) continue;
    const uint16_t slot = (uint16_t)NODE_CAN_F_SLOTN(n);
    uint8_t head[5];
    number_to(head, 4, frame->id | NODE_CAN_F_SLOTN_EXTENDED_MASK);
    head[4] = frame->dlc;
    board_write(port->board, slot, head, sizeof head);
    board_write(port->board, (uint16_t)(slot + DATA_AT), frame->data, RING_FRAME_BYTES);
    port->ids[n] = frame->id;
    write_number(port->board, (uint16_t)(NODE_CAN_F_REQUEST + n / 8), 1, 1u << n % 8);
    return true;
  }
  return false;
}

bool can_port_waits(const struct can_port *port, uint32_t id) {
  if (!port->works) return false;
  const uint16_t waiting = pending(port);
  for (unsigned n = 0; n < port->slots; ++n)
    if ((waiting >> n & 1) != 0 && port->ids[n] == id) return true;
  return false;
}

void can_port_abort(struct can_port *port, uint32_t id) {
  if (!port->works) return;
  const uint16_t waiting = pending(port);
  for (unsigned n = 0; n < port->slots; ++n)
    if ((waiting >> n & 1) != 0 && port->ids[n] == id)
      write_number(port->board, (uint16_t)(NODE_CAN_F_ABORT + n / 8), 1, 1u << n % 8);
}

bool can_port_receive(struct can_port *port, struct ring_frame *frame) {
  uint8_t bytes[FRAME_BYTES];
  for (uint32_t level = read_number(port->board, NODE_CAN_F_RX_LEVEL, 1); level > 0; --level) {
    board_read(port->board, NODE_CAN_F_RX_FRAME, bytes, sizeof bytes);
    write_number(port->board, NODE_CAN_F_RX_RELEASE, 1, 1);
    /* The bridge takes frames of any kind: one of them may look like data of the transport. */
    if ((bytes[FILTER_AT] & FILTER_MASK) >= FILTERS) continue;
    frame->id = number_at(bytes, 4) & NODE_CAN_F_RX_IDENTIFIER_MASK;
    frame->dlc = bytes[4] & 0x0f;
    for (unsigned i = 0; i < RING_FRAME_BYTES; ++i) frame->data[i] = bytes[DATA_AT + i];
    return true;
  }
  return false;
}

/* The driver of a node's CAN port as a program that a test drives through its pipes: a command in, then the
 * driver's accesses to registers, each answered by the test, and the result. DriverInC.scala is the other
 * end. Numbers are little endian. */
#include <stdio.h>
#include <stdlib.h>

#include "node/can_port.h"

static uint32_t number(unsigned bytes) {
  uint32_t n = 0;
  for (unsigned i = 0; i < bytes; ++i) {
    const int c = getchar();
    if (c == EOF) exit(0); /* the test has ended */
    n |= (uint32_t)c << 8 * i;
  }
  return n;
}
static void say(uint32_t n, unsigned bytes) {
  for (unsigned i = 0; i < bytes; ++i) putchar((int)(n >> 8 * i & 0xff));
}
static void access_begins(char kind, uint16_t address, uint16_t length) {
  putchar(kind);
  say(address, 2);
  say(length, 2);
}

void board_read(struct board* board, uint16_t address, uint8_t* data, uint16_t length) {
  (void)board;
  access_begins('r', address, length);
  fflush(stdout);
  for (uint16_t i = 0; i < length; ++i) data[i] = (uint8_t)number(1);
}
void board_write(struct board* board, uint16_t address, const uint8_t* data, uint16_t length) {
  (void)board;
  access_begins('w', address, length);
  for (uint16_t i = 0; i < length; ++i) putchar(data[i]);
}

static struct ring_frame frame_in(void) {
  struct ring_frame f = {.id = number(4)};
  f.dlc = (uint8_t)number(1);
  for (unsigned i = 0; i < RING_FRAME_BYTES; ++i) f.data[i] = (uint8_t)number(1);
  return f;
}

int main(void) {
  struct can_port port = {0};
  for (;;) {
    struct ring_frame f = {0};
    bool result = false;
    const char command = (char)number(1);
    switch (command) {
      case 'I': {
        struct can_port_config config = {.address = (uint8_t)number(1)};
        config.home = number(1) != 0;
        config.kbps = (uint16_t)number(2);
        config.core_mhz = (uint8_t)number(1);
        config.relay = number(1) != 0;
        config.confirm_us = number(4);
        config.life = (uint8_t)number(1);
        result = can_port_start(&port, NULL, &config);
        break;
      }
      case 'G': result = can_port_runs(&port); break;
      case 'S':
        f = frame_in();
        result = can_port_send(&port, &f);
        break;
      case 'W': result = can_port_waits(&port, number(4)); break;
      case 'A': can_port_abort(&port, number(4)); break;
      case 'R': result = can_port_receive(&port, &f); break;
      default: return 1;
    }
    putchar('=');
    putchar(result);
    say(f.id, 4);
    say(f.dlc, 1);
    for (unsigned i = 0; i < RING_FRAME_BYTES; ++i) putchar(f.data[i]);
    fflush(stdout);
  }
}

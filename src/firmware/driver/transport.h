/* How the driver reaches its controller: two functions that a board supplies, for whichever host interface
 * the controller has. Everything else here is portable C99 without an operating system. */
#ifndef FLYFRAME_TRANSPORT_H
#define FLYFRAME_TRANSPORT_H

#include <stdbool.h>
#include <stdint.h>

/* The board's own: handed through, never looked into. May be null where there is one board only. */
struct board;

/* Registers of the controller, through its host port: bytes in ascending order, each accessed once, also by
 * accesses to others (AXI4-Lite reads whole words: each of them once). An access always comes back; without a
 * controller it reads anything. */
void board_read(struct board *board, uint16_t address, uint8_t *data, uint16_t length);
void board_write(struct board *board, uint16_t address, const uint8_t *data, uint16_t length);

#endif

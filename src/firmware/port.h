/* What a board must supply to the host programs. Everything else here is portable C99 without an operating
 * system. */
#ifndef FLYFRAME_PORT_H
#define FLYFRAME_PORT_H

#include <stdbool.h>
#include <stdint.h>

/* The board's own: handed through, never looked into. May be null where there is one board only. */
struct board;

/* Registers of the controller, through its host port: bytes in ascending order, each accessed once. */
void board_read(struct board *board, uint16_t address, uint8_t *data, uint16_t length);
void board_write(struct board *board, uint16_t address, const uint8_t *data, uint16_t length);

/* One number in non-volatile memory; 0 before anything was stored. A store during which the power fails
 * leaves the old number or the new one. False: the memory does not work. */
bool board_load(struct board *board, uint32_t *number);
bool board_store(struct board *board, uint32_t number);

/* Waits until the controller's interrupt pin is high, but no longer than `us` microseconds; may return
 * earlier. */
void board_wait(struct board *board, uint32_t us);

/* The host cannot work; does not return. `sentence` says why, for whoever services the board. */
void board_fatal(struct board *board, const char *sentence);

#endif

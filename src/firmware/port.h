/* What a board must supply to the host programs, and what it must guarantee. Everything else here is portable
 * C99 without an operating system. All functions are called by one program, never from an interrupt. */
#ifndef FLYFRAME_PORT_H
#define FLYFRAME_PORT_H

#include "driver/transport.h"

/* One number in non-volatile memory; 0 before anything was stored. A store during which the power fails
 * leaves the old number or the new one. It must bear a store at each start. False: the memory does not work.
 */
bool board_load(struct board *board, uint32_t *number);
bool board_store(struct board *board, uint32_t number);

/* Records of a master's log in non-volatile memory, by index; a slave's board needs none. A write during
 * which the power fails may leave any bytes in this one record, and leaves all others. Before anything was
 * written the bytes are the same everywhere, or anything that was no record. The memory must bear 100 times
 * as many writes as there are places. False: the memory does not work. */
enum { BOARD_LOG_RECORDS = 1000, BOARD_LOG_BYTES = 32 };
bool board_log_write(struct board *board, uint16_t index, const uint8_t record[BOARD_LOG_BYTES]);
bool board_log_read(struct board *board, uint16_t index, uint8_t record[BOARD_LOG_BYTES]);

/* Bytes that nobody can know before, of a source of noise: not computed from a seed, a time or a serial
 * number. False: the source does not work, the bytes mean nothing. */
bool board_random(struct board *board, uint8_t *bytes, uint16_t length);

/* Waits until the controller's interrupt pin is high, but no longer than `us` microseconds; may return
 * earlier. */
void board_wait(struct board *board, uint32_t us);

/* Microseconds of a clock of the host's own, from any number on, modulo 2^32: it goes on whatever becomes of
 * the controller, also while the host waits. Only the programs of a ring's nodes ask for it. */
uint32_t board_time(struct board *board);

/* Serves the watchdog. It is a circuit of its own with a clock of its own, runs from power-up on, cannot be
 * stopped by a program, and resets host and controller when it has not been served for a second. */
void board_watchdog(struct board *board);

/* What is pressed and what is wrong, as it is at this moment: contacts may bounce. A board without one of
 * these gives 0 for it. A master's board needs all of them, a slave's board none. */
enum {
  BOARD_SILENCE = 0x01, /* buttons: 1 while pressed */
  BOARD_ACKNOWLEDGE = 0x02,
  BOARD_RESET = 0x04,
  BOARD_TEST = 0x08,
  BOARD_MAINS_FAILED = 0x10, /* a broken wire of these must read 1 */
  BOARD_BATTERY_LOW = 0x20,
  BOARD_EARTH_FAULT = 0x40,
  BOARD_INPUTS = 7
};
uint8_t board_inputs(struct board *board);

/* A line of the text display of a master, 0 is the uppermost: exactly as many printable ASCII characters as
 * it has columns, then 0. It stays until the next call for this line. The signals (fire, fault, disabled,
 * sounder) are pins of the controller and need nothing of the host. */
void board_display(struct board *board, uint8_t line, const char *text);

/* A sentence for whoever services the board, on its service port if it has one: what the self-test has found.
 * Comes back soon. */
void board_notice(struct board *board, const char *sentence);

#endif

/* Numbers in registers, and whether registers and memory hold what is written. */
#ifndef FLYFRAME_REGISTERS_H
#define FLYFRAME_REGISTERS_H

#include "transport.h"

/* Little endian numbers in registers, `length` 1 to 4 bytes. */
uint32_t read_number(struct board *board, uint16_t address, uint8_t length);
void write_number(struct board *board, uint16_t address, uint8_t length, uint32_t number);

/* Little endian numbers in memory, `length` 1 to 4 bytes. */
uint32_t number_at(const uint8_t *bytes, uint8_t length);
void number_to(uint8_t *bytes, uint8_t length, uint32_t number);

/* Writes and reads patterns, with every bit 0 and 1 and different from byte to byte; leaves zeros. */
bool memory_holds(struct board *board, uint16_t address, uint16_t length);

/* Writes, and reads back. */
bool write_holds(struct board *board, uint16_t address, const uint8_t *data, uint8_t length);
bool number_holds(struct board *board, uint16_t address, uint8_t length, uint32_t number);

#endif

/* A number that is another one at each start: the epoch of a slave, the life of a master for its slaves. */
#ifndef FLYFRAME_START_NUMBER_H
#define FLYFRAME_START_NUMBER_H

#include "port.h"

/* The next number of those in non-volatile memory, as far as `mask` goes; it is stored before it is used. It
 * is neither 0, nor that of the last start, nor `before`, which the controller may still have. False: the
 * memory does not work; the number is a random one then, or, without a source of them, one behind `before`.
 */
bool start_number(struct board *board, uint32_t mask, uint32_t before, uint32_t *number);

#endif

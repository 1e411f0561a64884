/* The heartbeat of a host: it says in a register of its controller for how many ms it will live at least. The
 * controller counts down, so that the register is also a clock that runs only while the controller does. */
#ifndef FLYFRAME_HEARTBEAT_H
#define FLYFRAME_HEARTBEAT_H

#include "port.h"

/* The shortest promise: some passes of the program. */
enum { HEARTBEAT_LEAST_MS = 10 };

/* Promises `promise_ms` from now on; so many ms have passed since the promise before. 0: the controller has
 * not counted since then, and the promise stands. More than `promise_ms` are not seen. */
uint16_t heartbeat(struct board *board, uint16_t address, uint16_t promise_ms);

#endif

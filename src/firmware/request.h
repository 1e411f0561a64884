/* Datagrams of a master's host to its slaves, one at a time, between those of the controller. */
#ifndef FLYFRAME_REQUEST_H
#define FLYFRAME_REQUEST_H

#include "port.h"

enum { REQUEST_MOST_BYTES = 8 };

struct request {
  uint8_t command; /* an enum protocol_ecat */
  uint16_t adp, ado;
  uint8_t length;
  uint8_t data[REQUEST_MOST_BYTES]; /* what is sent, then what came back */
  uint16_t counter;                 /* then its working counter */
};

enum request_end {
  REQUEST_BACK, /* data and counter are those of the answer */
  REQUEST_LOST, /* the line has not answered */
  REQUEST_HUNG  /* the controller does not send: the line stands still */
};

/* Sends it and waits for its end. Takes up to `limit_us` twice. */
enum request_end request(struct board *board, struct request *request, uint32_t limit_us);

/* The controller has no datagram of an earlier start any more; waits for that up to `limit_us`. */
bool request_is_free(struct board *board, uint32_t limit_us);

/* Position addressing: the slave at `position`, counted from 0 on, has ADP 0 when the datagram gets there. */
static inline uint16_t adp_of(uint8_t position) { return (uint16_t)(0u - position); }

#endif

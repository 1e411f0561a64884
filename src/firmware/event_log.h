/* The last events of a master in its board's memory: what there is to look up when the server's log is lost.
 * A ring; each record says by itself that it is whole, so that a power failure costs one of them at most. */
#ifndef FLYFRAME_EVENT_LOG_H
#define FLYFRAME_EVENT_LOG_H

#include "port.h"

enum log_kind {
  LOG_START = 1,         /* the host has started; detail: its self-test */
  LOG_ALARM = 2,         /* smoke at a slave; detail: its status */
  LOG_ALARM_OVER = 3,    /* reset, and no smoke any more; detail: its status */
  LOG_SLAVE_FAULTS = 4,  /* detail: the faults that a slave has now, bits of enum protocol_slave */
  LOG_MASTER_FAULTS = 5, /* detail: those of the master, bits of enum protocol_master */
  LOG_ORDER = 6          /* an order is over; position: the order; detail: result, ticket (bits 31 to 16) */
};

struct log_record {
  uint32_t number;  /* from 1 on */
  uint64_t time_us; /* of the master */
  uint16_t life;    /* of the master for its slaves: its time begins anew with each */
  uint8_t kind;     /* an enum log_kind */
  uint8_t position; /* of the slave, from 0 on */
  uint16_t node;    /* its node ID */
  uint32_t detail;
};

struct event_log {
  struct board *board;
  uint16_t life;
  uint32_t last; /* number of the newest record, 0: there is none */
  bool failed;   /* the memory did not work when it was used last */
};

/* Looks for the newest record. */
void event_log_open(struct event_log *log, struct board *board, uint16_t life);

/* Number and life are given by the log. */
void event_log_write(struct event_log *log, const struct log_record *record);

/* The newest record for `back` 0, or an older one; false if it is not there any more, or not whole. */
bool event_log_read(struct event_log *log, uint32_t back, struct log_record *record);

#endif

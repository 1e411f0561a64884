/* How a master's line is, as its host knows it: looked at again and again through the controller's window on
 * its table of slaves. What has changed goes into the log. */
#ifndef FLYFRAME_LINE_PICTURE_H
#define FLYFRAME_LINE_PICTURE_H

#include "event_log.h"

enum { PICTURE_MOST_SLAVES = 128 };

struct pictured_slave {
  uint16_t status; /* bits of enum protocol_slave */
  uint16_t node;
  uint16_t alarm;   /* it was the first, second, ... since there was none; 0: no alarm */
  uint32_t since_s; /* the alarm's begin, in the master's time */
  /* What the log has of it, and when that was written. */
  bool logged_alarm, ever_logged;
  uint16_t logged_faults;
  uint32_t logged_s;
};

struct line_picture {
  struct pictured_slave slaves[PICTURE_MOST_SLAVES];
  uint8_t known;  /* slaves that are listed */
  uint8_t next;   /* position looked at next */
  uint16_t given; /* numbers of alarms given since there was none */
  uint16_t alarms;
  uint32_t state; /* bits of enum protocol_master */
  uint8_t cut;    /* first slave behind the cut of the ring, from 0 on */
  bool ever_logged;
  uint32_t logged_state, logged_s;
};

/* What of a slave's status is worth a line in log and display besides alarms. */
uint16_t picture_faults(uint16_t status);

/* Nobody has been seen yet. */
void picture_begin(struct line_picture *picture);

/* Looks at some slaves and at the master's own state: all of them in 16 calls. */
void picture_look(struct line_picture *picture, struct board *board, struct event_log *log, uint64_t time_us);

/* The next position from `first` on where the slave with this node ID answers; -1: there is none. */
int picture_position(const struct line_picture *picture, uint16_t node, int first);

/* Alarm slaves that answer; an ordinary slave between them has no node ID. */
uint16_t picture_present(const struct line_picture *picture);

#endif

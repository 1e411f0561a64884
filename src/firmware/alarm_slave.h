/* The host of a smoke-alarm slave: sets its controller up, says that it lives, and takes what the master
 * tells it. The controller detects and reports without it. */
#ifndef FLYFRAME_ALARM_SLAVE_HOST_H
#define FLYFRAME_ALARM_SLAVE_HOST_H

#include "self_test.h"

struct alarm_slave_parameters {
  uint16_t node_id;     /* 1 to 0xFFFE, as far as the controller holds it */
  uint32_t debounce_us; /* how long a state of the detector must last: 0 to 655,350 us, in steps of 10 us */
  uint16_t off_time_ms; /* how long the supply stays off to reset the detector: 1 to 65,535 ms */
  uint16_t alive_ms;    /* heartbeat: the host is dead when it says nothing for so long: from 10 ms on */
};

/* What the master tells hosts. */
enum { ALARM_MESSAGE_BYTES = 8 };

struct alarm_slave {
  struct board *board;
  bool by_write; /* the controller is acknowledged by write */
  struct alarm_slave_parameters parameters;
  enum self_test self_test;
  bool marked;           /* self_test and epoch are held: a reset can be seen there */
  uint8_t epoch;         /* of this start */
  uint32_t unwatched_ms; /* so long the detector has had no supply */
  uint32_t broadcasts,
      messages; /* taken since then; with acknowledge by write one that crosses counts twice */
  uint8_t last_broadcast[ALARM_MESSAGE_BYTES]; /* to all */
  uint8_t last_message[ALARM_MESSAGE_BYTES];   /* to this slave */
};

/* Sets the controller up. The detector stays on meanwhile, and goes on whatever is found; a parameter that is
 * none leaves the setting that the controller has. The register self_test tells the result. */
enum self_test alarm_slave_start(struct alarm_slave *slave, struct board *board,
                                 const struct alarm_slave_parameters *parameters);

/* Waits for a message, a millisecond at most, takes it, and says that the host lives. A controller that was
 * reset meanwhile is set up again. The watchdog is served while the controller's clock and detector go on. */
void alarm_slave_serve(struct alarm_slave *slave);

/* What the controller says of itself now: bits of enum protocol_slave. */
uint16_t alarm_slave_status(struct alarm_slave *slave);

/* The whole program; never returns. */
void alarm_slave_run(struct alarm_slave *slave, struct board *board,
                     const struct alarm_slave_parameters *parameters);

#endif

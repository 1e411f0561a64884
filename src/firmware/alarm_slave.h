/* The host of a smoke-alarm slave: sets its controller up, then takes what the master tells it. */
#ifndef FLYFRAME_ALARM_SLAVE_HOST_H
#define FLYFRAME_ALARM_SLAVE_HOST_H

#include "self_test.h"

struct alarm_slave_parameters {
  uint16_t node_id;     /* 1 to 0xFFFE, as far as the controller holds it */
  uint32_t debounce_us; /* how long a state of the detector must last: 0 to 655,350 us, in steps of 10 us */
  uint16_t off_time_ms; /* how long the supply stays off to reset the detector: 1 to 65,535 ms */
};

/* What the master tells hosts: the code of the command, then zeros. */
enum { ALARM_MESSAGE_BYTES = 8 };

struct alarm_slave {
  struct board *board;
  struct alarm_slave_parameters parameters;
  enum self_test self_test;
  uint8_t epoch;                               /* of this start */
  uint32_t broadcasts, messages;               /* taken since then */
  uint8_t last_broadcast[ALARM_MESSAGE_BYTES]; /* to all */
  uint8_t last_message[ALARM_MESSAGE_BYTES];   /* to this slave */
};

/* What the controller says of itself now. */
struct alarm_slave_status {
  uint8_t events;   /* that the master has not acknowledged */
  uint8_t detector; /* an enum protocol_state */
  bool supply, latched;
};

/* Sets the controller up. Anything but SELF_TEST_GOOD: detector and reports stay off, and the register
 * self_test says why. */
enum self_test alarm_slave_start(struct alarm_slave *slave, struct board *board,
                                 const struct alarm_slave_parameters *parameters);

/* Waits for a message, a millisecond at most, and takes it. A controller that was reset meanwhile is set up
 * again. */
void alarm_slave_serve(struct alarm_slave *slave);

struct alarm_slave_status alarm_slave_status(struct alarm_slave *slave);

/* The whole program; never returns. */
void alarm_slave_run(struct alarm_slave *slave, struct board *board,
                     const struct alarm_slave_parameters *parameters);

#endif

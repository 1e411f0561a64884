/* The host of an alarm master: sets its controller up, then executes the commands of the server. */
#ifndef FLYFRAME_ALARM_MASTER_HOST_H
#define FLYFRAME_ALARM_MASTER_HOST_H

#include "command.h"
#include "self_test.h"

struct alarm_master_parameters {
  uint16_t master_id;                   /* not 0 */
  uint8_t master_mac[6], server_mac[6]; /* as written, first byte first */
  uint8_t master_ip[4], server_ip[4];
  uint16_t master_port, server_port; /* UDP, not 0 */
  uint32_t bus_cycle_us;             /* 10 to 41,943 */
  uint16_t answer_timeout_us;        /* how long a frame is waited for: 10 to 2,621 */
  uint8_t retries;                   /* how often a frame is sent again: 0 to 15 */
  uint16_t report_repeat_ms;         /* reports that are not acknowledged: 1 to 4,095 */
  uint16_t report_heartbeat_ms;      /* without events: 1 to 4,095 */
  uint8_t key[PROTOCOL_KEY_BYTES];   /* shared with the server, not all zero */
};

struct alarm_master {
  struct board *board;
  struct alarm_master_parameters parameters;
  enum self_test self_test;
  uint16_t boot; /* of this start */
  struct command_filter filter;
  /* Commands since then; and those whose end could not be told to the server. */
  uint32_t accepted, malformed, forged, replayed, untold;
};

/* Sets the controller up and lets line and reports run. Anything but SELF_TEST_GOOD: both stay stopped, and
 * the register master_self_test says why. */
enum self_test alarm_master_start(struct alarm_master *master, struct board *board,
                                  const struct alarm_master_parameters *parameters);

/* Waits for a command, a millisecond at most, and executes it. A controller that was reset meanwhile is set
 * up again. */
void alarm_master_serve(struct alarm_master *master);

/* The whole program; never returns. */
void alarm_master_run(struct alarm_master *master, struct board *board,
                      const struct alarm_master_parameters *parameters);

#endif

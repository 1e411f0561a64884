/* The host of an alarm master: sets its controller up, says that it lives, executes orders of the server and
 * of the panel, shows and logs what there is. The controller runs line, sounder and reports without it. */
#ifndef FLYFRAME_ALARM_MASTER_HOST_H
#define FLYFRAME_ALARM_MASTER_HOST_H

#include "event_log.h"
#include "line_picture.h"
#include "panel.h"
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
  uint8_t server_timeout_s;          /* without an answer the server is silent: from 1 on */
  uint8_t key[PROTOCOL_KEY_BYTES];   /* shared with the server, not all zero */
  uint16_t alive_ms; /* heartbeat: the host is dead when it says nothing for so long: from 10 on */
  /* Display and contacts, and where slaves are: the places in the order of the line. Without places no slave
   * is expected, and none can be missed. They must stay where they are. */
  struct panel_parameters panel;
};

/* What is to be told to the server when the controller has a place for it. */
enum { HOST_EVENTS = 8 };
struct host_events {
  uint8_t waiting[HOST_EVENTS][PROTOCOL_HOST_EVENT_BYTES];
  uint8_t first, count;
};

struct alarm_master {
  struct board *board;
  struct alarm_master_parameters parameters;
  enum self_test self_test;
  bool marked;        /* the register master_self_test works: a reset can be seen there */
  bool store_failed;  /* the memory of the line's life */
  bool line_moves;    /* the controller sent the last datagram of the host */
  uint16_t line_life; /* of the controller's start */
  uint8_t control;    /* what the register master_control is to be */
  uint8_t faults;     /* what host_faults is */
  uint32_t probe_ms;  /* since the last look whether the line moves */
  struct line_picture picture;
  struct panel panel;
  struct event_log log;
  struct host_events events;
  /* Orders of the server since the start; what was none; those whose end could not be told. */
  uint32_t orders, malformed, untold;
};

/* Sets the controller up and lets line and reports run. A line that runs goes on meanwhile, and goes on
 * whatever is found; a parameter that is none leaves the setting that the controller has. Without right
 * addresses and key there are no reports. The register master_self_test tells the result. */
enum self_test alarm_master_start(struct alarm_master *master, struct board *board,
                                  const struct alarm_master_parameters *parameters);

/* Waits for an order, a millisecond at most, executes it, and does everything else. A controller that was
 * reset meanwhile is set up again. The watchdog is served while the controller's clock and line go on. */
void alarm_master_serve(struct alarm_master *master);

/* The memory does not work: orders of the server are refused. */
bool alarm_master_storage_failed(const struct alarm_master *master);

/* The whole program; never returns. */
void alarm_master_run(struct alarm_master *master, struct board *board,
                      const struct alarm_master_parameters *parameters);

#endif

/* What a host finds when it starts. */
#ifndef FLYFRAME_SELF_TEST_H
#define FLYFRAME_SELF_TEST_H

#include "driver/registers.h"
#include "port.h"
#include "protocol.h"

/* The values of the registers self_test and master_self_test; the master reports both kinds to the server.
 * What is wrong never stops detection: the first thing found is told, and everything else goes on. */
enum self_test {
  SELF_TEST_NOT_RUN = PROTOCOL_SELF_TEST_NOT_RUN,
  SELF_TEST_GOOD = PROTOCOL_SELF_TEST_GOOD,
  SELF_TEST_CONTROLLER = 2,      /* no controller answers, or another one than this program is for */
  SELF_TEST_MEMORY = 3,          /* a register or the RAM does not hold what was written */
  SELF_TEST_STORE = 4,           /* the non-volatile memory does not work */
  SELF_TEST_RANDOM = 5,          /* the source of random numbers does not work */
  SELF_TEST_NODE_ID = 6,         /* 0, 0xFFFF (all), or wider than the controller holds */
  SELF_TEST_DEBOUNCE = 7,        /* above 655,350 us */
  SELF_TEST_OFF_TIME = 8,        /* 0 */
  SELF_TEST_MASTER_ID = 9,       /* 0 */
  SELF_TEST_MAC = 10,            /* all zero, or a group address */
  SELF_TEST_IP = 11,             /* begins with 0, or is no address of a single station */
  SELF_TEST_PORT = 12,           /* 0 */
  SELF_TEST_BUS_CYCLE = 13,      /* outside 10 to 41,943 us */
  SELF_TEST_TIMEOUT = 14,        /* outside 10 to 2,621 us */
  SELF_TEST_RETRIES = 15,        /* above 15 */
  SELF_TEST_REPORT = 16,         /* repetition or heartbeat outside 1 to 4,095 ms */
  SELF_TEST_KEY = 17,            /* all zero */
  SELF_TEST_ALIVE = 18,          /* the heartbeat's promise is below 10 ms */
  SELF_TEST_SERVER_TIMEOUT = 19, /* 0 */
  SELF_TEST_PLACES = 20,         /* too many, a node ID that is none, or one twice */
  SELF_TEST_DISPLAY = 21,        /* outside 2 to 4 lines of 20 to 40 columns */
  SELF_TEST_CODES
};

/* A sentence; for a number that is none of these too. */
const char *self_test_text(enum self_test result);

/* The first of two results that is not good. */
enum self_test worse(enum self_test first, enum self_test second);

bool is_zero(const uint8_t *bytes, uint16_t count);

#endif

/* Commands of the server, as they come in UDP datagrams (SRV-02): parsed, and accepted only with a right
 * authentication code. */
#ifndef FLYFRAME_COMMAND_H
#define FLYFRAME_COMMAND_H

#include <stdbool.h>
#include <stdint.h>

#include "protocol.h"

struct command {
  uint32_t counter; /* rises with every command of a boot */
  uint8_t order;    /* PROTOCOL_ALARM_CLEAR, PROTOCOL_DETECTOR_RESET, or unknown */
  uint16_t node;    /* an ID, or PROTOCOL_ALL_NODES */
};

/* Who must be meant, and what was accepted last. */
struct command_filter {
  const uint8_t *key; /* PROTOCOL_KEY_BYTES long */
  uint16_t master_id, boot;
  bool any; /* a command has been accepted in this boot */
  uint32_t last_counter;
};

enum command_verdict {
  COMMAND_ACCEPTED,
  COMMAND_MALFORMED, /* too short or long, another beginning, for another master */
  COMMAND_FORGED,    /* the code is wrong */
  COMMAND_REPLAYED   /* of another boot, or its counter does not rise */
};

/* Fills `command`, and the filter remembers its counter, if it is accepted; else both stay. */
enum command_verdict command_check(struct command_filter *filter, const uint8_t *message, uint16_t length,
                                   struct command *command);

#endif

/* The settings of an alarm master's controller. */
#ifndef FLYFRAME_MASTER_SETUP_H
#define FLYFRAME_MASTER_SETUP_H

#include "alarm_master.h"

/* A controller for this program answers. */
bool master_is_there(struct board *board);

/* Checks, and writes what is right; sets `control` to what may run. The first thing that is wrong, or
 * SELF_TEST_GOOD. */
enum self_test master_set_up(struct alarm_master *master);

/* Longer than a datagram of the host may take. */
uint32_t master_request_limit(const struct alarm_master_parameters *parameters);

#endif

/* Orders of the server, as the controller hands them over: it has checked that they are the server's, and
 * new. And orders of the panel. */
#ifndef FLYFRAME_ORDERS_H
#define FLYFRAME_ORDERS_H

#include "alarm_master.h"

/* Takes the order that waits in the controller's mailbox, executes it, logs it, and lets the server be told.
 */
void take_order(struct alarm_master *master, uint64_t time_us);

/* The same for a button, which has ticket 0: for all slaves, also while the memory does not work. */
void order_by_panel(struct alarm_master *master, uint8_t order, uint64_t time_us);

/* Hands the oldest event to the controller, if that has a place for it. */
void tell_events(struct alarm_master *master);

#endif

/* What a host does with an EtherCAT slave controller: events, states, SyncManagers, watchdog, SYNC signals.
 * Addresses are those of generated/esc.h, which are the same in every slave controller.
 *
 * A controller ends events and closes buffers when the host reads, or, with acknowledge by write (SM-38),
 * when it writes there. Functions with `by_write` do what theirs needs, so that what is said here of reading
 * holds for both. */
#ifndef FLYFRAME_CONTROLLER_H
#define FLYFRAME_CONTROLLER_H

#include "registers.h"

/* AL events (IRQ-02), 32 bit: of `events_pending`, and of the mask that lets them interrupt. */
enum {
  EVENT_AL_CONTROL = 0x01, /* ends with al_control() */
  EVENT_SYNC0 = 0x04,      /* ends with sync0_acknowledge() if the signal is in acknowledge mode */
  EVENT_ACTIVATION = 0x10, /* SyncManagers were switched on or off, or asked to repeat: activations_read() */
  EVENT_WATCHDOG = 0x40    /* ends with watchdog_runs() */
};
/* The buffer of SyncManager `number`, 0 to 15, was written (read) by the master; ends with the host's first
 * byte read (written). */
static inline uint32_t event_of(uint8_t number) { return (uint32_t)0x100 << number; }

uint32_t events_pending(struct board *board);
bool acknowledges_by_write(struct board *board);
void events_select(struct board *board, uint32_t mask);

/* States of AL control and AL status (AL-01). */
enum { AL_INIT = 1, AL_PREOP = 2, AL_BOOT = 3, AL_SAFEOP = 4, AL_OP = 8 };
enum {
  AL_STATE_MASK = 0x0f,  /* of both */
  AL_ACKNOWLEDGE = 0x10, /* in control: the master has seen the error */
  AL_ERROR = 0x10        /* in status: the code says which */
};

/* What the master asks for; reading ends the event. All of it is in one byte: with a second access a request
 * that comes between both would be lost (B-41). */
uint16_t al_control(struct board *board, bool by_write);
/* What the master is told; the code is there before the status is. */
void al_answer(struct board *board, uint16_t status, uint16_t code);
uint16_t al_status(struct board *board);

struct sync_manager {
  uint16_t start, length;
  uint8_t control;  /* the low digit is mode and direction; bit 5 its event, bit 6 triggers the watchdog */
  uint8_t status;   /* bit 3: mailbox full; bits 4 and 5: buffer last written, 3 = none yet */
  uint8_t activate; /* bit 0: switched on by the master; bit 1: repeat request */
};
enum { SM_EVENT = 0x20, SM_WATCHDOG = 0x40 };
enum { SM_FULL = 0x08, SM_NONE_WRITTEN = 0x30, SM_ENABLED = 0x01, SM_REPEAT = 0x02 };

/* Without acknowledge by write it ends the event of its activation. */
void sync_manager_read(struct board *board, uint8_t number, struct sync_manager *settings);
/* These end no event. */
uint8_t sync_manager_control(struct board *board, uint8_t number);
uint8_t sync_manager_status(struct board *board, uint8_t number);
/* The host's own switch (SM-27): off, its memory is locked for the master, and what was in it is forgotten.
 * It acts when no frame passes (B-59), which is waited for, but not for ever; false: it has not acted yet. */
bool sync_manager_switch(struct board *board, uint8_t number, bool on);
bool sync_manager_is_on(struct board *board, uint8_t number); /* of the host's switch */
/* The activation bytes of the first `count` SyncManagers; reading ends the event of each. */
void activations_read(struct board *board, uint8_t *bytes, uint8_t count, bool by_write);

/* All bytes of a buffer, or mailbox, that the master has written; the last one closes it. */
void buffer_read(struct board *board, uint16_t start, uint8_t *bytes, uint16_t length, bool by_write);

/* Process data watchdog: whether it has not expired. Reading ends its event, by one byte: what came between
 * two would be lost. */
bool watchdog_runs(struct board *board, bool by_write);
/* Ticks after which it expires; 0: never (WD-03). */
uint16_t watchdog_time(struct board *board);

/* Distributed clocks: whether SYNC0 comes in cycles, whether it is an event that waits for its acknowledge
 * (pulse length 0, mapped by 0x0151 bit 3), and how many ns a cycle has. */
bool sync0_is_active(struct board *board);
bool sync0_waits(struct board *board);
uint32_t sync0_cycle(struct board *board);
void sync0_acknowledge(struct board *board, bool by_write);

#endif

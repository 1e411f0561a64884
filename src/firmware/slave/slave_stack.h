/* The slave stack: states, mailbox with CoE and FoE, process data. It has no heap, waits for nothing, and is
 * called by one program, never from an interrupt. What the device is stands in a table that the generator
 * writes (NAME.objects.c); how to use it: docs/slave-stack.md. */
#ifndef FLYFRAME_SLAVE_STACK_H
#define FLYFRAME_SLAVE_STACK_H

#include "../driver/mailbox.h"
#include "codes.h"
#include "dictionary.h"

enum { SLAVE_COE = 0x04, SLAVE_FOE = 0x08 }; /* protocols, bits as in the SII */

/* A mailbox as the device file has it. */
struct slave_mailbox {
  uint16_t start, length; /* length 0: there is none */
  uint8_t control;
};

/* Process data of one direction. */
struct slave_process {
  uint8_t sync_manager; /* its number n: assignment is object 0x1C10 + n, synchronization 0x1C30 + n */
  uint8_t control;
  uint16_t start;
  uint16_t most; /* bytes that its buffer may have; 0: there is no process data of this direction */
};

/* What the device is: written by the generator. */
struct slave_device {
  const struct object *objects;
  uint16_t object_count;
  uint8_t protocols;
  struct slave_mailbox receive, send, boot_receive, boot_send;
  struct slave_process outputs, inputs;
  bool sync; /* the device file has a mode with distributed clocks */
};

/* An entry in the process data; null is padding. */
struct slave_mapped {
  const struct object_entry *entry;
  uint16_t bits;
};

/* Memory of one device: part of what the generator writes. */
struct slave_memory {
  uint8_t *objects;                      /* values of all entries */
  uint8_t *request, *reply[2];           /* as long as the longest mailbox */
  uint8_t *transfer;                     /* as long as the longest object */
  uint8_t *process;                      /* as long as the longest process data */
  struct slave_mapped *outputs, *inputs; /* as many as all PDOs together have entries at most */
};

/* Files for FoE. All offsets are in bytes.
 * SLAVE_FILE_BUSY, instead of an error of FoE: not yet. `write` is called again when the master has sent the
 * packet once more; `open` and `read` with each slave_serve(), and meanwhile the master waits. */
#define SLAVE_FILE_BUSY 0x10000u
struct slave_files {
  /* An error of FoE if the master may not read (write) the file now; else 0. `name` has no 0 at its end. */
  uint32_t (*open)(void *context, const char *name, uint16_t length, uint32_t password, bool to_write);
  /* Up to `most` bytes; fewer are the last ones. The same offset may be asked for again. */
  uint32_t (*read)(void *context, uint32_t offset, uint8_t *data, uint16_t most, uint16_t *length);
  /* `last`: an error here tells that the file is not good. */
  uint32_t (*write)(void *context, uint32_t offset, const uint8_t *data, uint16_t length, bool last);
  /* The transfer is over, or its opening that was busy; `complete` is false if it was broken off. */
  void (*close)(void *context, bool complete);
};

/* The program of the device. Functions may be null. */
struct slave_application {
  void *context; /* handed through */
  /* An AL status code if the state must not be entered; else 0. Ways back are not asked for. */
  uint16_t (*may_enter)(void *context, uint8_t state);
  void (*entered)(void *context, uint8_t state); /* AL_INIT ... */
  /* A cycle of process data, in SAFEOP and OP: outputs stand in their objects, inputs are to be put there.
   * Outputs are not valid in SAFEOP: what they drive must be safe. */
  void (*cycle)(void *context, bool outputs_valid);
  /* SDOs. An abort code if this must not be written; else 0. Little endian bytes. */
  uint32_t (*may_write)(void *context, uint16_t index, uint8_t subindex, const uint8_t *bytes,
                        uint16_t count);
  void (*written)(void *context, uint16_t index, uint8_t subindex); /* the new value is there */
  void (*reads)(void *context, uint16_t index, uint8_t subindex);   /* the last moment to renew it */
  struct slave_files files;
};

enum slave_mode { SLAVE_FREE_RUN = 0, SLAVE_SM_SYNCHRONOUS = 1, SLAVE_SYNC0 = 2 };

enum { SLAVE_EMERGENCIES = 4, SLAVE_EMERGENCY_DATA = 5 };
struct slave_emergency {
  uint16_t code;
  uint8_t error_register;
  uint8_t data[SLAVE_EMERGENCY_DATA];
};

/* All that the stack remembers. Its members are its own. */
struct slave {
  struct board *board;
  const struct slave_device *device;
  const struct slave_application *application;
  struct slave_memory memory;
  bool by_write; /* the controller is acknowledged by write */

  uint8_t state;
  bool error;         /* shown, and not acknowledged yet */
  uint16_t code;      /* AL status code */
  uint8_t fail_state; /* of slave_fail(), which waits; 0: none */
  uint16_t fail_code;
  uint32_t event_mask; /* as selected */

  struct mailbox_area receive, send;      /* in use */
  uint8_t received_counter, sent_counter; /* of the last message; 0: none */
  uint16_t reply_address;                 /* who has asked */
  uint8_t newest;                         /* reply[newest] was sent last */
  bool anything_sent, older_sent;         /* older_sent: reply[!newest] is a message too */
  bool older_due, newest_due; /* a repetition has taken the newest back: first the older is due, then it */
  bool repeated_waits;        /* a repeated message is not read yet */
  bool taking_back;           /* the mailbox is being switched off for that */
  bool blocked;               /* the mailbox to the master was full when it was looked at */

  struct slave_emergency emergencies[SLAVE_EMERGENCIES];
  uint8_t first_emergency, emergency_count;
  bool repeat_asked;   /* by the master */
  bool emergency_sent; /* last: now something else may leave */

  struct {
    enum { SDO_NONE, SDO_UPLOAD, SDO_DOWNLOAD } kind; /* a segmented transfer */
    uint16_t index;
    uint8_t subindex;
    bool complete, toggle;
    uint16_t size, done;
  } sdo;
  struct {
    uint16_t kind, at, left; /* object list: next object, indexes not told yet; 0: none */
    uint16_t fragments;      /* still to be sent */
  } list;
  struct {
    enum { FOE_NONE, FOE_READING, FOE_WRITING } kind;
    enum { FOE_FOR_NOTHING, FOE_FOR_OPENING, FOE_FOR_PACKET } waits; /* the program is busy with it */
    uint32_t packet, offset;
    uint16_t length; /* opening: of the request; read: of the packet that was sent */
  } foe;

  enum slave_mode mode;
  uint16_t output_bytes, input_bytes; /* as mapped */
  uint16_t output_count, input_count; /* entries mapped */
  bool outputs_received, watched;
  bool cycle_due;           /* in any mode: OP has begun, or no inputs could be written since SAFEOP */
  uint8_t missed, unsynced; /* in OP: SYNC0 in a row without new outputs, outputs since the last SYNC0 */
};

/* Starts, or starts again: the controller goes to INIT, and a file that was open is forgotten. The generated
 * NAME_start() calls it. */
void slave_start(struct slave *slave, struct board *board, const struct slave_device *device,
                 const struct slave_memory *memory, const struct slave_application *application);

/* Does what there is to do now, and comes back. To be called again and again, at the latest when the
 * controller interrupts. At most one mailbox message and one cycle of process data per call. */
void slave_serve(struct slave *slave);

/* Inputs have changed, and are to be with the master at once, also without outputs of the cycle: the next
 * slave_serve() is one of process data. Without effect below SAFEOP, and in SYNC mode, where inputs have
 * their time. */
void slave_inputs(struct slave *slave);

/* The program's own error: back to `state` (AL_INIT, AL_PREOP, AL_SAFEOP) with an AL status code other than
 * 0. It acts at the end of slave_serve(), so that every function of the program may call it. Without effect
 * in states below. */
void slave_fail(struct slave *slave, uint8_t state, uint16_t code);

/* Tells the master of an error (0x0000: it is gone) as soon as the mailbox has room; `data` may be null.
 * False: too many wait already, or there is no mailbox in this state. */
bool slave_emergency(struct slave *slave, uint16_t code, uint8_t error_register, const uint8_t *data);

#endif

/* States: what the master asks for, whether it can be, and what it brings with it. */
#include "internal.h"

static bool has_mailbox(uint8_t state) { return state != AL_INIT; }
static bool has_process_data(uint8_t state) { return state == AL_SAFEOP || state == AL_OP; }
static bool is_state(uint8_t state) {
  return state == AL_INIT || state == AL_PREOP || state == AL_BOOT || has_process_data(state);
}

/* AL-03; the way to the same state is one. */
static bool is_transition(uint8_t from, uint8_t to) {
  if (from == to || to == AL_INIT) return true;
  if (from == AL_BOOT) return false;
  switch (to) {
    case AL_BOOT: return from == AL_INIT;
    case AL_PREOP: return true;
    case AL_SAFEOP: return from == AL_PREOP || from == AL_OP;
    case AL_OP: return from == AL_SAFEOP;
    default: return false;
  }
}

/* Switched on by the master as the device file says. */
static bool mailbox_is_as(struct slave *slave, uint8_t number, const struct slave_mailbox *expected) {
  struct sync_manager found;
  sync_manager_read(slave->board, number, &found);
  return (found.activate & SM_ENABLED) && found.start == expected->start &&
         found.length == expected->length && ((found.control ^ expected->control) & 0x0f) == 0;
}

static bool mailboxes_hold(struct slave *slave, bool boot) {
  const struct slave_device *d = slave->device;
  return mailbox_is_as(slave, MAILBOX_RECEIVE, boot ? &d->boot_receive : &d->receive) &&
         mailbox_is_as(slave, MAILBOX_SEND, boot ? &d->boot_send : &d->send);
}

/* Why a state cannot be entered, as an AL status code; 0 if it can. */
static uint16_t refusal(struct slave *slave, uint8_t wanted) {
  const uint8_t from = slave->state;
  if (!is_state(wanted)) return AL_CODE_UNKNOWN_STATE;
  if (wanted == AL_BOOT && slave->device->boot_receive.length == 0) return AL_CODE_NO_BOOTSTRAP;
  if (!is_transition(from, wanted)) return AL_CODE_INVALID_CHANGE;
  if (wanted <= from) return AL_CODE_NONE;
  uint16_t code = AL_CODE_NONE;
  if (wanted == AL_PREOP && !mailboxes_hold(slave, false)) code = AL_CODE_PREOP_MAILBOX;
  if (wanted == AL_BOOT && !mailboxes_hold(slave, true)) code = AL_CODE_BOOT_MAILBOX;
  if (wanted == AL_SAFEOP) code = process_check(slave);
  if (wanted == AL_OP) code = outputs_check(slave);
  if (code == AL_CODE_NONE && slave->application->may_enter)
    code = slave->application->may_enter(slave->application->context, wanted);
  return code;
}

static void enter(struct slave *slave, uint8_t wanted) {
  const uint8_t from = slave->state;
  if (wanted == from) return;
  if (has_process_data(from) && !has_process_data(wanted)) process_end(slave);
  if (has_mailbox(from) && !has_mailbox(wanted)) mailbox_end(slave);
  slave->state = wanted;
  if (wanted == AL_SAFEOP) slave->outputs_received = false; /* also on the way back */
  const struct slave_device *d = slave->device;
  if (!has_mailbox(from) && wanted == AL_PREOP) mailbox_begin(slave, &d->receive, &d->send);
  if (!has_mailbox(from) && wanted == AL_BOOT) mailbox_begin(slave, &d->boot_receive, &d->boot_send);
  if (!has_process_data(from) && wanted == AL_SAFEOP) process_begin(slave);
  if (from == AL_SAFEOP && wanted == AL_OP) outputs_begin(slave);
  if (slave->application->entered) slave->application->entered(slave->application->context, wanted);
}

static void show(struct slave *slave, uint16_t code) {
  slave->code = code;
  slave->error = code != AL_CODE_NONE;
  al_answer(slave->board, (uint16_t)(slave->state | (slave->error ? AL_ERROR : 0)), code);
}

/* What the master has written to AL control. */
static void follow(struct slave *slave, uint16_t control) {
  const uint8_t wanted = control & AL_STATE_MASK;
  /* With an error shown, only an acknowledge or a way back is followed. */
  const bool back = wanted < slave->state && is_transition(slave->state, wanted);
  if (slave->error && !(control & AL_ACKNOWLEDGE) && !back) return;
  const uint16_t code = refusal(slave, wanted);
  if (code == AL_CODE_NONE) enter(slave, wanted);
  show(slave, code);
}

void slave_fall(struct slave *slave, uint8_t state, uint16_t code) {
  enter(slave, state);
  show(slave, code);
}

void slave_fail(struct slave *slave, uint8_t state, uint16_t code) {
  if (code == AL_CODE_NONE || (state != AL_INIT && state != AL_PREOP && state != AL_SAFEOP)) return;
  slave->fail_state = state;
  slave->fail_code = code;
}

static void fail(struct slave *slave) {
  const uint8_t state = slave->fail_state;
  if (state == 0) return;
  slave->fail_state = 0;
  const bool higher = slave->state == AL_BOOT ? state == AL_INIT : slave->state > state;
  if (higher || (slave->state == state && state == AL_SAFEOP)) slave_fall(slave, state, slave->fail_code);
}

/* The master may switch SyncManagers off at any time. */
static void check_sync_managers(struct slave *slave) {
  uint8_t activations[16];
  activations_read(slave->board, activations, sizeof activations, slave->by_write);
  const bool boot = slave->state == AL_BOOT;
  if (has_mailbox(slave->state)) mailbox_switched(slave); /* before what is read is judged */
  if (slave->state != AL_INIT && !mailboxes_hold(slave, boot))
    slave_fall(slave, AL_INIT, boot ? AL_CODE_BOOT_MAILBOX : AL_CODE_PREOP_MAILBOX);
  const uint16_t code = has_process_data(slave->state) ? process_settings(slave) : AL_CODE_NONE;
  if (code != AL_CODE_NONE) slave_fall(slave, AL_PREOP, code);
  if (has_process_data(slave->state)) process_switched(slave);
}

/* Only what this state ends: the interrupt is a level, and would stay. */
static void select_events(struct slave *slave) {
  uint32_t mask = EVENT_AL_CONTROL | EVENT_ACTIVATION;
  if (has_mailbox(slave->state)) mask |= mailbox_events(slave);
  if (has_process_data(slave->state)) mask |= process_events(slave);
  if (mask == slave->event_mask) return;
  slave->event_mask = mask;
  events_select(slave->board, mask);
}

void slave_start(struct slave *slave, struct board *board, const struct slave_device *device,
                 const struct slave_memory *memory, const struct slave_application *application) {
  *slave = (struct slave){
      .board = board, .device = device, .application = application, .memory = *memory, .state = AL_INIT};
  slave->by_write = acknowledges_by_write(board);
  mailbox_end(slave);
  process_end(slave);
  select_events(slave);
  show(slave, AL_CODE_NONE);
}

void slave_serve(struct slave *slave) {
  uint32_t events = events_pending(slave->board);
  const uint8_t before = slave->state;
  /* First: outputs that came before a request for OP count for it. */
  const bool received = has_process_data(slave->state) && process_receive(slave, events);
  /* Before activations: a master that has switched SyncManagers off has asked for INIT, too. */
  if (events & EVENT_AL_CONTROL) follow(slave, al_control(slave->board, slave->by_write));
  /* Who enters a state has ended events of SyncManagers; and the watchdog's is of before. */
  if ((events & EVENT_ACTIVATION) || slave->state != before) check_sync_managers(slave);
  if (before != AL_OP) events &= ~(uint32_t)EVENT_WATCHDOG;
  if (has_mailbox(slave->state)) mailbox_serve(slave);
  if (has_process_data(slave->state)) process_serve(slave, events, received);
  fail(slave);
  select_events(slave);
}

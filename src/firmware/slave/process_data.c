/* Process data: between the buffers of SyncManagers and the objects, in one of three modes. */
#include "internal.h"

/* SYNC mode has failed with more SYNC0 in a row without new outputs, or more outputs without a SYNC0: these
 * may come several times in its cycle. */
enum { MISSED_MOST = 4, UNSYNCED_MOST = 100 };
/* Synchronization types of 0x1C32 and 0x1C33, subindex 1. */
enum { TYPE_FREE_RUN = 0, TYPE_SM = 1, TYPE_SYNC0 = 2, TYPE_SM_OF_OUTPUTS = 0x22 };
enum { SYNCHRONIZATIONS = 0x1c30, SYNC_TYPE = 1, SHORTEST_CYCLE = 5 };

static uint32_t synchronization(const struct slave *slave, const struct slave_process *process,
                                uint8_t subindex) {
  return slave_value(slave, (uint16_t)(SYNCHRONIZATIONS + process->sync_manager), subindex);
}

uint32_t process_type_check(const struct slave *slave, uint16_t type) {
  const bool known = type == TYPE_FREE_RUN || type == TYPE_SM || type == TYPE_SM_OF_OUTPUTS;
  return known || (type == TYPE_SYNC0 && slave->device->sync) ? 0 : SDO_RANGE;
}

/* As long as what is mapped, and otherwise as the device file says; where nothing is mapped, without buffer.
 */
static bool settings_hold(const struct slave *slave, const struct slave_process *process, uint16_t bytes) {
  struct sync_manager found;
  if (process->most == 0) return true;
  sync_manager_read(slave->board, process->sync_manager, &found);
  const bool on = (found.activate & SM_ENABLED) && found.length > 0;
  if (bytes == 0) return !on;
  return on && found.start == process->start && found.length == bytes &&
         ((found.control ^ process->control) & (0x0f | SM_EVENT)) == 0;
}

static bool triggers_watchdog(const struct slave *slave) {
  const uint8_t number = slave->device->outputs.sync_manager;
  return slave->output_bytes > 0 && (sync_manager_control(slave->board, number) & SM_WATCHDOG);
}

static uint16_t settings_check(const struct slave *slave) {
  if (!settings_hold(slave, &slave->device->outputs, slave->output_bytes)) return AL_CODE_OUTPUT_SETTINGS;
  if (!settings_hold(slave, &slave->device->inputs, slave->input_bytes)) return AL_CODE_INPUT_SETTINGS;
  return AL_CODE_NONE;
}

uint16_t process_settings(const struct slave *slave) {
  const uint16_t code = settings_check(slave);
  if (code) return code;
  return triggers_watchdog(slave) == slave->watched ? AL_CODE_NONE : AL_CODE_OUTPUT_SETTINGS;
}

/* The mode follows the outputs, without outputs the inputs; SYNC0 that runs makes it SYNC mode. */
static uint16_t choose_mode(struct slave *slave) {
  const struct slave_device *d = slave->device;
  const uint32_t out = synchronization(slave, &d->outputs, SYNC_TYPE);
  const uint32_t in = synchronization(slave, &d->inputs, SYNC_TYPE);
  const bool runs = d->sync && sync0_is_active(slave->board);
  const uint32_t asked = d->outputs.most > 0 ? out : in;
  if (asked == TYPE_SYNC0 && !d->sync) return AL_CODE_NO_SYNC_MODE;
  if (asked == TYPE_SYNC0 && !runs) return AL_CODE_SYNC_SETTINGS;
  const uint32_t wanted = out == TYPE_SM ? TYPE_SM_OF_OUTPUTS : out;
  if (!runs && d->outputs.most > 0 && d->inputs.most > 0 && in != wanted) return AL_CODE_INCONSISTENT;
  slave->mode = runs ? SLAVE_SYNC0 : asked == TYPE_FREE_RUN ? SLAVE_FREE_RUN : SLAVE_SM_SYNCHRONOUS;
  if (!runs) return AL_CODE_NONE;
  if (!sync0_waits(slave->board)) return AL_CODE_SYNC_SETTINGS;
  const struct slave_process *first = d->outputs.most > 0 ? &d->outputs : &d->inputs;
  const uint32_t cycle = sync0_cycle(slave->board);
  return cycle == 0 || cycle < synchronization(slave, first, SHORTEST_CYCLE) ? AL_CODE_SYNC_CYCLE
                                                                             : AL_CODE_NONE;
}

uint16_t process_check(struct slave *slave) {
  uint16_t code = pdo_resolve(slave);
  if (!code) code = settings_check(slave);
  if (!code) code = choose_mode(slave);
  if (code) return code;
  slave->watched = triggers_watchdog(slave);
  return slave->watched && watchdog_time(slave->board) == 0 ? AL_CODE_WATCHDOG_SETTINGS : AL_CODE_NONE;
}

uint16_t outputs_check(struct slave *slave) {
  if (slave->output_bytes == 0) return AL_CODE_NONE;
  if (!slave->outputs_received) return AL_CODE_NO_OUTPUTS;
  return slave->watched && !watchdog_runs(slave->board, slave->by_write) ? AL_CODE_WATCHDOG : AL_CODE_NONE;
}

static void switch_process(struct slave *slave, bool on) {
  const struct slave_device *d = slave->device;
  if (d->outputs.most > 0) sync_manager_switch(slave->board, d->outputs.sync_manager, on);
  if (d->inputs.most > 0) sync_manager_switch(slave->board, d->inputs.sync_manager, on);
}

/* The whole buffer, which closes it: an open one takes nothing newer (SM-13). */
static void take_outputs(struct slave *slave) {
  buffer_read(slave->board, slave->device->outputs.start, slave->memory.process, slave->output_bytes,
              slave->by_write);
}

static void read_outputs(struct slave *slave) {
  uint8_t bytes[8];
  uint32_t at = 0;
  take_outputs(slave);
  for (uint16_t i = 0; i < slave->output_count; ++i) {
    const struct slave_mapped *m = &slave->memory.outputs[i];
    if (m->entry) {
      bits_read(slave->memory.process, at, m->bits, bytes);
      entry_store(slave->memory.objects, m->entry, bytes);
    }
    at += m->bits;
  }
}

static void write_inputs(struct slave *slave) {
  uint8_t bytes[8];
  uint32_t at = 0;
  if (slave->input_bytes == 0) return;
  if (slave->cycle_due)
    slave->cycle_due = !sync_manager_is_on(slave->board, slave->device->inputs.sync_manager);
  for (uint16_t i = 0; i < slave->input_bytes; ++i) slave->memory.process[i] = 0;
  for (uint16_t i = 0; i < slave->input_count; ++i) {
    const struct slave_mapped *m = &slave->memory.inputs[i];
    if (m->entry) {
      entry_load(slave->memory.objects, m->entry, bytes);
      bits_write(slave->memory.process, at, m->bits, bytes);
    }
    at += m->bits;
  }
  board_write(slave->board, slave->device->inputs.start, slave->memory.process, slave->input_bytes);
}

static void cycle(struct slave *slave) {
  const struct slave_application *a = slave->application;
  if (a->cycle) a->cycle(a->context, slave->state == AL_OP);
  if (slave->input_bytes == 0) slave->cycle_due = false;
  write_inputs(slave);
}

void process_begin(struct slave *slave) {
  switch_process(slave, true);
  slave->cycle_due = slave->input_bytes > 0;
  cycle(slave); /* there are inputs from the beginning */
}

/* The outputs that came last are valid from now on, and their event is over: no other cycle would take them
 * to where they act. */
void outputs_begin(struct slave *slave) {
  slave->missed = slave->unsynced = 0;
  if (slave->output_bytes == 0) return;
  read_outputs(slave);
  slave->cycle_due |= slave->mode == SLAVE_SM_SYNCHRONOUS;
}

void process_end(struct slave *slave) {
  switch_process(slave, false);
  slave->output_bytes = slave->input_bytes = slave->output_count = slave->input_count = 0;
}

/* Whether a cycle is due; `received`: there are new outputs. */
static bool is_due(struct slave *slave, uint32_t events, bool received) {
  if (slave->mode == SLAVE_FREE_RUN || slave->cycle_due) return true;
  if (slave->mode == SLAVE_SYNC0) return (events & EVENT_SYNC0) != 0;
  if (slave->output_bytes > 0) return received;
  return (events & event_of(slave->device->inputs.sync_manager)) != 0;
}

/* Whether outputs and SYNC0 come together in SYNC mode, as an AL status code. */
static uint16_t count_missed(struct slave *slave, bool sync, bool received) {
  if (received && slave->unsynced <= UNSYNCED_MOST) ++slave->unsynced;
  if (sync) {
    slave->missed = slave->unsynced > 0 ? 0 : (uint8_t)(slave->missed + 1);
    slave->unsynced = 0;
  }
  if (slave->missed > MISSED_MOST) return AL_CODE_SYNC_ERROR;
  return slave->unsynced > UNSYNCED_MOST ? AL_CODE_NO_SYNC : AL_CODE_NONE;
}

/* Why OP cannot go on, as an AL status code. Whether the watchdog runs now does not tell: it may have expired
 * and run again, and asking would end an event that has not been seen. */
static uint16_t failure(struct slave *slave, uint32_t events, bool sync, bool received) {
  if (slave->state != AL_OP || slave->output_bytes == 0) return AL_CODE_NONE;
  if (slave->watched && (events & EVENT_WATCHDOG)) {
    watchdog_runs(slave->board, slave->by_write);
    return AL_CODE_WATCHDOG;
  }
  return slave->mode == SLAVE_SYNC0 ? count_missed(slave, sync, received) : AL_CODE_NONE;
}

void slave_inputs(struct slave *slave) {
  if (slave->input_bytes > 0 && slave->mode != SLAVE_SYNC0) slave->cycle_due = true;
}

void process_switched(struct slave *slave) {
  const uint8_t number = slave->device->inputs.sync_manager;
  if (slave->input_bytes == 0) return;
  if ((sync_manager_status(slave->board, number) & SM_NONE_WRITTEN) == SM_NONE_WRITTEN)
    slave->cycle_due = true;
}

bool process_receive(struct slave *slave, uint32_t events) {
  const uint8_t number = slave->device->outputs.sync_manager;
  if (slave->output_bytes == 0 || !(events & event_of(number))) return false;
  slave->outputs_received = true;
  if (slave->state == AL_OP) read_outputs(slave);
  else take_outputs(slave);
  return true;
}

void process_serve(struct slave *slave, uint32_t events, bool received) {
  const bool sync = slave->mode == SLAVE_SYNC0 && (events & EVENT_SYNC0) != 0;
  if (sync) sync0_acknowledge(slave->board, slave->by_write);
  const uint16_t code = failure(slave, events, sync, received);
  if (code) slave_fall(slave, AL_SAFEOP, code);
  if (code || is_due(slave, events, received)) cycle(slave);
}

uint32_t process_events(const struct slave *slave) {
  const bool drives = slave->output_bytes > 0;
  uint32_t mask = drives ? event_of(slave->device->outputs.sync_manager) : 0;
  if (slave->mode == SLAVE_SYNC0) mask |= EVENT_SYNC0;
  if (slave->mode == SLAVE_SM_SYNCHRONOUS && !drives && slave->input_bytes > 0)
    mask |= event_of(slave->device->inputs.sync_manager);
  if (slave->state == AL_OP && drives && slave->watched) mask |= EVENT_WATCHDOG;
  return mask;
}

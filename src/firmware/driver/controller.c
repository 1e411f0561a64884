#include "controller.h"

#include "esc.h"

uint32_t events_pending(struct board *board) { return read_number(board, ESC_AL_EVENT_REQUEST, 4); }

void events_select(struct board *board, uint32_t mask) { write_number(board, ESC_AL_EVENT_MASK, 4, mask); }

bool acknowledges_by_write(struct board *board) {
  return read_number(board, ESC_PDI_INFORMATION, 1) & ESC_ACKNOWLEDGE_BY_WRITE_MASK;
}

/* Whatever is written: nothing is stored. */
static void acknowledge(struct board *board, uint16_t address, bool by_write) {
  if (by_write) write_number(board, address, 1, 0);
}

/* Behind it: until then the master cannot ask for anything else. */
uint16_t al_control(struct board *board, bool by_write) {
  const uint16_t control = (uint16_t)read_number(board, ESC_AL_CONTROL, 1);
  acknowledge(board, ESC_AL_CONTROL, by_write);
  return control;
}

void al_answer(struct board *board, uint16_t status, uint16_t code) {
  write_number(board, ESC_AL_STATUS_CODE, 2, code);
  write_number(board, ESC_AL_STATUS, 2, status);
}

uint16_t al_status(struct board *board) { return (uint16_t)read_number(board, ESC_AL_STATUS, 2); }

void sync_manager_read(struct board *board, uint8_t number, struct sync_manager *settings) {
  uint8_t bytes[6];
  /* First: a change that comes meanwhile is an event again. */
  settings->activate = (uint8_t)read_number(board, (uint16_t)ESC_SMN_ACTIVATE(number), 1);
  board_read(board, (uint16_t)ESC_SMN_START(number), bytes, sizeof bytes);
  settings->start = (uint16_t)number_at(bytes, 2);
  settings->length = (uint16_t)number_at(bytes + 2, 2);
  settings->control = bytes[4];
  settings->status = bytes[5];
}

uint8_t sync_manager_control(struct board *board, uint8_t number) {
  return (uint8_t)read_number(board, (uint16_t)ESC_SMN_CONTROL(number), 1);
}

uint8_t sync_manager_status(struct board *board, uint8_t number) {
  return (uint8_t)read_number(board, (uint16_t)ESC_SMN_STATUS(number), 1);
}

bool sync_manager_is_on(struct board *board, uint8_t number) {
  return !(read_number(board, (uint16_t)ESC_SMN_PDI_CONTROL(number), 1) & ESC_SMN_DEACTIVATED_MASK);
}

bool sync_manager_switch(struct board *board, uint8_t number, bool on) {
  enum { MOST_LOOKS = 1000 };
  const uint16_t address = (uint16_t)ESC_SMN_PDI_CONTROL(number);
  const uint32_t others = read_number(board, address, 1) & ~ESC_SMN_DEACTIVATED_MASK;
  write_number(board, address, 1, others | (on ? 0 : ESC_SMN_DEACTIVATED_MASK));
  for (int looks = 0; looks < MOST_LOOKS; ++looks)
    if (sync_manager_is_on(board, number) == on) return true;
  return false;
}

/* Acknowledged first: a change that comes meanwhile is an event again. */
void activations_read(struct board *board, uint8_t *bytes, uint8_t count, bool by_write) {
  acknowledge(board, (uint16_t)ESC_SMN_ACTIVATE(0), by_write);
  for (uint8_t i = 0; i < count; ++i)
    bytes[i] = (uint8_t)read_number(board, (uint16_t)ESC_SMN_ACTIVATE(i), 1);
}

void buffer_read(struct board *board, uint16_t start, uint8_t *bytes, uint16_t length, bool by_write) {
  board_read(board, start, bytes, length);
  acknowledge(board, (uint16_t)(start + length - 1), by_write);
}

bool watchdog_runs(struct board *board, bool by_write) {
  acknowledge(board, ESC_WATCHDOG_STATUS_PROCESS_DATA, by_write);
  return read_number(board, ESC_WATCHDOG_STATUS_PROCESS_DATA, 1) & ESC_WATCHDOG_PROCESS_DATA_MASK;
}

uint16_t watchdog_time(struct board *board) {
  return (uint16_t)read_number(board, ESC_WATCHDOG_TIME_PROCESS_DATA, 2);
}

bool sync0_is_active(struct board *board) {
  const uint32_t needed = ESC_CYCLIC_ACTIVE_MASK | ESC_SYNC0_ENABLE_MASK;
  return (read_number(board, ESC_SYNC_ACTIVATION, 1) & needed) == needed;
}

uint32_t sync0_cycle(struct board *board) { return read_number(board, ESC_SYNC0_CYCLE, 4); }

void sync0_acknowledge(struct board *board, bool by_write) {
  if (by_write) acknowledge(board, ESC_SYNC0_STATUS, true);
  else read_number(board, ESC_SYNC0_STATUS, 1);
}

bool sync0_waits(struct board *board) {
  enum { MAPPED = 0x0800 };
  return read_number(board, ESC_SYNC_PULSE_LENGTH, 2) == 0 &&
         (read_number(board, ESC_PDI_CONFIGURATION, 2) & MAPPED) != 0;
}

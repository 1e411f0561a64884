#include "alarm_master.h"

#include "alarm-master.h"
#include "alarm-slave.h"
#include "heartbeat.h"
#include "master_setup.h"
#include "orders.h"
#include "request.h"

enum {
  POLL_US = 1000,
  PROBES = 4, /* looks whether the line moves, in the time that the host has promised to live */
  KEPT = MASTER_LINE_RUN_MASK | MASTER_REPORT_RUN_MASK | MASTER_LINE_LISTED_MASK | MASTER_LAMP_TEST_MASK
};

bool alarm_master_storage_failed(const struct alarm_master *master) {
  return master->store_failed || master->log.failed;
}

/* The low half may have its carry between two reads. */
static uint64_t time_of(struct board *board) {
  const uint32_t before = read_number(board, MASTER_MASTER_TIME + 4, 4);
  const uint32_t low = read_number(board, MASTER_MASTER_TIME, 4);
  const uint32_t high = read_number(board, MASTER_MASTER_TIME + 4, 4);
  return (uint64_t)high << 32 | (high == before ? low : 0);
}

enum self_test alarm_master_start(struct alarm_master *master, struct board *board,
                                  const struct alarm_master_parameters *parameters) {
  *master = (struct alarm_master){.board = board, .parameters = *parameters, .line_moves = true};
  /* Of an unknown controller nothing is written. */
  if (!master_is_there(board)) return master->self_test = SELF_TEST_CONTROLLER;
  picture_begin(&master->picture);
  master->self_test = master_set_up(master);
  struct alarm_master_parameters *p = &master->parameters;
  if (p->alive_ms < HEARTBEAT_LEAST_MS) p->alive_ms = HEARTBEAT_LEAST_MS;
  if (!panel_fits(&p->panel)) {
    p->panel.lines = PANEL_LEAST_LINES;
    p->panel.columns = PANEL_LEAST_COLUMNS;
  }
  panel_begin(&master->panel, &p->panel);
  heartbeat(board, MASTER_HOST_ALIVE, p->alive_ms);
  master->marked = number_holds(board, MASTER_MASTER_SELF_TEST, 1, master->self_test);
  write_number(board, MASTER_MASTER_CONTROL, 1, master->control);
  /* Takes its time: the line runs already. */
  event_log_open(&master->log, board, master->line_life);
  event_log_write(&master->log,
                  &(struct log_record){
                      .time_us = time_of(board), .kind = LOG_START, .detail = (uint32_t)master->self_test});
  return master->self_test;
}

static void start_again(struct alarm_master *master) {
  const enum self_test before = master->self_test;
  const struct alarm_master_parameters parameters = master->parameters;
  alarm_master_start(master, master->board, &parameters);
  if (master->self_test != before) board_notice(master->board, self_test_text(master->self_test));
}

/* What runs goes on; a bit that has changed by itself is set right. */
static void keep_control(struct alarm_master *master) {
  master->control = (uint8_t)(master->control & ~MASTER_LAMP_TEST_MASK);
  if (master->panel.level & BOARD_TEST) master->control |= MASTER_LAMP_TEST_MASK;
  if ((read_number(master->board, MASTER_MASTER_CONTROL, 1) & KEPT) != master->control)
    write_number(master->board, MASTER_MASTER_CONTROL, 1, master->control);
}

static void serve_panel(struct alarm_master *master, uint64_t time_us) {
  static const struct {
    uint8_t button, order;
  } orders[] = {{BOARD_SILENCE, PROTOCOL_ORDER_SILENCE},
                {BOARD_ACKNOWLEDGE, PROTOCOL_ORDER_ACKNOWLEDGE},
                {BOARD_RESET, PROTOCOL_ORDER_RESET}};
  const uint32_t now_ms = (uint32_t)(time_us / 1000);
  const uint8_t pressed = panel_inputs(&master->panel, master->board, now_ms);
  keep_control(master);
  for (int i = 0; i < (int)(sizeof orders / sizeof orders[0]); ++i)
    if (pressed & orders[i].button) order_by_panel(master, orders[i].order, time_us);
  panel_show(&master->panel, master->board, &master->picture, now_ms, (uint32_t)(time_us / 1000000));
}

static void tell_faults(struct alarm_master *master) {
  uint8_t faults = 0;
  if (master->panel.level & BOARD_MAINS_FAILED) faults |= MASTER_MAINS_FAILED_MASK;
  if (master->panel.level & BOARD_BATTERY_LOW) faults |= MASTER_BATTERY_LOW_MASK;
  if (master->panel.level & BOARD_EARTH_FAULT) faults |= MASTER_EARTH_FAULT_MASK;
  if (alarm_master_storage_failed(master)) faults |= MASTER_STORAGE_FAILED_MASK;
  master->faults = faults;
  write_number(master->board, MASTER_HOST_FAULTS, 1, faults);
}

/* A datagram that changes nothing: whether anybody answers does not matter, but it must be sent. */
static void probe_line(struct alarm_master *master, uint16_t passed_ms) {
  master->probe_ms += passed_ms;
  if (master->probe_ms < master->parameters.alive_ms / PROBES) return;
  master->probe_ms = 0;
  struct request probe = {.command = PROTOCOL_ECAT_BRD, .ado = ESC_SLAVE_STATE, .length = 2};
  master->line_moves =
      request(master->board, &probe, master_request_limit(&master->parameters)) != REQUEST_HUNG;
}

void alarm_master_serve(struct alarm_master *master) {
  struct board *board = master->board;
  board_wait(board, POLL_US);
  const bool was_reset =
      master->marked && read_number(board, MASTER_MASTER_SELF_TEST, 1) != (uint32_t)master->self_test;
  if (master->self_test == SELF_TEST_CONTROLLER || was_reset || !master_is_there(board)) {
    start_again(master);
    return;
  }
  const uint16_t passed_ms = heartbeat(board, MASTER_HOST_ALIVE, master->parameters.alive_ms);
  const uint64_t time_us = time_of(board);
  picture_look(&master->picture, board, &master->log, time_us);
  serve_panel(master, time_us);
  if (read_number(board, MASTER_MASTER_STATUS, 1) & MASTER_MAILBOX_WAITING_MASK) take_order(master, time_us);
  tell_events(master);
  tell_faults(master);
  probe_line(master, passed_ms);
  if (passed_ms > 0 && master->line_moves) board_watchdog(board);
}

void alarm_master_run(struct alarm_master *master, struct board *board,
                      const struct alarm_master_parameters *parameters) {
  if (alarm_master_start(master, board, parameters) != SELF_TEST_GOOD)
    board_notice(board, self_test_text(master->self_test));
  for (;;) alarm_master_serve(master);
}

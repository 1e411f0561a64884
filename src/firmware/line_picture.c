#include "line_picture.h"

#include "alarm-master.h"
#include "self_test.h"

enum {
  LOOKS = 8, /* slaves in one call */
  PAUSE_S =
      1, /* between two entries of the log about the same: so faults that come and go do not wear it out */
  SMOKE = PROTOCOL_SLAVE_ALARM | PROTOCOL_SLAVE_LATCHED
};

uint16_t picture_faults(uint16_t status) { return status & (PROTOCOL_SLAVE_FAULTS | PROTOCOL_SLAVE_ABSENT); }

struct look {
  uint16_t status, node;
};

static struct look look_at(struct board *board, uint8_t position) {
  uint8_t bytes[PROTOCOL_SLAVE_STATE_SELF_TEST_AT];
  write_number(board, MASTER_SLAVE_INDEX, 1, position);
  board_read(board, MASTER_SLAVE_STATE, bytes, sizeof bytes);
  return (struct look){
      (uint16_t)(bytes[PROTOCOL_SLAVE_STATE_STATUS_AT] | bytes[PROTOCOL_SLAVE_STATE_STATUS_AT + 1] << 8),
      (uint16_t)(bytes[PROTOCOL_SLAVE_STATE_NODE_AT] | bytes[PROTOCOL_SLAVE_STATE_NODE_AT + 1] << 8)};
}

static void log_slave(struct line_picture *picture, uint8_t position, struct event_log *log,
                      uint64_t time_us) {
  struct pictured_slave *s = &picture->slaves[position];
  const uint32_t now_s = (uint32_t)(time_us / 1000000);
  const uint16_t faults = picture_faults(s->status);
  const bool alarm = s->alarm != 0;
  if (alarm == s->logged_alarm && faults == s->logged_faults) return;
  /* An alarm that begins never waits. */
  if (s->ever_logged && now_s - s->logged_s < PAUSE_S && !(alarm && !s->logged_alarm)) return;
  struct log_record record = {.time_us = time_us, .position = position, .node = s->node, .detail = s->status};
  if (alarm != s->logged_alarm) {
    record.kind = alarm ? LOG_ALARM : LOG_ALARM_OVER;
    event_log_write(log, &record);
  }
  if (faults != s->logged_faults) {
    record.kind = LOG_SLAVE_FAULTS;
    record.detail = faults;
    event_log_write(log, &record);
  }
  s->logged_alarm = alarm;
  s->logged_faults = faults;
  s->logged_s = now_s;
  s->ever_logged = true;
}

static void log_state(struct line_picture *picture, struct event_log *log, uint64_t time_us) {
  const uint32_t now_s = (uint32_t)(time_us / 1000000), faults = picture->state & PROTOCOL_MASTER_FAULTS;
  if (faults == picture->logged_state) return;
  if (picture->ever_logged && now_s - picture->logged_s < PAUSE_S) return;
  event_log_write(log, &(struct log_record){.time_us = time_us, .kind = LOG_MASTER_FAULTS, .detail = faults});
  picture->logged_state = faults;
  picture->logged_s = now_s;
  picture->ever_logged = true;
}

/* An absent slave says nothing new of its smoke: its alarm lasts as long as the master's. */
static void follow_alarm(struct line_picture *picture, struct pictured_slave *s, uint32_t now_s) {
  const bool absent = (s->status & PROTOCOL_SLAVE_ABSENT) != 0;
  const bool seen = (s->status & SMOKE) != 0;
  const bool fire = (picture->state & PROTOCOL_MASTER_FIRE) != 0;
  const bool smoke = absent ? fire && (seen || s->alarm != 0) : seen;
  if (smoke && s->alarm == 0) {
    ++picture->alarms;
    s->alarm = ++picture->given;
    s->since_s = now_s;
  } else if (!smoke && s->alarm != 0) {
    s->alarm = 0;
    if (--picture->alarms == 0) picture->given = 0;
  }
}

/* The controller may write its table while a look reads it byte by byte: what is new counts when it is the
 * same twice. */
static bool look_anew(struct line_picture *picture, struct board *board, uint8_t position) {
  struct pictured_slave *s = &picture->slaves[position];
  const struct look first = look_at(board, position);
  if (first.status == s->status && first.node == s->node) return true;
  const struct look second = look_at(board, position);
  if (first.status != second.status || first.node != second.node) return false;
  s->status = first.status;
  s->node = first.node;
  return true;
}

void picture_begin(struct line_picture *picture) {
  *picture = (struct line_picture){0};
  for (int i = 0; i < PICTURE_MOST_SLAVES; ++i) picture->slaves[i].status = PROTOCOL_SLAVE_ABSENT;
}

void picture_look(struct line_picture *picture, struct board *board, struct event_log *log,
                  uint64_t time_us) {
  const uint32_t state = read_number(board, MASTER_MASTER_STATE, 4);
  if (state == read_number(board, MASTER_MASTER_STATE, 4)) picture->state = state & MASTER_MASTER_STATE_MASK;
  picture->cut = (uint8_t)read_number(board, MASTER_RING_CUT, 1);
  const uint32_t known = read_number(board, MASTER_SLAVES_KNOWN, 1);
  picture->known = (uint8_t)(known < PICTURE_MOST_SLAVES ? known : PICTURE_MOST_SLAVES);
  for (int i = 0; i < LOOKS && i < picture->known; ++i) {
    if (picture->next >= picture->known) picture->next = 0;
    const uint8_t position = picture->next++;
    if (!look_anew(picture, board, position)) continue;
    follow_alarm(picture, &picture->slaves[position], (uint32_t)(time_us / 1000000));
    log_slave(picture, position, log, time_us);
  }
  log_state(picture, log, time_us);
}

int picture_position(const struct line_picture *picture, uint16_t node, int first) {
  for (int i = first; i < picture->known; ++i)
    if (picture->slaves[i].node == node && !(picture->slaves[i].status & PROTOCOL_SLAVE_ABSENT)) return i;
  return -1;
}

uint16_t picture_present(const struct line_picture *picture) {
  uint16_t present = 0;
  for (int i = 0; i < picture->known; ++i)
    if (picture->slaves[i].node != 0 && !(picture->slaves[i].status & PROTOCOL_SLAVE_ABSENT)) ++present;
  return present;
}

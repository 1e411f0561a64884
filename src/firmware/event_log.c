#include "event_log.h"

/* Where the fields of a record are, little endian. */
enum { NUMBER = 0, TIME = 4, LIFE = 12, KIND = 14, POSITION = 15, NODE = 16, DETAIL = 18, CHECK = 30 };

static void put(uint8_t *to, uint64_t number, int bytes) {
  for (int i = 0; i < bytes; ++i) to[i] = (uint8_t)(number >> (8 * i));
}

static uint64_t get(const uint8_t *from, int bytes) {
  uint64_t number = 0;
  for (int i = 0; i < bytes; ++i) number |= (uint64_t)from[i] << (8 * i);
  return number;
}

/* A CRC of 16 bits (polynomial 0x1021, from 0xffff on): erased bytes and zeros are no record. */
static uint16_t check_of(const uint8_t *bytes) {
  uint16_t crc = 0xffff;
  for (int i = 0; i < CHECK; ++i) {
    crc = (uint16_t)(crc ^ bytes[i] << 8);
    for (int bit = 0; bit < 8; ++bit) crc = (uint16_t)(crc & 0x8000 ? crc << 1 ^ 0x1021 : crc << 1);
  }
  return crc;
}

/* False: the memory does not work. A record that is not whole, or is none of this place, gets number 0. */
static bool read_place(struct event_log *log, uint16_t index, struct log_record *record) {
  uint8_t bytes[BOARD_LOG_BYTES];
  *record = (struct log_record){0};
  if (!board_log_read(log->board, index, bytes)) return false;
  const uint32_t number = (uint32_t)get(bytes + NUMBER, 4);
  if (get(bytes + CHECK, 2) != check_of(bytes) || number % BOARD_LOG_RECORDS != index) return true;
  record->number = number;
  record->time_us = get(bytes + TIME, 8);
  record->life = (uint16_t)get(bytes + LIFE, 2);
  record->kind = bytes[KIND];
  record->position = bytes[POSITION];
  record->node = (uint16_t)get(bytes + NODE, 2);
  record->detail = (uint32_t)get(bytes + DETAIL, 4);
  return true;
}

void event_log_open(struct event_log *log, struct board *board, uint16_t life) {
  *log = (struct event_log){.board = board, .life = life};
  for (uint16_t i = 0; i < BOARD_LOG_RECORDS; ++i) {
    struct log_record record;
    if (!read_place(log, i, &record)) log->failed = true;
    if (record.number > log->last) log->last = record.number;
  }
}

void event_log_write(struct event_log *log, const struct log_record *record) {
  const uint32_t number = ++log->last;
  uint8_t bytes[BOARD_LOG_BYTES] = {0};
  put(bytes + NUMBER, number, 4);
  put(bytes + TIME, record->time_us, 8);
  put(bytes + LIFE, log->life, 2);
  bytes[KIND] = record->kind;
  bytes[POSITION] = record->position;
  put(bytes + NODE, record->node, 2);
  put(bytes + DETAIL, record->detail, 4);
  put(bytes + CHECK, check_of(bytes), 2);
  log->failed = !board_log_write(log->board, (uint16_t)(number % BOARD_LOG_RECORDS), bytes);
}

bool event_log_read(struct event_log *log, uint32_t back, struct log_record *record) {
  if (back >= BOARD_LOG_RECORDS || back >= log->last) return false;
  const uint32_t number = log->last - back;
  return read_place(log, (uint16_t)(number % BOARD_LOG_RECORDS), record) && record->number == number;
}

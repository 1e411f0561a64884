#include "fake.h"

#include <algorithm>

extern "C" {
void board_read(board* b, uint16_t address, uint8_t* data, uint16_t length) {
  for (uint16_t i = 0; i < length; ++i) data[i] = b->readByte(static_cast<uint16_t>(address + i));
}
void board_write(board* b, uint16_t address, const uint8_t* data, uint16_t length) {
  for (uint16_t i = 0; i < length; ++i) b->writeByte(static_cast<uint16_t>(address + i), data[i]);
}
bool board_load(board* b, uint32_t* number) {
  *number = b->stored;
  return !board::fails(b->loadFails);
}
bool board_store(board* b, uint32_t number) {
  if (board::fails(b->storeFails)) return false;
  if (b->storeKeeps) b->stored = number;
  return true;
}
bool board_log_write(board* b, uint16_t index, const uint8_t* record) {
  ++b->logWrites;
  if (board::fails(b->logWriteFails)) return false;
  std::copy(record, record + BOARD_LOG_BYTES, b->log[index].begin());
  return index < BOARD_LOG_RECORDS;
}
bool board_log_read(board* b, uint16_t index, uint8_t* record) {
  std::fill(record, record + BOARD_LOG_BYTES, b->erased);
  if (board::fails(b->logReadFails)) return false;
  const auto found = b->log.find(index);
  if (found != b->log.end()) std::copy(found->second.begin(), found->second.end(), record);
  return true;
}
bool board_random(board* b, uint8_t* bytes, uint16_t length) {
  for (uint16_t i = 0; i < length; ++i) {
    b->drawn = b->drawn * 1664525u + 1013904223u;
    bytes[i] = static_cast<uint8_t>(b->drawn >> 24);
  }
  return !board::fails(b->randomFails);
}
void board_wait(board* b, uint32_t us) { b->wait(us); }
uint32_t board_time(board* b) { return b->time(); }
void board_watchdog(board* b) { ++b->watched; }
uint8_t board_inputs(board* b) { return b->inputs; }
void board_display(board* b, uint8_t line, const char* text) {
  ++b->displayed;
  b->display.at(line) = text;
}
void board_notice(board* b, const char* sentence) { b->notices.push_back(sentence); }
}

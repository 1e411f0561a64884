#include "fake.h"

extern "C" {
void board_read(board* b, uint16_t address, uint8_t* data, uint16_t length) {
  for (uint16_t i = 0; i < length; ++i) data[i] = b->readByte(static_cast<uint16_t>(address + i));
}
void board_write(board* b, uint16_t address, const uint8_t* data, uint16_t length) {
  for (uint16_t i = 0; i < length; ++i) b->writeByte(static_cast<uint16_t>(address + i), data[i]);
}
bool board_load(board* b, uint32_t* number) {
  *number = b->stored;
  return b->storeWorks;
}
bool board_store(board* b, uint32_t number) {
  if (b->storeKeeps) b->stored = number;
  return b->storeWorks;
}
void board_wait(board* b, uint32_t us) { b->wait(us); }
void board_fatal(board* b, const char* sentence) {
  b->fatal = sentence;
  throw std::runtime_error(sentence);
}
}

#include "mailbox.h"

#include "esc.h"

void mailbox_header_read(const uint8_t *bytes, struct mailbox_header *header) {
  header->length = (uint16_t)number_at(bytes, 2);
  header->address = (uint16_t)number_at(bytes + 2, 2);
  header->channel = bytes[4];
  header->type = bytes[5] & 0x0f;
  header->counter = bytes[5] >> 4 & 0x07;
}

void mailbox_header_write(uint8_t *bytes, const struct mailbox_header *header) {
  number_to(bytes, 2, header->length);
  number_to(bytes + 2, 2, header->address);
  bytes[4] = header->channel;
  bytes[5] = (uint8_t)(header->type | header->counter << 4);
}

bool mailbox_is_full(struct board *board, uint8_t number) {
  return read_number(board, (uint16_t)ESC_SMN_STATUS(number), 1) & ESC_SMN_MAILBOX_FULL_MASK;
}

void mailbox_take(struct board *board, const struct mailbox_area *area, uint8_t *bytes, bool by_write) {
  buffer_read(board, area->start, bytes, area->length, by_write);
}

void mailbox_put(struct board *board, const struct mailbox_area *area, const uint8_t *bytes) {
  const uint16_t used = (uint16_t)(MAILBOX_HEADER + number_at(bytes, 2));
  board_write(board, area->start, bytes, used < area->length ? used : area->length);
  if (used < area->length) write_number(board, (uint16_t)(area->start + area->length - 1), 1, 0);
}

static bool repeat_bit(struct board *board, uint16_t address) {
  return read_number(board, address, 1) & ESC_SMN_REPEAT_REQUEST_MASK;
}

bool mailbox_repeat_asked(struct board *board) {
  return repeat_bit(board, (uint16_t)ESC_SMN_ACTIVATE(MAILBOX_SEND)) !=
         repeat_bit(board, (uint16_t)ESC_SMN_PDI_CONTROL(MAILBOX_SEND));
}

void mailbox_repeated(struct board *board) {
  const uint16_t address = (uint16_t)ESC_SMN_PDI_CONTROL(MAILBOX_SEND);
  const uint32_t now = read_number(board, address, 1) ^ ESC_SMN_REPEAT_ACKNOWLEDGE_MASK;
  /* On, whatever reads back while a switch waits for a frame to pass. */
  write_number(board, address, 1, now & ~ESC_SMN_DEACTIVATED_MASK);
}

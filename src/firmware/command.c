#include "command.h"

#include <mbedtls/constant_time.h>
#include <mbedtls/md.h>

enum { MAGIC = 0x4641, VERSION = 1, KIND = 3, CODE_BYTES = COMMAND_BYTES - COMMAND_CODE_AT, DIGEST_BYTES = 32 };

static uint16_t big16(const uint8_t *at) { return (uint16_t)(at[0] << 8 | at[1]); }
static uint32_t big32(const uint8_t *at) { return (uint32_t)big16(at) << 16 | big16(at + 2); }

/* mbed TLS allocates some 200 bytes for the time of the call: a board without a heap gives it a buffer by
 * mbedtls_memory_buffer_alloc_init(). */
static bool has_right_code(const uint8_t *key, const uint8_t *message) {
  uint8_t digest[DIGEST_BYTES];
  if (mbedtls_md_hmac(mbedtls_md_info_from_type(MBEDTLS_MD_SHA256), key, COMMAND_KEY_BYTES, message, COMMAND_CODE_AT, digest) != 0)
    return false;
  return mbedtls_ct_memcmp(digest, message + COMMAND_CODE_AT, CODE_BYTES) == 0;
}

enum command_verdict command_check(struct command_filter *filter, const uint8_t *message, uint16_t length, struct command *command) {
  if (length != COMMAND_BYTES || big16(message) != MAGIC || message[2] != VERSION || message[3] != KIND ||
      big16(message + 4) != filter->master_id || message[13] != 0)
    return COMMAND_MALFORMED;
  if (!has_right_code(filter->key, message)) return COMMAND_FORGED;
  const uint32_t counter = big32(message + 8);
  if (big16(message + 6) != filter->boot || (filter->any && counter <= filter->last_counter)) return COMMAND_REPLAYED;
  filter->any = true;
  filter->last_counter = counter;
  command->counter = counter;
  command->code = message[12];
  command->node = big16(message + 14);
  return COMMAND_ACCEPTED;
}

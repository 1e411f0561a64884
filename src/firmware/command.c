#include "command.h"

#include <mbedtls/constant_time.h>
#include <mbedtls/md.h>

enum { DIGEST_BYTES = 32 }; /* of SHA-256 */

static uint16_t big16(const uint8_t *at) { return (uint16_t)(at[0] << 8 | at[1]); }
static uint32_t big32(const uint8_t *at) { return (uint32_t)big16(at) << 16 | big16(at + 2); }

/* mbed TLS allocates a little memory for the time of the call: a board without a heap gives it a buffer by
 * mbedtls_memory_buffer_alloc_init(). */
static bool has_right_code(const uint8_t *key, const uint8_t *message) {
  uint8_t digest[DIGEST_BYTES];
  if (mbedtls_md_hmac(mbedtls_md_info_from_type(MBEDTLS_MD_SHA256), key, PROTOCOL_KEY_BYTES, message,
                      PROTOCOL_COMMAND_CODE_AT, digest) != 0)
    return false;
  return mbedtls_ct_memcmp(digest, message + PROTOCOL_COMMAND_CODE_AT, PROTOCOL_COMMAND_CODE_BYTES) == 0;
}

enum command_verdict command_check(struct command_filter *filter, const uint8_t *message, uint16_t length,
                                   struct command *command) {
  if (length != PROTOCOL_COMMAND_BYTES || big16(message + PROTOCOL_COMMAND_MAGIC_AT) != PROTOCOL_MAGIC ||
      message[PROTOCOL_COMMAND_VERSION_AT] != PROTOCOL_VERSION ||
      message[PROTOCOL_COMMAND_KIND_AT] != PROTOCOL_KIND_COMMAND ||
      big16(message + PROTOCOL_COMMAND_MASTER_AT) != filter->master_id ||
      message[PROTOCOL_COMMAND_ZERO_AT] != 0)
    return COMMAND_MALFORMED;
  if (!has_right_code(filter->key, message)) return COMMAND_FORGED;
  const uint32_t counter = big32(message + PROTOCOL_COMMAND_NUMBER_AT);
  if (big16(message + PROTOCOL_COMMAND_BOOT_AT) != filter->boot ||
      (filter->any && counter <= filter->last_counter))
    return COMMAND_REPLAYED;
  filter->any = true;
  filter->last_counter = counter;
  command->counter = counter;
  command->order = message[PROTOCOL_COMMAND_ORDER_AT];
  command->node = big16(message + PROTOCOL_COMMAND_NODE_AT);
  return COMMAND_ACCEPTED;
}

/* Tags of datagrams between a ring's gateway and the server; of those of an alarm master the controller makes
 * and checks the tags. Ascon-AEAD128 (NIST SP 800-232), the message as associated data, no plaintext. */
#ifndef FLYFRAME_ASCON_H
#define FLYFRAME_ASCON_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum { ASCON_KEY_BYTES = 16, ASCON_NONCE_BYTES = 16, ASCON_TAG_BYTES = 16 };

/* The tag of `length` bytes. */
void ascon_tag(uint8_t tag[ASCON_TAG_BYTES], const uint8_t key[ASCON_KEY_BYTES],
               const uint8_t nonce[ASCON_NONCE_BYTES], const uint8_t *message, size_t length);

/* Two tags are the same; takes the same time wherever they differ. */
bool ascon_same(const uint8_t a[ASCON_TAG_BYTES], const uint8_t b[ASCON_TAG_BYTES]);

#endif

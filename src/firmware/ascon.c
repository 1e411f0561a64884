#include "ascon.h"

enum { RATE = 16, ROUNDS_OUTSIDE = 12, ROUNDS_INSIDE = 8 };

/* The five words of the state. */
struct state {
  uint64_t x[5];
};

static uint64_t load(const uint8_t *bytes) {
  uint64_t word = 0;
  for (int i = 0; i < 8; ++i) word |= (uint64_t)bytes[i] << (8 * i);
  return word;
}

static uint64_t turned(uint64_t word, int right) { return word >> right | word << (64 - right); }

static void permute(struct state *s, int rounds) {
  static const int turns[5][2] = {{19, 28}, {61, 39}, {1, 6}, {10, 17}, {7, 41}};
  uint64_t *x = s->x;
  for (int r = 12 - rounds; r < 12; ++r) {
    x[2] ^= (uint64_t)((15 - r) << 4 | r);
    /* The substitution, 64 at once. */
    x[0] ^= x[4];
    x[4] ^= x[3];
    x[2] ^= x[1];
    uint64_t t[5];
    for (int i = 0; i < 5; ++i) t[i] = ~x[i] & x[(i + 1) % 5];
    for (int i = 0; i < 5; ++i) x[i] ^= t[(i + 1) % 5];
    x[1] ^= x[0];
    x[0] ^= x[4];
    x[3] ^= x[2];
    x[2] = ~x[2];
    /* The diffusion within each word. */
    for (int i = 0; i < 5; ++i) x[i] ^= turned(x[i], turns[i][0]) ^ turned(x[i], turns[i][1]);
  }
}

void ascon_tag(uint8_t tag[ASCON_TAG_BYTES], const uint8_t key[ASCON_KEY_BYTES],
               const uint8_t nonce[ASCON_NONCE_BYTES], const uint8_t *message, size_t length) {
  const uint64_t iv = UINT64_C(0x00001000808c0001), k0 = load(key), k1 = load(key + 8);
  struct state s = {{iv, k0, k1, load(nonce), load(nonce + 8)}};
  permute(&s, ROUNDS_OUTSIDE);
  s.x[3] ^= k0;
  s.x[4] ^= k1;
  if (length > 0) {
    /* The last block is one byte 1 behind the message, then zeros; it may hold nothing else. */
    for (size_t at = 0; at <= length; at += RATE) {
      uint8_t block[RATE] = {0};
      for (size_t i = 0; i < RATE && at + i <= length; ++i) block[i] = at + i < length ? message[at + i] : 1;
      s.x[0] ^= load(block);
      s.x[1] ^= load(block + 8);
      permute(&s, ROUNDS_INSIDE);
    }
  }
  s.x[4] ^= UINT64_C(1) << 63; /* the plaintext begins */
  s.x[0] ^= 1;                 /* and is empty */
  s.x[2] ^= k0;
  s.x[3] ^= k1;
  permute(&s, ROUNDS_OUTSIDE);
  for (int i = 0; i < 8; ++i) {
    tag[i] = (uint8_t)((s.x[3] ^ k0) >> (8 * i));
    tag[8 + i] = (uint8_t)((s.x[4] ^ k1) >> (8 * i));
  }
}

bool ascon_same(const uint8_t a[ASCON_TAG_BYTES], const uint8_t b[ASCON_TAG_BYTES]) {
  uint8_t different = 0;
  for (int i = 0; i < ASCON_TAG_BYTES; ++i) different = (uint8_t)(different | (a[i] ^ b[i]));
  return different == 0;
}

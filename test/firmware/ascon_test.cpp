// Tags against known answers (ascon.txt).
#include <fstream>
#include <sstream>

#include "fake.h"

extern "C" {
#include "ascon.h"
}

void testAscon() {
  uint8_t key[16], nonce[16], tag[16];
  for (uint8_t i = 0; i < 16; ++i) key[i] = i, nonce[i] = static_cast<uint8_t>(16 + i);
  std::vector<uint8_t> message;
  for (int i = 0; i < 64; ++i) message.push_back(static_cast<uint8_t>(0x30 + i));
  std::ifstream file("test/firmware/ascon.txt");
  int answers = 0, right = 0;
  for (std::string line; std::getline(file, line);) {
    if (line.empty() || line[0] == '#') continue;
    std::istringstream words(line);
    size_t length;
    std::string expected;
    words >> length >> expected;
    ascon_tag(tag, key, nonce, message.data(), length);
    char hex[33];
    for (int i = 0; i < 16; ++i) std::snprintf(hex + 2 * i, 3, "%02X", tag[i]);
    ++answers;
    right += expected == hex;
  }
  check("33 known answers of Ascon-AEAD128", answers == 33 && right == 33);
  uint8_t other[16];
  bool same = true, different = true;
  for (int bit = 0; bit < 128; ++bit) {
    std::copy(tag, tag + 16, other);
    same = same && ascon_same(tag, other);
    other[bit / 8] ^= static_cast<uint8_t>(1 << bit % 8);
    different = different && !ascon_same(tag, other);
  }
  check("tags are the same if no bit differs", same && different);
}

#include "plant/key.h"

#include <fstream>

#include "core/user_error.h"

void readKey(const std::string& path, uint8_t (&key)[PROTOCOL_KEY_BYTES]) {
  std::ifstream file(path);
  std::string text, more;
  if (!file || !(file >> text)) throw UserError("cannot read the key file '" + path + "'.");
  if (text.size() != 2 * PROTOCOL_KEY_BYTES ||
      text.find_first_not_of("0123456789abcdefABCDEF") != std::string::npos || file >> more)
    throw UserError("the key file '" + path + "' does not hold 32 hex digits in one line.");
  for (size_t i = 0; i < PROTOCOL_KEY_BYTES; ++i)
    key[i] = static_cast<uint8_t>(std::stoul(text.substr(2 * i, 2), nullptr, 16));
}

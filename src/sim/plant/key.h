// The key that a controller and the server share, in a file.
#pragma once

#include <cstdint>
#include <string>

extern "C" {
#include "protocol.h"
}

// 32 hex digits in one line; UserError if it is something else.
void readKey(const std::string& path, uint8_t (&key)[PROTOCOL_KEY_BYTES]);

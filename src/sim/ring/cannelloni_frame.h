// Frames as cannelloni carries them: identifier with flags, length, data.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "ring/can_frame.h"

namespace cannelloni {
struct Found {
  size_t bytes = 0;          // 0: more must come, or nobody knows how many
  bool isMalformed = false;
  std::optional<CanFrame> frame;  // none: malformed, or one of CAN FD, which finds no bus
};

// The frame that begins here.
Found find(const uint8_t* data, size_t length);
std::string bytesOf(const CanFrame& frame);
}  // namespace cannelloni

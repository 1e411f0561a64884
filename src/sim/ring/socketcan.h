// Frames as Linux has them (linux/can.h, linux/can/error.h; no header of Linux is needed): recordings,
// socketcand and cannelloni.
#pragma once

#include <optional>

#include "ring/can_frame.h"

namespace socketcan {
constexpr uint32_t kExtended = 0x80000000, kRemote = 0x40000000, kError = 0x20000000;

struct Frame {
  uint32_t id = 0;                 // with the flags above
  uint8_t length = 0, rawDlc = 0;  // of 9 to 15, else 0
  std::array<uint8_t, 8> data{};
};

// A frame, or an error frame with class, type and location (TL-02). None: nothing that Linux would show.
std::optional<Frame> of(const CanEvent& event);
Frame of(const CanFrame& frame);
// The CAN frame, if it is one that a controller can send.
std::optional<CanFrame> canFrame(uint32_t id, size_t length, const uint8_t* data);
}  // namespace socketcan

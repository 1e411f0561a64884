// CAN frames and bus errors, as CAN programs see them.
#pragma once

#include <array>
#include <cstdint>

#include "core/simulator.h"

struct CanFrame {
  uint32_t id = 0;
  bool extended = false, remote = false;
  uint8_t dlc = 0;
  std::array<uint8_t, 8> data{};
  // Bytes of data: none in a remote frame.
  size_t bytes() const { return remote ? 0 : dlc < 8 ? dlc : 8; }
};

// A bus error as the controller has recorded it (CAN-46), or a change of its state.
struct CanFault {
  uint8_t type = 0, field = 0, bit = 0;  // NODE_CAN_ERROR_..., NODE_CAN_FIELD_...; type 0: none
  bool sender = false;
  uint8_t state = 0;  // NODE_CAN_STATE_...
  unsigned tec = 0, rec = 0;
};

// Something that has happened at a CAN port.
struct CanEvent {
  enum Kind { received, sent, failed, fault } kind;
  Time at;
  CanFrame frame;
  CanFault error;            // of a fault
  const void* by = nullptr;  // who had sent the frame
};

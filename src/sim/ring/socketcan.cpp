#include "ring/socketcan.h"

#include <algorithm>

#include "ring-node.h"

namespace socketcan {
namespace {
// Classes, in the identifier.
constexpr uint32_t kController = 0x04, kProtocol = 0x08, kAck = 0x20, kBusOff = 0x40, kBusError = 0x80,
                   kCounters = 0x200;
// Byte 1, of the controller; byte 2, of the protocol.
constexpr uint8_t kRxWarning = 0x04, kTxWarning = 0x08, kRxPassive = 0x10, kTxPassive = 0x20, kActive = 0x40;
constexpr uint8_t kBit = 0x01, kForm = 0x02, kStuff = 0x04, kBit0 = 0x08, kTx = 0x80;
constexpr uint8_t kCrcSequence = 0x08, kAckSlot = 0x19;
constexpr unsigned kWarningLimit = 96;

// Byte 3: where.
uint8_t location(const CanFault& f) {
  switch (f.field) {
    case NODE_CAN_FIELD_SOF: return 0x03;
    case NODE_CAN_FIELD_ID: return f.bit < 8 ? 0x02 : 0x06;  // ID28-21, ID20-18; of a base frame ID10-3, 2-0
    case NODE_CAN_FIELD_RTR_OR_SRR: return 0x04;
    case NODE_CAN_FIELD_IDE: return 0x05;
    case NODE_CAN_FIELD_ID_EXTENSION: return f.bit < 5 ? 0x07 : f.bit < 13 ? 0x0f : 0x0e;  // 17-13, 12-5, 4-0
    case NODE_CAN_FIELD_RTR: return 0x0c;
    case NODE_CAN_FIELD_FDF: return 0x0d;
    case NODE_CAN_FIELD_R0: return 0x09;
    case NODE_CAN_FIELD_DLC: return 0x0b;
    case NODE_CAN_FIELD_CRC: return kCrcSequence;
    case NODE_CAN_FIELD_CRC_DELIMITER: return 0x18;
    case NODE_CAN_FIELD_ACK_SLOT: return kAckSlot;
    case NODE_CAN_FIELD_ACK_DELIMITER: return 0x1b;
    case NODE_CAN_FIELD_EOF: return 0x1a;
    case NODE_CAN_FIELD_INTERMISSION: return 0x12;
    default: return f.field >= NODE_CAN_FIELD_DATA ? 0x0a : 0x00;
  }
}

Frame ofFault(const CanFault& f) {
  Frame e;
  e.length = 8;
  e.id = kError | kCounters;
  e.data[6] = static_cast<uint8_t>(std::min(f.tec, 255u));
  e.data[7] = static_cast<uint8_t>(std::min(f.rec, 255u));
  if (f.type == NODE_CAN_ERROR_NONE) {
    // The state has changed.
    if (f.state == NODE_CAN_STATE_BUS_OFF) {
      e.id |= kBusOff;
    } else {
      e.id |= kController;
      e.data[1] = f.state == NODE_CAN_STATE_PASSIVE
                      ? static_cast<uint8_t>((f.tec > 127 ? kTxPassive : 0) | (f.rec > 127 ? kRxPassive : 0))
                  : f.tec >= kWarningLimit ? kTxWarning
                  : f.rec >= kWarningLimit ? kRxWarning
                                           : kActive;
    }
    return e;
  }
  e.id |= kBusError;
  if (f.type == NODE_CAN_ERROR_ACK) {
    e.id |= kAck;
    e.data[3] = kAckSlot;
    return e;
  }
  e.id |= kProtocol;
  e.data[3] = f.type == NODE_CAN_ERROR_CRC ? kCrcSequence : location(f);
  // A bit error is told by the level that could not be sent: of a receiver it is a dominant one, its
  // acknowledgement or flag; so it is of a sender's flags, else the record does not tell.
  const bool flag = f.field == NODE_CAN_FIELD_ACTIVE_ERROR_FLAG || f.field == NODE_CAN_FIELD_OVERLOAD_FLAG;
  e.data[2] = f.type == NODE_CAN_ERROR_STUFF  ? kStuff
              : f.type == NODE_CAN_ERROR_FORM ? kForm
              : f.type == NODE_CAN_ERROR_BIT  ? (!f.sender || flag ? kBit0 : kBit)
                                              : 0;  // a CRC has no type of its own, but its location
  if (f.sender) e.data[2] |= kTx;
  return e;
}
}  // namespace

Frame of(const CanFrame& f) {
  Frame s;
  s.id = f.id | (f.extended ? kExtended : 0) | (f.remote ? kRemote : 0);
  s.length = static_cast<uint8_t>(std::min<unsigned>(f.dlc, 8));
  s.rawDlc = f.dlc > 8 ? f.dlc : 0;
  std::copy_n(f.data.begin(), f.bytes(), s.data.begin());
  return s;
}

std::optional<Frame> of(const CanEvent& e) {
  if (e.kind == CanEvent::fault) return ofFault(e.error);
  if (e.kind == CanEvent::failed) return std::nullopt;
  return of(e.frame);
}

std::optional<CanFrame> canFrame(uint32_t id, size_t length, const uint8_t* data) {
  CanFrame f;
  f.extended = id & kExtended;
  f.remote = id & kRemote;
  f.id = id & 0x1fffffff;
  if ((id & kError) || length > 8 || (!f.extended && f.id > 0x7ff)) return std::nullopt;
  f.dlc = static_cast<uint8_t>(length);
  if (!f.remote) std::copy_n(data, length, f.data.begin());
  return f;
}
}  // namespace socketcan

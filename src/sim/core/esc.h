// Registers, events and states of the controllers, as far as the simulator uses them. Numbers of datagrams
// and of the alarm system are in the generated header protocol.h.
#pragma once

#include <cstdint>

namespace esc {

// EtherTypes and the IP protocol number of UDP.
constexpr uint16_t kEtherCat = 0x88a4, kIpv4 = 0x0800;
constexpr uint8_t kUdp = 17;

// Registers of a slave controller.
namespace reg {
constexpr uint16_t kSyncManagersSupported = 0x0005, kStationAddress = 0x0010, kStationAlias = 0x0012,
                   kAlControl = 0x0120, kAlStatus = 0x0130, kAlStatusCode = 0x0134, kEcatEventMask = 0x0200,
                   kAlEventMask = 0x0204, kAlEvents = 0x0220, kWatchdogStatus = 0x0440, kFmmus = 0x0600,
                   kSyncManagers = 0x0800, kRam = 0x1000;
constexpr uint16_t kFmmuBytes = 16, kSyncManagerBytes = 8;
}  // namespace reg

// Bits of the AL event request; that of SyncManager n is kSyncManagerEvent << n.
constexpr uint32_t kAlControlEvent = 1u << 0, kWatchdogEvent = 1u << 6, kSyncManagerEvent = 1u << 8;

// States of a slave, and codes that tell why one was not entered or was left.
enum AlState : uint8_t { kInit = 1, kPreop = 2, kBoot = 3, kSafeop = 4, kOp = 8 };
constexpr uint8_t kAlStateMask = 0xf, kAlError = 0x10;
enum AlStatusCode : uint16_t {
  kInvalidChange = 0x0011,
  kUnknownState = 0x0012,
  kNoBootstrap = 0x0013,
  kWatchdogExpired = 0x001b,
  kNoValidOutputs = 0x001d,
  kNoValidInputs = 0x001e
};

// The comparators at the pin alarm_current: each bit is set above the current of a whole line, of an alarm,
// of a short circuit (DET-02).
enum Comparators : uint8_t { kNoCurrent = 0, kWholeLine = 1, kAlarmCurrent = 3, kShortCircuit = 7 };

}  // namespace esc

// Registers, events and states of the controllers, as far as the simulator uses them, by the names it uses:
// the numbers come from the generated headers.
#pragma once

#include <cstdint>

#include <slave.h>  // in `generated`: every preset has its registers where this one has them

#include "protocol.h"

namespace esc {

constexpr uint16_t kEtherCat = PROTOCOL_ETHERTYPE_ETHERCAT, kIpv4 = PROTOCOL_ETHERTYPE_IPV4;
constexpr uint8_t kUdp = 17;  // the IP protocol number

// Registers of a slave controller.
namespace reg {
constexpr uint16_t kSyncManagersSupported = ESC_SYNC_MANAGERS_SUPPORTED,
                   kStationAddress = ESC_STATION_ADDRESS, kStationAlias = ESC_STATION_ALIAS,
                   kAlControl = ESC_AL_CONTROL, kAlStatus = ESC_AL_STATUS, kAlStatusCode = ESC_AL_STATUS_CODE,
                   kEcatEventMask = ESC_ECAT_EVENT_MASK, kAlEventMask = ESC_AL_EVENT_MASK,
                   kAlEvents = ESC_AL_EVENT_REQUEST, kWatchdogStatus = ESC_WATCHDOG_STATUS_PROCESS_DATA,
                   kRxErrors = ESC_RX_ERROR_PORT0, kForwardedErrors = ESC_FORWARDED_ERROR_PORT0,
                   kLostLinks = ESC_LOST_LINK_PORT0, kWatchdogTime = ESC_WATCHDOG_TIME_PROCESS_DATA,
                   kFmmus = ESC_FMMUN_LOGICAL_START(0), kSyncManagers = ESC_SMN_START(0),
                   kRam = ESC_PROCESS_RAM;
constexpr uint16_t kFmmuBytes = ESC_FMMUN_LOGICAL_START(1) - kFmmus,
                   kSyncManagerBytes = ESC_SMN_START(1) - kSyncManagers;
}  // namespace reg

// Bits of the AL event request; that of SyncManager n is kSyncManagerEvent << n.
constexpr uint32_t kAlControlEvent = 1u << 0, kWatchdogEvent = 1u << 6, kSyncManagerEvent = 1u << 8;

// States of a slave, and codes that tell why one was not entered or was left.
enum AlState : uint8_t {
  kInit = PROTOCOL_AL_INIT,
  kPreop = PROTOCOL_AL_PREOP,
  kBoot = PROTOCOL_AL_BOOT,
  kSafeop = PROTOCOL_AL_SAFEOP,
  kOp = PROTOCOL_AL_OP
};
constexpr uint8_t kAlStateMask = 0xf, kAlError = PROTOCOL_AL_ERROR;
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

/* Codes that a slave tells its master: AL status codes (ETG.1020), SDO abort codes, errors of FoE and of the
 * mailbox (ETG.1000.6). */
#ifndef FLYFRAME_CODES_H
#define FLYFRAME_CODES_H

enum al_status_code {
  AL_CODE_NONE = 0x0000,
  AL_CODE_INVALID_CHANGE = 0x0011,
  AL_CODE_UNKNOWN_STATE = 0x0012,
  AL_CODE_NO_BOOTSTRAP = 0x0013,
  AL_CODE_BOOT_MAILBOX = 0x0015,
  AL_CODE_PREOP_MAILBOX = 0x0016,
  AL_CODE_NO_OUTPUTS = 0x0019,
  AL_CODE_SYNC_ERROR = 0x001a,
  AL_CODE_WATCHDOG = 0x001b,
  AL_CODE_OUTPUT_SETTINGS = 0x001d,
  AL_CODE_INPUT_SETTINGS = 0x001e,
  AL_CODE_WATCHDOG_SETTINGS = 0x001f,
  AL_CODE_INPUT_MAPPING = 0x0024,
  AL_CODE_OUTPUT_MAPPING = 0x0025,
  AL_CODE_INCONSISTENT = 0x0026,
  AL_CODE_NO_SYNC_MODE = 0x0028,
  AL_CODE_NO_SYNC = 0x002d,
  AL_CODE_SYNC_SETTINGS = 0x0030,
  AL_CODE_SYNC_CYCLE = 0x0036
};

#define SDO_TOGGLE 0x05030000u       /* toggle bit not alternated */
#define SDO_SPECIFIER 0x05040001u    /* unknown command, or none that fits now */
#define SDO_UNSUPPORTED 0x06010000u  /* unsupported access to an object */
#define SDO_WRITE_ONLY 0x06010001u   /* nobody may read it */
#define SDO_READ_ONLY 0x06010002u    /* nobody may write it */
#define SDO_COUNT_NOT_0 0x06010003u  /* subindex 0 must be 0 before this one is written */
#define SDO_MAPPED 0x06010006u       /* mapped into an RxPDO that is in use */
#define SDO_NO_OBJECT 0x06020000u    /* the object does not exist */
#define SDO_NOT_MAPPABLE 0x06040041u /* cannot be mapped into this PDO, or assigned */
#define SDO_TOO_MUCH 0x06040042u     /* more than the SyncManager's buffer holds */
#define SDO_INCOMPATIBLE 0x06040043u /* the same twice */
#define SDO_LENGTH 0x06070010u       /* the length is not that of the message */
#define SDO_TOO_LONG 0x06070012u
#define SDO_TOO_SHORT 0x06070013u
#define SDO_NO_SUBINDEX 0x06090011u /* the subindex does not exist */
#define SDO_RANGE 0x06090030u       /* no value that there is */
#define SDO_TOO_HIGH 0x06090031u
#define SDO_TOO_LOW 0x06090032u
#define SDO_STATE 0x08000022u /* not in the present state of the device */

#define FOE_NOT_FOUND 0x8001u
#define FOE_DENIED 0x8002u
#define FOE_ILLEGAL 0x8004u /* a message that does not fit now */
#define FOE_PACKET 0x8005u  /* wrong number of a packet */
#define FOE_BOOT_ONLY 0x8008u
#define FOE_NOT_IN_BOOT 0x8009u
#define FOE_PROGRAM 0x800bu /* the program has failed */

enum mailbox_error {
  MAILBOX_UNSUPPORTED = 2, /* a protocol that the device does not have, or not in this state */
  MAILBOX_CHANNEL = 3,     /* another channel than 0 */
  MAILBOX_SERVICE = 4,     /* a service that the protocol does not have */
  MAILBOX_TOO_SHORT = 6,   /* the message is too short for its protocol */
  MAILBOX_INVALID_SIZE = 8 /* the header counts more bytes than the mailbox has */
};

#endif

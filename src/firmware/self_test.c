#include "self_test.h"

static const char *const texts[SELF_TEST_CODES] = {
    "The self-test has not been run.",
    "The self-test is good.",
    "No controller answers, or another one than this program is for.",
    "A register or the RAM of the controller does not hold what was written.",
    "The non-volatile memory does not work.",
    "The source of random numbers does not work.",
    "The node ID is 0, 0xFFFF, or wider than the controller holds.",
    "The debounce time is above 655,350 us.",
    "The off time is 0.",
    "The master ID is 0.",
    "A MAC address is all zero or a group address.",
    "An IP address is none of a single station.",
    "A UDP port is 0.",
    "The bus cycle is not 10 to 41,943 us.",
    "The answer time-out is not 10 to 2,621 us.",
    "There are more than 15 retries.",
    "Repetition or heartbeat of reports is not 1 to 4,095 ms.",
    "The key is all zero.",
    "The heartbeat's promise is below 10 ms.",
    "The server's time-out is 0.",
    "There are too many places, a node ID among them is none, or stands twice.",
    "The display has not 2 to 4 lines of 20 to 40 columns.",
};

const char *self_test_text(enum self_test result) {
  return (unsigned)result < SELF_TEST_CODES ? texts[result] : "The self-test failed for an unknown reason.";
}

enum self_test worse(enum self_test first, enum self_test second) {
  return first == SELF_TEST_GOOD ? second : first;
}

bool is_zero(const uint8_t *bytes, uint16_t count) {
  uint8_t all = 0;
  for (uint16_t i = 0; i < count; ++i) all |= bytes[i];
  return all == 0;
}

#include "core/mute_host.h"

#include <alarm-slave.h>  // in `generated`

#include "core/user_error.h"

std::string MuteHost::command(const std::vector<std::string>&) {
  throw UserError("the host program 'mute' knows no commands.");
}

void MuteHost::run() {
  for (;; sleepNs(1e9)) write(ESC_ALARM_ENABLE, {0});
}

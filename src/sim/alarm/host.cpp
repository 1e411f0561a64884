#include "alarm/host.h"

#include "alarm-master.h"

// As alarm_master_run() does, but for the counters.
void AlarmMasterHost::run() {
  boot();
  if (alarm_master_start(&master_, &board_, &parameters_) != SELF_TEST_GOOD)
    board_notice(&board_, self_test_text(master_.self_test));
  for (;;) {
    alarm_master_serve(&master_);
    if (counters_) continue;
    Counters read;  // refused, dropped, bad frames of the line and of the plant network (HOST-07)
    readRegisters(MASTER_REFUSED_DATAGRAMS, read.data(), read.size());
    const uint8_t any = 0;
    writeRegisters(MASTER_REFUSED_DATAGRAMS, &any, 1);
    counters_ = read;
  }
}

std::vector<log_record> AlarmMasterHost::log(uint32_t count) {
  std::vector<log_record> records;
  for (uint32_t i = 0; i < count; ++i) {
    log_record r;
    if (event_log_read(&master_.log, i, &r)) records.push_back(r);
  }
  return records;
}

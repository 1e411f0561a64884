// The host programs of the alarm system, on the boards of a simulated line.
#pragma once

#include <optional>

#include "board/board.h"

extern "C" {
#include "alarm_master.h"
#include "alarm_slave.h"
}

class AlarmSlaveHost : public FirmwareHost {
 public:
  AlarmSlaveHost(BoardHardware& hardware, const alarm_slave_parameters& parameters)
      : FirmwareHost(hardware),
        parameters_(parameters) {}
  ~AlarmSlaveHost() override { stop(); }
  const alarm_slave& state() const { return slave_; }

 protected:
  void run() override {
    boot();
    alarm_slave_run(&slave_, &board_, &parameters_);
  }

 private:
  alarm_slave_parameters parameters_;
  alarm_slave slave_{};
};

class AlarmMasterHost : public FirmwareHost {
 public:
  AlarmMasterHost(BoardHardware& hardware, const alarm_master_parameters& parameters)
      : FirmwareHost(hardware),
        parameters_(parameters) {}
  ~AlarmMasterHost() override { stop(); }
  const alarm_master& state() const { return master_; }
  // The newest records of the log, the newest first.
  std::vector<log_record> log(uint32_t count);

  // The controller's error counters (HOST-07) are to be read and cleared between two orders; what they were,
  // once that is done.
  using Counters = std::array<uint8_t, 4>;
  void askCounters() { counters_.reset(); }
  const std::optional<Counters>& counters() const { return counters_; }

 protected:
  bool isWoken() override { return !counters_ || FirmwareHost::isWoken(); }
  void run() override;

 private:
  std::optional<Counters> counters_ = Counters{};
  alarm_master_parameters parameters_;
  alarm_master master_{};
};

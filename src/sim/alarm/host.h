// The host programs of src/firmware, as local processors of simulated slaves: the board they run on.
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>

#include "core/host.h"

extern "C" {
#include "alarm_master.h"
#include "alarm_slave.h"
}

class FirmwareHost;
struct board {
  FirmwareHost* host;
};

// A board with a host program in C. Its non-volatile memory is a file.
class FirmwareHost : public Host {
 public:
  // `name` is for messages, and that of the file.
  FirmwareHost(std::string name, const std::filesystem::path& folder)
      : name_(std::move(name)),
        store_(folder / name_) {}
  std::string command(const std::vector<std::string>& words) override;
  // Why the program gave up; empty if it did not.
  const std::string& failure() const { return failure_; }

  // What struct board stands for.
  void readRegisters(uint16_t address, uint8_t* data, uint16_t length);
  void writeRegisters(uint16_t address, const uint8_t* data, uint16_t length);
  bool load(uint32_t& number) const;
  bool store(uint32_t number) const;
  void waitForInterrupt(uint32_t us);
  [[noreturn]] void fail(const char* sentence);

 protected:
  // Waiting ends.
  virtual bool isWoken();
  board board_{this};

 private:
  std::string name_;
  std::filesystem::path store_;
  std::string failure_;
};

class AlarmSlaveHost : public FirmwareHost {
 public:
  AlarmSlaveHost(std::string name, const std::filesystem::path& folder,
                 const alarm_slave_parameters& parameters)
      : FirmwareHost(std::move(name), folder),
        parameters_(parameters) {}
  ~AlarmSlaveHost() override { stop(); }
  const alarm_slave& state() const { return slave_; }

 protected:
  void run() override { alarm_slave_run(&slave_, &board_, &parameters_); }

 private:
  alarm_slave_parameters parameters_;
  alarm_slave slave_{};
};

class AlarmMasterHost : public FirmwareHost {
 public:
  AlarmMasterHost(std::string name, const std::filesystem::path& folder,
                  const alarm_master_parameters& parameters)
      : FirmwareHost(std::move(name), folder),
        parameters_(parameters) {}
  ~AlarmMasterHost() override { stop(); }
  const alarm_master& state() const { return master_; }

  // The controller's error counters (HOST-07) are to be read and cleared between two commands; what they
  // were, once that is done.
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

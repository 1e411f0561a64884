// The alarm system as a whole: line, host programs, recordings. What the programs flyframe-alarm offers is
// built on it.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "alarm/host.h"
#include "alarm/line.h"
#include "core/pcap_io.h"

struct AlarmOptions {
  AlarmLineOptions line;
  alarm_master_parameters master{};
  alarm_slave_parameters slave{};   // of the first one; the others have the node IDs behind it
  std::filesystem::path state;      // folder of the non-volatile memories
  std::string linePcap, plantPcap;  // empty: not recorded
};

class AlarmNetwork {
 public:
  explicit AlarmNetwork(const AlarmOptions& options);

  AlarmLine& line() { return line_; }
  // The host program of the master; null while that has no power.
  AlarmMasterHost* masterHost() { return static_cast<AlarmMasterHost*>(line_.node(0).host()); }
  // Good frames of the master into the plant network.
  std::function<void(const NibbleFrame&, const Bytes&)> onFromMaster;
  // For the master.
  void toMaster(const Bytes& frame);

  // `smoke 4|all on|off`, `line 2|all open|short|whole`, `cut 3`, `mend 3`, `restart master|2
  // [MICROSECONDS]`, `status`, `time`.
  std::string command(const std::vector<std::string>& words);

 private:
  std::unique_ptr<Host> makeHost(size_t node);
  size_t slaveNumbered(const std::string& text) const;
  void change(const std::string& slaves, const std::function<void(SmokeDetector&)>& how);
  nlohmann::ordered_json status();
  nlohmann::ordered_json statusOf(size_t slave);

  AlarmOptions options_;
  std::unique_ptr<CaptureWriter> lineRecord_, plantRecord_;
  uint64_t fromMaster_ = 0, toMaster_ = 0;
  AlarmLine line_;
};

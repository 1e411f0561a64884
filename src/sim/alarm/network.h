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
  alarm_master_parameters master{};  // its places are made from the slaves
  bool listed = true;                // the master expects the slaves that there are
  alarm_slave_parameters slave{};    // of the first one; the others have the node IDs behind it
  std::filesystem::path state;       // folder of the non-volatile memories
  std::string linePcap, plantPcap;   // empty: not recorded
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

  // A line of the control socket: src/sim/README.md has them all.
  std::string command(const std::vector<std::string>& words);

 private:
  std::unique_ptr<Host> makeHost(size_t node);
  size_t slaveNumbered(const std::string& text) const;
  size_t nodeNamed(const std::string& text) const;  // master: 0
  bool commandOfLine(const std::vector<std::string>& words);
  bool commandOfNode(const std::vector<std::string>& words);
  bool commandOfPanel(const std::vector<std::string>& words);
  void host(size_t node, const std::vector<std::string>& how);
  void write(size_t node, const std::string& address, const std::string& value);
  void press(const std::string& button, int64_t ms);
  void noise(const std::string& cables, uint64_t bits);
  void change(const std::string& slaves, const std::function<void(SmokeDetector&)>& how);
  nlohmann::ordered_json status();
  nlohmann::ordered_json statusOf(size_t slave);
  nlohmann::ordered_json statusOfMaster();
  nlohmann::ordered_json statusOfBoard(size_t node);
  nlohmann::ordered_json log(uint32_t count);

  AlarmOptions options_;
  std::vector<std::string> labels_, zones_;  // of the places, which point at them
  std::vector<alarm_place> places_;
  std::vector<BoardHardware> boards_;  // by node
  std::vector<uint16_t> nodeIds_;      // by node; the host writes it when it starts
  std::unique_ptr<CaptureWriter> lineRecord_, plantRecord_;
  uint64_t fromMaster_ = 0, toMaster_ = 0;
  AlarmLine line_;
};

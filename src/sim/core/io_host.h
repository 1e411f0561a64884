// The host program "io": follows the master through the states (AL-01 to AL-06) and returns its outputs as
// inputs.
#pragma once

#include <map>
#include <optional>

#include "core/host.h"
#include "core/esc.h"

class IoHost : public Host {
 public:
  explicit IoHost(const HostOptions& options) : delayNs_(options.delayUs * 1000), replies_(options.replies) {}
  ~IoHost() override { stop(); }
  // refuse STATE CODE | accept STATE | fail CODE | stop | start | status; STATE is init, preop, boot, safeop
  // or op.
  std::string command(const std::vector<std::string>& words) override;

 protected:
  void run() override;

 private:
  enum State : uint8_t {
    init = esc::kInit,
    preop = esc::kPreop,
    boot = esc::kBoot,
    safeop = esc::kSafeop,
    op = esc::kOp
  };
  struct SyncManager {
    uint16_t start, length;
    uint8_t number, control;
  };

  static State stateNamed(const std::string& name);
  static const char* nameOf(uint8_t state);

  void control(uint16_t request);
  void delay();
  void answerMailbox();
  uint16_t refusal(State wanted);
  void setStatus(State state, uint16_t code);
  void setEventMask();
  std::optional<SyncManager> findSyncManager(bool masterWrites);
  void writeInputs();
  void readOutputs();

  double delayNs_;
  std::vector<Bytes> replies_;
  size_t replied_ = 0;

  // What the bench has asked for.
  std::map<State, uint16_t> refused_;
  std::optional<uint16_t> failure_;
  bool stopped_ = false;

  State state_ = init;
  bool error_ = false, watchdogRan_ = false;
  uint16_t code_ = 0;
  std::optional<SyncManager> outputs_, inputs_;
  Bytes outputData_;
};

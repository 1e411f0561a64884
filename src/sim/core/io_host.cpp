#include "core/io_host.h"

#include <algorithm>
#include <cstdio>

#include "core/esc.h"
#include "core/slave.h"
#include "core/user_error.h"

namespace {
using namespace esc;
using namespace esc::reg;

constexpr double kReactionNs = 200;  // from the interrupt to the first access
constexpr double kPollNs = 2000;     // without an interrupt pin, and for what raises none

uint32_t little(const Bytes& b) {
  uint32_t v = 0;
  for (size_t i = b.size(); i-- > 0;) v = v << 8 | b[i];
  return v;
}
}  // namespace

const char* IoHost::nameOf(uint8_t state) {
  return state == init     ? "init"
         : state == preop  ? "preop"
         : state == boot   ? "boot"
         : state == safeop ? "safeop"
         : state == op     ? "op"
                           : "none";
}

IoHost::State IoHost::stateNamed(const std::string& name) {
  for (State s : {init, preop, boot, safeop, op})
    if (name == nameOf(s)) return s;
  throw UserError("no state is called '" + name + "'; known: init, preop, boot, safeop, op.");
}

std::string IoHost::command(const std::vector<std::string>& words) {
  const std::string verb = words.empty() ? "" : words[0];
  auto code = [&](const std::string& text) {
    size_t used = 0;
    unsigned long v = 0;
    try {
      v = std::stoul(text, &used, 0);
    } catch (const std::exception&) {
    }
    if (used != text.size() || text.empty() || v > 0xffff)
      throw UserError("'" + text + "' is no AL status code.");
    return static_cast<uint16_t>(v);
  };
  if (verb == "refuse" && words.size() == 3) {
    const State s = stateNamed(words[1]);
    refused_[s] = code(words[2]);
  } else if (verb == "accept" && words.size() == 2) {
    refused_.erase(stateNamed(words[1]));
  } else if (verb == "fail" && words.size() == 2) {
    failure_ = code(words[1]);
  } else if (verb == "stop" && words.size() == 1) {
    stopped_ = true;
  } else if (verb == "start" && words.size() == 1) {
    stopped_ = false;
  } else if (verb == "status" && words.size() == 1) {
    char text[80];
    std::snprintf(text, sizeof text, "state %s error %d code 0x%04x outputs ", nameOf(state_), error_, code_);
    return text + (outputData_.empty() ? "none" : hex(outputData_));
  } else {
    throw UserError(
        "the host program 'io' knows: refuse STATE CODE, accept STATE, fail CODE, stop, start, status.");
  }
  return "";
}

void IoHost::run() {
  setEventMask();
  uint64_t polledAt = 0;
  const auto pollCycles = static_cast<uint64_t>(kPollNs * kNs / slave().corePeriod());
  while (true) {
    sleepNs(kReactionNs);
    if (stopped_ || (!slave().irq() && slave().cycles() < polledAt + pollCycles)) continue;
    polledAt = slave().cycles();
    const uint32_t events = little(read(kAlEvents, 4));
    if (events & kAlControlEvent) delay(), control(read16(kAlControl));
    if (events & kSyncManagerEvent && replied_ < replies_.size()) answerMailbox();
    if (failure_) {
      setStatus(std::min(state_, safeop), *failure_);
      failure_.reset();
    }
    if (outputs_ && state_ >= safeop &&
        (events & kSyncManagerEvent << outputs_->number || !(outputs_->control & 0x20))) {
      readOutputs();
      if (state_ == op) writeInputs();
    }
    const bool watched = state_ == op && outputs_ && outputs_->control & 0x40;
    if (!watched && !(events & kWatchdogEvent)) continue;
    const bool running = read8(kWatchdogStatus) & 1;
    if (watched && watchdogRan_ && !running) setStatus(safeop, kWatchdogExpired);
    watchdogRan_ = running;
  }
}

void IoHost::delay() {
  if (delayNs_ > 0) delayNs(delayNs_);
}

// SyncManager 0 holds a message of the master; the answer goes into SyncManager 1.
void IoHost::answerMailbox() {
  auto word = [&](uint16_t address) { return read16(address); };
  read(word(kSyncManagers), word(kSyncManagers + 2));
  delay();
  Bytes reply = replies_[replied_++];
  reply.resize(word(kSyncManagers + 10));
  write(word(kSyncManagers + 8), reply);
}

// What the master wrote to AL control.
void IoHost::control(uint16_t request) {
  const auto wanted = static_cast<State>(request & kAlStateMask);
  const bool acknowledge = request & kAlError;
  // With an error shown, only an acknowledge or a way back is followed.
  if (error_ && !acknowledge && wanted >= state_) return;
  const uint16_t code = wanted == state_ ? 0 : refusal(wanted);
  if (code) return setStatus(state_, code);
  if (wanted == safeop && state_ == preop) setEventMask(), writeInputs();
  if (wanted < safeop) outputs_.reset(), inputs_.reset(), setEventMask();
  if (wanted == op) {
    watchdogRan_ = false;
    readOutputs();
    writeInputs();
  }
  setStatus(wanted, 0);
}

// Why a state cannot be entered, as an AL status code; 0 if it can.
uint16_t IoHost::refusal(State wanted) {
  if (wanted != init && wanted != preop && wanted != boot && wanted != safeop && wanted != op)
    return kUnknownState;
  const auto refused = refused_.find(wanted);
  if (refused != refused_.end()) return refused->second;
  if (wanted == boot) return kNoBootstrap;
  if (wanted < state_) return 0;
  if (wanted == op && state_ != safeop) return kInvalidChange;
  if (wanted == safeop && state_ != preop) return kInvalidChange;
  if (wanted != safeop) return 0;
  outputs_ = findSyncManager(true), inputs_ = findSyncManager(false);
  outputData_.clear();
  if (!outputs_ && !inputs_) return kNoValidOutputs;
  return inputs_ ? 0 : kNoValidInputs;
}

void IoHost::setStatus(State state, uint16_t code) {
  state_ = state, code_ = code, error_ = code != 0;
  write16(kAlStatusCode, code);
  write16(kAlStatus, static_cast<uint16_t>(state | (error_ ? kAlError : 0)));
}

void IoHost::setEventMask() {
  const uint32_t mask =
      kAlControlEvent | kWatchdogEvent | (outputs_ ? kSyncManagerEvent << outputs_->number : 0);
  write(kAlEventMask,
        {static_cast<uint8_t>(mask), static_cast<uint8_t>(mask >> 8), static_cast<uint8_t>(mask >> 16), 0});
}

// The first active SyncManager for process data (three buffers) of one direction.
std::optional<IoHost::SyncManager> IoHost::findSyncManager(bool masterWrites) {
  const int count = std::min<int>(read8(kSyncManagersSupported), 16);
  for (int n = 0; n < count; ++n) {
    const Bytes r = read(static_cast<uint16_t>(kSyncManagers + kSyncManagerBytes * n), 7);
    const uint16_t length = static_cast<uint16_t>(r[2] | r[3] << 8);
    const bool buffered = (r[4] & 3) == 0, written = (r[4] >> 2 & 3) == 1;
    if (!(r[6] & 1) || length == 0 || !buffered || written != masterWrites) continue;
    return SyncManager{static_cast<uint16_t>(r[0] | r[1] << 8), length, static_cast<uint8_t>(n), r[4]};
  }
  return std::nullopt;
}

void IoHost::readOutputs() {
  if (outputs_) outputData_ = read(outputs_->start, outputs_->length);
}

// The inputs are the outputs, cut off or continued with 0; before the master has written any they are 0.
void IoHost::writeInputs() {
  if (!inputs_) return;
  Bytes data = outputData_;
  data.resize(inputs_->length);
  write(inputs_->start, data);
}

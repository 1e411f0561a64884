#include "core/host.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "core/io_host.h"
#include "core/mute_host.h"
#include "core/slave.h"
#include "core/user_error.h"

namespace {
constexpr size_t kStack = 256 * 1024;
// A program does within this time what it does behind a delay.
constexpr Time kReaction = 100 * kUs;
}

Host::Host() : stack_(new char[kStack]) {}
Host::~Host() = default;

void Host::entry(unsigned high, unsigned low) {
  Host* self = reinterpret_cast<Host*>(static_cast<uintptr_t>(high) << 32 | low);
  try {
    self->run();
  } catch (const Stopped&) {
  } catch (...) {
    self->error_ = std::current_exception();
  }
  self->ended_ = true;
  self->wakeAt_ = UINT64_MAX;
  // uc_link leads back into resume().
}

void Host::resume() {
  if (ended_) return;
  if (!started_) {
    started_ = true;
    getcontext(&program_);
    program_.uc_stack.ss_sp = stack_.get(), program_.uc_stack.ss_size = kStack;
    program_.uc_link = &simulation_;
    const auto self = reinterpret_cast<uintptr_t>(this);
    makecontext(&program_, reinterpret_cast<void (*)()>(entry), 2, static_cast<unsigned>(self >> 32),
                static_cast<unsigned>(self));
  }
  swapcontext(&simulation_, &program_);
  if (error_) std::rethrow_exception(std::exchange(error_, nullptr));
}

void Host::suspend() {
  swapcontext(&program_, &simulation_);
  if (stopping_) throw Stopped{};
}

void Host::stop() {
  stopping_ = true;
  if (started_) resume();
}

void Host::sleepNs(double ns) {
  wakeAt_ = slave_->cycles() + std::max<uint64_t>(1, std::llround(ns * kNs / slave_->corePeriod()));
  suspend();
}

void Host::delayNs(double ns) {
  delays_ = true, credit_ = 0;
  sleepNs(ns);
  delays_ = false;
  reactsUntil_ = slave_->cycles() + kReaction / slave_->corePeriod();
}

Time Host::delayLeft() const {
  if (!delays_) return kNever;
  if (slave_->cycles() >= wakeAt_) return 0;
  return static_cast<Time>(wakeAt_ - slave_->cycles()) * slave_->corePeriod() - credit_;
}

void Host::skipped(Time t) {
  if (!delays_) return;
  credit_ += std::min(t, delayLeft());
  wakeAt_ -= credit_ / slave_->corePeriod();
  credit_ %= slave_->corePeriod();
}

bool Host::reacts() const { return slave_->hostBusy() || slave_->cycles() < reactsUntil_; }

uint32_t Host::access(uint16_t addr, bool write, uint32_t data, unsigned lanes) {
  slave_->hostAccess(addr, write, data, lanes);
  wakeAt_ = 0;  // when the port is free again
  suspend();
  return slave_->hostResult();
}

Bytes Host::read(uint16_t addr, size_t n) {
  Bytes data;
  const unsigned width = slave_->info().lanes();
  while (data.size() < n) {
    const unsigned at = addr + data.size(), first = at % width;
    const unsigned count = std::min<size_t>(width - first, n - data.size());
    const uint32_t word = access(at, false, 0, ((1u << count) - 1) << first);
    for (unsigned i = 0; i < count; ++i) data.push_back(static_cast<uint8_t>(word >> (8 * (first + i))));
  }
  return data;
}

void Host::write(uint16_t addr, const Bytes& data) {
  const unsigned width = slave_->info().lanes();
  for (size_t done = 0; done < data.size();) {
    const unsigned at = addr + done, first = at % width;
    const unsigned count = std::min<size_t>(width - first, data.size() - done);
    uint32_t word = 0;
    for (unsigned i = 0; i < count; ++i) word |= uint32_t{data[done + i]} << (8 * (first + i));
    access(at, true, word, ((1u << count) - 1) << first);
    done += count;
  }
}

uint16_t Host::read16(uint16_t addr) {
  const Bytes b = read(addr, 2);
  return static_cast<uint16_t>(b[0] | b[1] << 8);
}

namespace {
// Does nothing but show that it runs: the PDI watchdog does not expire.
class AliveHost : public Host {
 public:
  ~AliveHost() override { stop(); }
  std::string command(const std::vector<std::string>&) override {
    throw UserError("the host program 'alive' knows no commands.");
  }

 protected:
  void run() override {
    for (;; sleepNs(1e6)) read8(0x0000);
  }
};
}  // namespace

static std::map<std::string, HostMaker>& added() {
  static std::map<std::string, HostMaker> makers;
  return makers;
}
bool addHostProgram(const std::string& name, HostMaker maker) {
  added()[name] = std::move(maker);
  return true;
}

std::unique_ptr<Host> makeHost(const HostOptions& options) {
  if (options.program == "none") return nullptr;
  if (options.program == "io") return std::make_unique<IoHost>(options);
  if (options.program == "alive") return std::make_unique<AliveHost>();
  if (options.program == "mute") return std::make_unique<MuteHost>();
  if (added().count(options.program)) return added()[options.program](options);
  std::string known = "none, io, alive, mute";
  for (const auto& [name, maker] : added()) known += ", " + name;
  throw UserError("no host program is called '" + options.program + "'; known: " + known + ".");
}

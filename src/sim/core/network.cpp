#include "core/network.h"

#include <verilated_fst_c.h>

#include <algorithm>
#include <cstdio>
#include <fstream>
#include <random>

#include "core/esc.h"
#include "core/user_error.h"

namespace {
constexpr int kMinimumGap = 24;  // nibbles between two frames of the master

// A core that loads its EEPROM itself has done so when the EEPROM has been left alone for kEepromQuiet, or
// never does.
constexpr Time kEepromQuiet = 1000 * kUs, kEepromLimit = 50'000 * kUs;
// An EEPROM within a transfer, but for a very slow clock.
constexpr Time kEepromSettle = 100 * kUs;
// Time a host program gets to react before idle time is skipped.
constexpr double kHostSettleUs = 100;

void saveImage(const std::string& path, const Bytes& data) {
  std::ofstream file(path, std::ios::binary | std::ios::trunc);
  file.write(reinterpret_cast<const char*>(data.data()), static_cast<std::streamsize>(data.size()));
  if (!file.flush()) throw UserError("cannot save the EEPROM image '" + path + "'.");
}
}  // namespace

Network::Network(const std::vector<SlaveSpec>& specs, const NetworkOptions& options, OnFrame onFrame)
    : options_(options) {
  std::mt19937_64 random(options.seed);
  auto phase = [&] { return static_cast<Time>(random() % kNibble); };
  auto delay = [&](size_t i) { return static_cast<Time>(specs[i].cableNs * kNs); };
  for (size_t i = 0; i < specs.size(); ++i) {
    const Preset& preset = findPreset(specs[i].preset);
    if (preset.info.ports < 2 && i + 1 < specs.size())
      throw UserError("slave " + std::to_string(i) + " has one port (preset '" + specs[i].preset +
                      "') but is not the last.");
    slaves_.push_back(
        std::make_unique<Slave>(preset, context_, "slave" + std::to_string(i), specs[i].clockPpm, phase()));
    sim_.add(*slaves_.back());
    if (!slaves_[i]->takesEeprom()) continue;
    std::unique_ptr<Eeprom> eeprom;
    if (specs[i].eeprom) {
      eeprom = std::make_unique<Eeprom>(*specs[i].eepromChip, *specs[i].eeprom);
      if (!specs[i].eepromSave.empty())
        eeprom->onWritten = [path = specs[i].eepromSave](const Eeprom& e) { saveImage(path, e.contents()); };
    }
    slaves_[i]->setEeprom(std::move(eeprom));
  }
  Time longest = 0;
  for (size_t i = 0; i < specs.size(); ++i) {
    slaves_[i]->receiver(0).setDelay(delay(i));
    if (i > 0) {
      slaves_[i - 1]->connect(1, slaves_[i]->receiver(0));
      slaves_[i]->connect(0, slaves_[i - 1]->receiver(1));
      slaves_[i - 1]->receiver(1).setDelay(delay(i));
    }
    longest = std::max(longest, delay(i));
  }
  card_ = std::make_unique<FrameCollector>(
      [this, onFrame](NibbleFrame& f) {
        if (!cardCut_) onFrame(f.end / kNs + skippedNs_, f);
      },
      delay(0));
  slaves_[0]->connect(0, *card_);
  master_ = std::make_unique<Sender>(slaves_[0]->receiver(0), 0, phase());
  sim_.add(*master_);
  double settleUs = options.settleUs;
  for (const SlaveSpec& spec : specs)
    if (spec.host.program == "io") settleUs = std::max(settleUs, kHostSettleUs);
  settle_ = static_cast<Time>(settleUs * kUs) + longest;
  quietAfter_ = static_cast<Time>(options.settleUs * kUs) + longest;
  if (!options.traceFile.empty()) trace(options.traceFile);
  powerUp(specs);
}

Network::~Network() {
  if (trace_) trace_->close();
}

void Network::trace(const std::string& path) {
  context_.traceEverOn(true);
  context_.timeunit(-12);
  context_.timeprecision(-12);
  trace_ = std::make_unique<VerilatedFstC>();
  for (auto& s : slaves_) s->setEager(true), s->model().trace(*trace_);
  if (std::FILE* probe = std::fopen(path.c_str(), "wb")) std::fclose(probe);
  else throw UserError("cannot write the trace '" + path + "'.");
  trace_->open(path.c_str());
  // Slaves with different clocks have edges less than a picosecond apart, which a trace cannot tell.
  sim_.onTimeDone = [this](Time t) {
    const int64_t ps = t / 1000 + skippedNs_ * 1000;
    if (ps > tracedPs_) trace_->dump(static_cast<uint64_t>(tracedPs_ = ps));
  };
}

void Network::powerUp(const std::vector<SlaveSpec>& specs) {
  auto runNs = [&](Time ns) { sim_.runUntil(sim_.now() + ns * kNs); };
  for (auto& s : slaves_) s->setReset(true);
  runNs(2000);
  for (auto& s : slaves_) s->setReset(false);
  // Two ports that face each other come up together.
  for (size_t i = 0; i < slaves_.size(); ++i) {
    slaves_[i]->setLink(0, true);
    if (i + 1 < slaves_.size()) slaves_[i]->setLink(1, true);
  }
  runNs(2000);
  for (size_t i = 0; i < slaves_.size(); ++i) loadEeprom(i, specs[i]);
  runNs(40'000);  // 1000 cycles of the slowest core clock
  const Time limit = sim_.now() + kEepromLimit;
  auto loading = [&](const auto& s) {
    return s->eeprom() && sim_.now() - s->eeprom()->lastActive() < kEepromQuiet;
  };
  while (sim_.now() < limit && std::any_of(slaves_.begin(), slaves_.end(), loading)) idleUntil(ns() + 10'000);
  for (size_t i = 0; i < slaves_.size(); ++i) slaves_[i]->setHost(makeHost(specs[i].host));
}

// The configuration in the EEPROM: a core with EEPROM pins loads it itself, for others the simulator does it
// as the local host.
void Network::loadEeprom(size_t slave, const SlaveSpec& spec) {
  bool operational = true;
  if (spec.eeprom) {
    const std::string problem = eepromProblem(*spec.eeprom);
    const bool valid = problem.empty(), byCore = slaves_[slave]->takesEeprom();
    operational = valid || byCore;
    if (valid && !byCore)
      for (uint16_t k = 0; k < 2; ++k) hostWrite(slave, esc::reg::kStationAlias + k, (*spec.eeprom)[8 + k]);
    if (!valid)
      std::fprintf(stderr, "warning: the EEPROM image '%s' of slave %zu is not valid, %s: no process data.\n",
                   spec.eepromPath.c_str(), slave, problem.c_str());
  }
  slaves_[slave]->setPdiOperational(operational);
}

void Network::hostWrite(size_t slave, uint16_t addr, uint8_t value) {
  const Time limit = sim_.now() + 10'000 * slaves_[slave]->corePeriod();
  slaves_[slave]->hostWriteByte(addr, value);
  while (slaves_[slave]->hostBusy()) {
    if (sim_.now() > limit)
      throw std::runtime_error("slave " + std::to_string(slave) + " does not acknowledge a host write.");
    sim_.step();
  }
}

int64_t Network::send(const Bytes& frame) {
  const std::vector<uint8_t> nibbles = toNibbles(frame);
  for (uint8_t n : nibbles) master_->push({true, false, n});
  master_->pushIdle(kMinimumGap);
  return (master_->nextSlot() + static_cast<Time>(nibbles.size() - 1) * kNibble) / kNs + skippedNs_;
}

Time Network::quietFor() const {
  if (master_->backlog() > 0) return 0;
  Time last = master_->lastActive();
  for (auto& s : slaves_) last = std::max(last, s->lastActive());
  return sim_.now() - last;
}

bool Network::quiet() const { return quietFor() > quietAfter_; }

bool Network::idle() const {
  if (quietFor() <= settle_) return false;
  return std::none_of(slaves_.begin(), slaves_.end(), [&](auto& s) {
    return s->eeprom() && sim_.now() - s->eeprom()->lastActive() < kEepromSettle;
  });
}

void Network::idleUntil(int64_t ns) {
  const Time end = (ns - skippedNs_) * kNs;
  if (trace_) return sim_.runUntil(end);
  for (auto& s : slaves_) s->idleUntil(end);
  master_->skipTo(end);
  sim_.advance(end);
}

void Network::setCable(size_t slave, bool whole) {
  slaves_[slave]->receiver(0).setCut(!whole);
  slaves_[slave]->setLink(0, whole);
  if (slave > 0) {
    slaves_[slave - 1]->receiver(1).setCut(!whole);
    slaves_[slave - 1]->setLink(1, whole);
  } else {
    cardCut_ = !whole;
  }
}

void Network::step(int64_t wakeNs) {
  // Skipping shifts all clocks by the same time: the slaves stand still meanwhile, as if frozen.
  if (options_.skipIdle && wakeNs > ns() && idle()) skippedNs_ += wakeNs - ns();
  sim_.step();
}

uint64_t Network::coreCycles() const {
  uint64_t sum = 0;
  for (auto& s : slaves_) sum += s->cycles();
  return sum;
}

#include "core/network.h"

#include <verilated_fst_c.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <random>

#include "core/esc.h"
#include "core/user_error.h"

namespace {

// A core that loads its EEPROM itself has done so when the EEPROM has been left alone for kEepromQuiet, or
// never does.
constexpr Time kEepromQuiet = 1000 * kUs, kEepromLimit = 50'000 * kUs;
// An EEPROM within a transfer, but for a very slow clock.
constexpr Time kEepromSettle = 100 * kUs;
// Time a host program gets to react before idle time is skipped.
constexpr double kHostSettleUs = 100;
// How often a crystal's error follows its drift.
constexpr Time kDriftStep = 100 * kUs;

void saveImage(const std::string& path, const Bytes& data) {
  std::ofstream file(path, std::ios::binary | std::ios::trunc);
  file.write(reinterpret_cast<const char*>(data.data()), static_cast<std::streamsize>(data.size()));
  if (!file.flush()) throw UserError("cannot save the EEPROM image '" + path + "'.");
}
}  // namespace

Network::Network(const NetworkSpec& spec, const NetworkOptions& options, OnFrame onFrame)
    : options_(options) {
  std::mt19937_64 random(spec.seed);
  auto phase = [&] { return static_cast<Time>(random() % kNibble); };
  for (const SlaveSpec& slave : spec.slaves) addSlave(slave, phase());
  for (size_t i = 0; i < (spec.ring ? 2 : 1); ++i) {
    cards_.push_back(std::make_unique<Card>(spec.masterPpm, phase(), [this, onFrame, i](NibbleFrame& f) {
      onFrame(f.end / kNs + skippedNs_, f, i);
    }));
  }
  auto link = [&](const CableSpec& cable, Link::End near, Link::End far) {
    links_.push_back(std::make_unique<Link>(cable, near, far, random()));
  };
  Time longest = 0;
  double settleUs = options.settleUs;
  for (size_t i = 0; i < spec.slaves.size(); ++i) {
    const SlaveSpec& slave = spec.slaves[i];
    const Link::End master{nullptr, 0, cards_[0].get()};
    const Link::End before = i == 0 ? master : Link::End{slaves_[slave.behind].get(), slave.port};
    link(slave.cable, before, {slaves_[i].get(), 0});
    longest = std::max(longest, static_cast<Time>(slave.cable.ns * kNs));
    if (slave.host.program == "io") settleUs = std::max(settleUs, kHostSettleUs);
    if (slave.driftPpm > 0)
      drifts_.push_back({i, slave.clockPpm, slave.driftPpm, slave.driftSeconds,
                         std::uniform_real_distribution<double>(0, 2 * M_PI)(random)});
  }
  if (spec.ring) link(*spec.ring, {slaves_.back().get(), 1}, {nullptr, 0, cards_[1].get()});
  for (auto& card : cards_) sim_.add(card->sender());
  settle_ = static_cast<Time>(settleUs * kUs) + longest;
  quietAfter_ = static_cast<Time>(options.settleUs * kUs) + longest;
  if (!options.traceFile.empty()) trace(options.traceFile);
  powerUp(spec.slaves);
  for (size_t i = 0; i < links_.size(); ++i) {
    const CableSpec& cable = i < spec.slaves.size() ? spec.slaves[i].cable : *spec.ring;
    setDrops(i, cable.dropsPerSecond, cable.dropUs);
  }
}

void Network::setDrops(size_t link, double perSecond, double us) {
  links_[link]->setDrops(perSecond, us, sim_.now());
  change();
}

void Network::addSlave(const SlaveSpec& spec, Time phase) {
  slaves_.push_back(std::make_unique<Slave>(findPreset(spec.preset), context_,
                                            "slave" + std::to_string(slaves_.size()), spec.clockPpm, phase));
  Slave& slave = *slaves_.back();
  sim_.add(slave);
  if (spec.wired) slave.wireDigital();
  if (!slave.takesEeprom()) return;
  std::unique_ptr<Eeprom> eeprom;
  if (spec.eeprom) {
    eeprom = std::make_unique<Eeprom>(*spec.eepromChip, *spec.eeprom);
    if (!spec.eepromSave.empty())
      eeprom->onWritten = [path = spec.eepromSave](const Eeprom& e) { saveImage(path, e.contents()); };
  }
  slave.setEeprom(std::move(eeprom));
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
  for (auto& link : links_) link->setWhole(true);
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
    if (valid && !byCore && slaves_[slave]->info().hasHost)
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

int64_t Network::send(const Bytes& frame, size_t card) {
  Sender& sender = cards_[card]->sender();
  const std::vector<uint8_t> nibbles = toNibbles(frame);
  for (uint8_t n : nibbles) sender.push({true, false, n});
  sender.pushIdle(kMinimumGap);
  return (sender.nextSlot() + static_cast<Time>(nibbles.size() - 1) * kNibble) / kNs + skippedNs_;
}

Time Network::quietFor() const {
  Time last = 0;
  for (auto& card : cards_) {
    if (card->sender().backlog() > 0) return 0;
    last = std::max(last, card->sender().lastActive());
  }
  for (auto& s : slaves_) last = std::max(last, s->lastActive());
  return sim_.now() - last;
}

bool Network::quiet() const { return quietFor() > quietAfter_; }

bool Network::idle() const {
  if (quietFor() <= settle_) return false;
  return std::none_of(slaves_.begin(), slaves_.end(), [&](auto& s) {
    return (s->eeprom() && sim_.now() - s->eeprom()->lastActive() < kEepromSettle) ||
           (s->host() && s->host()->reacts());
  });
}

// Skipping shifts all clocks by the same time: the slaves stand still meanwhile, as if frozen. The delays of
// host programs go on.
void Network::skip(int64_t ns) {
  for (auto& s : slaves_)
    if (s->host()) ns = std::min<int64_t>(ns, s->host()->delayLeft() / kNs);
  for (auto& s : slaves_)
    if (s->host()) s->host()->skipped(ns * kNs);
  skippedNs_ += ns;
}

void Network::idleUntil(int64_t ns) {
  const Time end = (ns - skippedNs_) * kNs;
  while (sim_.now() < end) {
    const Time until = std::min(end, std::max(nextChange_, sim_.now() + 1));
    if (trace_) {
      sim_.runUntil(until);
    } else {
      for (auto& s : slaves_) s->idleUntil(until);
      for (auto& card : cards_) card->sender().skipTo(until);
      sim_.advance(until);
    }
    if (sim_.now() >= nextChange_) change();
  }
}

void Network::change() {
  const Time now = sim_.now();
  nextChange_ = drifts_.empty() ? kNever : now + kDriftStep;
  for (const Drift& d : drifts_) {
    const double turns = static_cast<double>(now) / (1e9 * kNs * d.seconds);
    slaves_[d.slave]->setPpm(d.mean + d.height * std::sin(2 * M_PI * turns + d.phase));
  }
  for (auto& link : links_) {
    link->change(now);
    nextChange_ = std::min(nextChange_, link->next());
  }
}

void Network::step(int64_t wakeNs) {
  if (options_.skipIdle && wakeNs > ns() && idle()) skip(wakeNs - ns());
  if (sim_.now() >= nextChange_) change();
  sim_.step();
}

uint64_t Network::coreCycles() const {
  uint64_t sum = 0;
  for (auto& s : slaves_) sum += s->cycles();
  return sum;
}

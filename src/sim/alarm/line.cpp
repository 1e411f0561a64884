#include "alarm/line.h"

#include <algorithm>

#include "core/user_error.h"

namespace {
constexpr Time kSettle = 4 * kUs;       // how long what was on a wire goes on in the cores
constexpr int kEventsPerAdvance = 400;  // while something is on a wire
constexpr Time kReset = 1 * kUs;
constexpr int kPlantPort = 1, kRingPort = 2;  // of the master
constexpr Time kOff = kNever - 1;             // when a node gets its power back: when it is told so
}  // namespace

Helper::~Helper() {
  {
    std::lock_guard lock(mutex_);
    ends_ = true;
  }
  wake_.notify_all();
  thread_.join();
}

void Helper::loop() {
  std::unique_lock lock(mutex_);
  while (true) {
    wake_.wait(lock, [this] { return work_ || ends_; });
    if (ends_) return;
    const auto* work = work_;
    lock.unlock();
    std::exception_ptr error;
    try {
      (*work)();
    } catch (...) {
      error = std::current_exception();
    }
    lock.lock();
    error_ = error;
    work_ = nullptr;
    wake_.notify_all();
  }
}

void Helper::both(const std::function<void()>& ours, const std::function<void()>& theirs) {
  {
    std::lock_guard lock(mutex_);
    work_ = &theirs;
  }
  wake_.notify_all();
  ours();
  std::unique_lock lock(mutex_);
  wake_.wait(lock, [this] { return !work_; });
  if (error_) std::rethrow_exception(std::exchange(error_, nullptr));
}

namespace {
// A master with a second port to the line is a preset of its own.
const Preset& masterPreset(bool ring) {
  const Preset& preset = findPreset(ring ? "alarm-master-ring" : "alarm-master");
  if (preset.info.ports != (ring ? 3 : 2))
    throw UserError("the preset '" + preset.info.name + "' has " + std::to_string(preset.info.ports - 1) +
                    " ports to the line, which is not what " + (ring ? "a ring" : "a line") + " needs.");
  return preset;
}
}  // namespace

AlarmLine::AlarmLine(const AlarmLineOptions& options, MakeHost makeHost) : makeHost_(std::move(makeHost)) {
  std::mt19937_64 random(options.seed);
  auto phase = [&] { return static_cast<Time>(random() % kNibble); };
  const Time delay = static_cast<Time>(options.cableNs * kNs);
  detectors_.resize(options.slaves + 1);
  chatter_.resize(options.slaves + 1);
  powerAt_.assign(options.slaves + 1, kNever);
  for (size_t i = 0; i <= options.slaves; ++i) {
    contexts_.push_back(std::make_unique<VerilatedContext>());
    const Preset& preset = i == 0 ? masterPreset(options.ring) : findPreset("alarm-slave");
    // Crystals differ: some ppm from node to node.
    nodes_.push_back(std::make_unique<Slave>(preset, *contexts_.back(),
                                             i == 0 ? "master" : "slave" + std::to_string(i),
                                             static_cast<double>(random() % 101) - 50, phase()));
    sim_.add(*nodes_.back());
  }
  // Port 0 of the master leads to the line, port 1 of a slave to the next one.
  for (size_t i = 1; i <= options.slaves; ++i) cables_.push_back({i - 1, i == 1 ? 0 : 1, i, 0});
  if (options.ring) cables_.push_back({options.slaves, 1, 0, kRingPort});
  for (const Cabling& cable : cables_) connect(cable, options, random);
  for (size_t i = 1; i <= options.slaves; ++i) {
    nodes_[i]->onAlarmSupply = [this, i](bool) { updateDetector(i); };
    updateDetector(i);
  }
  plantCollector_ = std::make_unique<FrameCollector>([this](NibbleFrame& f) {
    const Bytes bytes = goodFrame(f);
    if (onFromMaster && !bytes.empty()) onFromMaster(f, bytes);
  });
  nodes_[0]->connect(kPlantPort, *plantCollector_);
  nodes_[0]->receiver(kPlantPort).setDelay(delay);
  plantSender_ = std::make_unique<Sender>(nodes_[0]->receiver(kPlantPort), 0, phase());
  sim_.add(*plantSender_);
  nodes_[0]->setLink(kPlantPort, true);
  for (size_t i = 0; i <= options.slaves; ++i) restart(i, kReset / kNs);
}

// Both directions have their own noise; those of the master's ports are looked at.
void AlarmLine::connect(const Cabling& cable, const AlarmLineOptions& options, std::mt19937_64& random) {
  const auto end = [&](size_t from, int fromPort, size_t to, int toPort) {
    Slave &sender = *nodes_[from], &receiver = *nodes_[to];
    receiver.receiver(toPort).setDelay(static_cast<Time>(options.cableNs * kNs));
    noise_.push_back(std::make_unique<Noise>(receiver.receiver(toPort), options.bitErrors, random()));
    NibbleSink* sink = noise_.back().get();
    if (from == 0) {
      taps_.push_back(std::make_unique<Tap>(*sink, [this](NibbleFrame& f) {
        ++lineSent_;
        if (onLineOut) onLineOut(f, goodFrame(f));
      }));
      sink = taps_.back().get();
    } else if (to == 0) {
      taps_.push_back(std::make_unique<Tap>(*sink, [this](NibbleFrame& f) {
        const Bytes bytes = goodFrame(f);
        ++(bytes.empty() ? lineBad_ : lineBack_);
        if (onLineBack && !bytes.empty()) onLineBack(f, bytes);
      }));
      sink = taps_.back().get();
    }
    sender.connect(fromPort, *sink);
  };
  end(cable.near, cable.nearPort, cable.far, cable.farPort);
  end(cable.far, cable.farPort, cable.near, cable.nearPort);
}

void AlarmLine::updateDetector(size_t slave) {
  const bool supply = nodes_[slave]->alarmSupply();
  const unsigned right = detectors_[slave].comparators(supply);
  nodes_[slave]->setAlarmCurrent(supply && chatter_[slave].wrong ? chatter_[slave].comparators : right);
}

void AlarmLine::setChatter(size_t slave, double hz, unsigned comparators) {
  Chatter& c = chatter_[slave];
  c = {hz, 0, kNever, false, comparators};
  if (hz > 0) {
    c.half = std::max<Time>(kUs, static_cast<Time>(0.5e9 / hz) * kNs);
    c.next = sim_.now() + c.half;
    nextChatter_ = std::min(nextChatter_, c.next);
  }
  updateDetector(slave);
}

void AlarmLine::switchChatter() {
  if (sim_.now() < nextChatter_) return;
  nextChatter_ = kNever;
  for (size_t i = 1; i < nodes_.size(); ++i) {
    Chatter& c = chatter_[i];
    if (c.next <= sim_.now()) {
      c.wrong = !c.wrong;
      c.next += c.half;
      updateDetector(i);
    }
    nextChatter_ = std::min(nextChatter_, c.next);
  }
}

// Both ends of a cable have a link while it is whole and both nodes have power.
void AlarmLine::updateCables() {
  for (const Cabling& c : cables_) {
    const bool works = c.whole && powered(c.near) && powered(c.far);
    nodes_[c.far]->receiver(c.farPort).setCut(!works);
    nodes_[c.near]->receiver(c.nearPort).setCut(!works);
    nodes_[c.far]->setLink(c.farPort, works);
    nodes_[c.near]->setLink(c.nearPort, works);
  }
}

void AlarmLine::setCable(size_t number, bool whole) {
  cables_[number - 1].whole = whole;
  updateCables();
}

void AlarmLine::setNoise(size_t number, uint64_t bits) {
  noise_[2 * number - 2]->setBits(bits);
  noise_[2 * number - 1]->setBits(bits);
}

void AlarmLine::restart(size_t node, int64_t offNs) {
  nodes_[node]->setHost(nullptr);
  nodes_[node]->setReset(true);
  nodes_[node]->setPdiOperational(false);
  powerAt_[node] = sim_.now() + offNs * kNs;
  nextPower_ = std::min(nextPower_, powerAt_[node]);
  updateCables();
}

void AlarmLine::setPower(size_t node, bool on) {
  if (on == powered(node)) return;
  if (on) nextPower_ = powerAt_[node] = sim_.now();
  else restart(node, 0), powerAt_[node] = kOff;
}

void AlarmLine::setHost(size_t node, bool runs) {
  if (powered(node)) nodes_[node]->setHost(runs ? makeHost_(node) : nullptr);
}

bool AlarmLine::writeRegister(size_t node, uint16_t address, uint8_t value) {
  Slave& slave = *nodes_[node];
  if (!powered(node) || slave.host()) return false;
  while (slave.hostBusy()) advance();  // with the last access of that program
  slave.hostWriteByte(address, value);
  while (slave.hostBusy()) advance();
  return true;
}

void AlarmLine::switchPower() {
  if (sim_.now() < nextPower_) return;
  for (size_t i = 0; i < nodes_.size(); ++i)
    if (!powered(i) && powerAt_[i] <= sim_.now()) {
      powerAt_[i] = kNever;
      nodes_[i]->setReset(false);
      nodes_[i]->setPdiOperational(true);
      nodes_[i]->setHost(makeHost_(i));
    }
  nextPower_ = *std::min_element(powerAt_.begin(), powerAt_.end());
  updateCables();
}

void AlarmLine::sendToPlant(const Bytes& frame) {
  for (uint8_t n : toNibbles(frame)) plantSender_->push({true, false, n});
  plantSender_->pushIdle(kMinimumGap);
  if (onToMaster) onToMaster({sim_.now(), sim_.now(), {}}, frame);
}

bool AlarmLine::busy() const {
  if (plantSender_->backlog() > 0) return true;
  Time last = plantSender_->lastActive();
  for (auto& n : nodes_) last = std::max(last, n->lastActive());
  return sim_.now() - last < kSettle;
}

// Only the master begins a frame: it goes first, the slaves follow until then.
void AlarmLine::idle(Time end) {
  nodes_[0]->idleUntilSending(end);
  const Time until = std::min(end, nodes_[0]->lastActive() > sim_.now() ? nodes_[0]->lastActive() : end);
  auto some = [&](size_t first) {
    for (size_t i = first; i < nodes_.size(); i += 2) nodes_[i]->idleUntil(until);
  };
  helper_.both([&] { some(1); }, [&] { some(2); });
  plantSender_->skipTo(until);
  sim_.advance(until);
}

void AlarmLine::advance(int64_t limitNs) {
  switchPower();
  switchChatter();
  if (busy()) {
    for (int i = 0; i < kEventsPerAdvance; ++i) sim_.step();
  } else {
    const Time next = std::max(std::min(nextPower_, nextChatter_), sim_.now() + kNs);
    idle(std::min(sim_.now() + limitNs * kNs, next));
  }
}

uint64_t AlarmLine::bitsFlipped() const {
  uint64_t sum = 0;
  for (auto& n : noise_) sum += n->flipped();
  return sum;
}

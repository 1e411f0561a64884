#include "alarm/line.h"

#include <algorithm>

namespace {
constexpr int kMinimumGap = 24;         // nibbles between two frames
constexpr Time kSettle = 4 * kUs;       // how long what was on a wire goes on in the cores
constexpr int kEventsPerAdvance = 400;  // while something is on a wire
constexpr Time kReset = 1 * kUs;
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

AlarmLine::AlarmLine(const AlarmLineOptions& options, MakeHost makeHost) : makeHost_(std::move(makeHost)) {
  std::mt19937_64 random(options.seed);
  auto phase = [&] { return static_cast<Time>(random() % kNibble); };
  const Time delay = static_cast<Time>(options.cableNs * kNs);
  detectors_.resize(options.slaves + 1);
  whole_.assign(options.slaves + 1, true);
  powerAt_.assign(options.slaves + 1, kNever);
  for (size_t i = 0; i <= options.slaves; ++i) {
    contexts_.push_back(std::make_unique<VerilatedContext>());
    const Preset& preset = findPreset(i == 0 ? "alarm-master" : "alarm-slave");
    // Crystals differ: some ppm from node to node.
    nodes_.push_back(std::make_unique<Slave>(preset, *contexts_.back(),
                                             i == 0 ? "master" : "slave" + std::to_string(i),
                                             static_cast<double>(random() % 101) - 50, phase()));
    sim_.add(*nodes_.back());
  }
  for (size_t i = 1; i <= options.slaves; ++i) {
    // Port 0 of the master leads to the line, port 1 of a slave to the next one.
    Slave &near = *nodes_[i - 1], &far = *nodes_[i];
    const int nearPort = i == 1 ? 0 : 1;
    far.receiver(0).setDelay(delay);
    near.receiver(nearPort).setDelay(delay);
    noise_.push_back(std::make_unique<Noise>(far.receiver(0), options.bitErrors, random()));
    noise_.push_back(std::make_unique<Noise>(near.receiver(nearPort), options.bitErrors, random()));
    NibbleSink *down = noise_[noise_.size() - 2].get(), *up = noise_.back().get();
    if (i == 1) {
      taps_.push_back(std::make_unique<Tap>(*down, [this](NibbleFrame& f) {
        ++lineSent_;
        if (onLineOut) onLineOut(f, goodFrame(f));
      }));
      down = taps_.back().get();
      taps_.push_back(std::make_unique<Tap>(*up, [this](NibbleFrame& f) {
        const Bytes bytes = goodFrame(f);
        ++(bytes.empty() ? lineBad_ : lineBack_);
        if (onLineBack && !bytes.empty()) onLineBack(f, bytes);
      }));
      up = taps_.back().get();
    }
    near.connect(nearPort, *down);
    far.connect(0, *up);
    far.onAlarmSupply = [this, i](bool) { updateDetector(i); };
    updateDetector(i);
  }
  plantCollector_ = std::make_unique<FrameCollector>([this](NibbleFrame& f) {
    const Bytes bytes = goodFrame(f);
    if (onFromMaster && !bytes.empty()) onFromMaster(f, bytes);
  });
  nodes_[0]->connect(1, *plantCollector_);
  nodes_[0]->receiver(1).setDelay(delay);
  plantSender_ = std::make_unique<Sender>(nodes_[0]->receiver(1), 0, phase());
  sim_.add(*plantSender_);
  nodes_[0]->setLink(1, true);
  for (size_t i = 0; i <= options.slaves; ++i) restart(i, kReset / kNs);
}

void AlarmLine::updateDetector(size_t slave) {
  nodes_[slave]->setAlarmCurrent(detectors_[slave].comparators(nodes_[slave]->alarmSupply()));
}

// Both ends of a cable have a link while it is whole and both nodes have power.
void AlarmLine::updateCables() {
  for (size_t i = 1; i < nodes_.size(); ++i) {
    const bool works = whole_[i] && powered(i) && powered(i - 1);
    const int nearPort = i == 1 ? 0 : 1;
    nodes_[i]->receiver(0).setCut(!works);
    nodes_[i - 1]->receiver(nearPort).setCut(!works);
    nodes_[i]->setLink(0, works);
    nodes_[i - 1]->setLink(nearPort, works);
  }
}

void AlarmLine::setCable(size_t slave, bool whole) {
  whole_[slave] = whole;
  updateCables();
}

void AlarmLine::restart(size_t node, int64_t offNs) {
  nodes_[node]->setHost(nullptr);
  nodes_[node]->setReset(true);
  nodes_[node]->setPdiOperational(false);
  powerAt_[node] = sim_.now() + offNs * kNs;
  nextPower_ = std::min(nextPower_, powerAt_[node]);
  updateCables();
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
  if (busy()) {
    for (int i = 0; i < kEventsPerAdvance; ++i) sim_.step();
  } else {
    idle(std::min(sim_.now() + limitNs * kNs, std::max(nextPower_, sim_.now() + kNs)));
  }
}

uint64_t AlarmLine::bitsFlipped() const {
  uint64_t sum = 0;
  for (auto& n : noise_) sum += n->flipped();
  return sum;
}

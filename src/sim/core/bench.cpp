#include "core/bench.h"

#include <algorithm>

Bench::Bench(const Preset& preset, uint64_t seed, OnFrame onFrame) {
  std::mt19937_64 random(seed);
  auto phase = [&] { return static_cast<Time>(random() % kNibble); };
  slave_ = std::make_unique<Slave>(preset, context_, "slave", 0, phase());
  sim_.add(*slave_);
  for (int y = 0; y < ports(); ++y) {
    senders_.push_back(std::make_unique<Sender>(slave_->receiver(y), 0, phase()));
    collectors_.push_back(std::make_unique<FrameCollector>([onFrame, y](NibbleFrame& f) { onFrame(y, f); }));
    slave_->connect(y, *collectors_.back());
    sim_.add(*senders_.back());
  }
  slave_->setReset(true);
  runCycles(32);
  slave_->setReset(false);
  slave_->setPdiOperational(true);
  for (int y = 0; y < ports(); ++y) slave_->setLink(y, true);
  runCycles(1000);
}

bool Bench::allFed() const {
  return std::all_of(senders_.begin(), senders_.end(), [](auto& s) { return s->backlog() == 0; });
}

bool Bench::quiet() const {
  return allFed() &&
         std::none_of(collectors_.begin(), collectors_.end(), [](auto& c) { return c->inFrame(); });
}

Time Bench::lastFed() const {
  Time t = 0;
  for (auto& s : senders_) t = std::max(t, s->lastActive());
  return t;
}

Time Bench::lastActive() const { return std::max(lastFed(), slave_->lastActive()); }

bool Bench::finishHost() {
  const Time limit = sim_.now() + kHangCycles * slave_->corePeriod();
  while (slave_->hostBusy()) {
    if (sim_.now() > limit) return false;
    sim_.step();
  }
  return true;
}

bool Bench::writeByte(uint16_t addr, uint8_t value) {
  slave_->hostWriteByte(addr, value);
  return finishHost();
}

bool Bench::readBytes(uint16_t addr, int count, uint32_t& word) {
  slave_->hostReadBytes(addr, count);
  const bool done = finishHost();
  word = slave_->hostResult();
  return done;
}

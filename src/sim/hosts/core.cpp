#include "hosts/core.h"

namespace hosts {

Core::Core(const Preset& preset)
    : preset_(preset),
      model_(preset.make(context_, "core")),
      pins_(model_->pins),
      period_(1000000 / preset.info.coreClockMhz),
      next_(period_) {
  *pins_.ports[0].link = 1;
  if (pins_.pdiOperational) *pins_.pdiOperational = 1;
}

WidePin& Core::pin(const std::string& name) {
  const auto found = pins_.host.find(name);
  if (found == pins_.host.end()) throw Wrong("the core has no pin " + name);
  return found->second;
}

void Core::toEdge() {
  if (!low_) {
    *pins_.clock = 0;
    receive();
    low_ = true;
  }
  model_->eval();
  now_ = next_;
}

void Core::edge() {
  *pins_.clock = 1;
  model_->eval();
  low_ = false;
  next_ += period_;
  ++cycles_;
  transmit();
  if (atCycle) atCycle();
}

void Core::wait(Time time) {
  const Time until = now_ + time;
  model_->eval();
  while (next_ <= until) {
    toEdge();
    edge();
  }
  now_ = until;
}

void Core::cycle(int count) {
  for (int i = 0; i < count; ++i) {
    toEdge();
    edge();
  }
}

void Core::send(std::vector<uint8_t> nibbles) {
  symbols_ = std::move(nibbles);
  received_.clear();
  at_ = 0;
  sfd_ = ended_ = false;
}

// The receive clock rises half a nibble after the data have changed, never together with the core clock.
void Core::receive() {
  const PortPins& p = pins_.ports[0];
  if (phase_ == 0) {
    const bool valid = at_ < symbols_.size();
    *p.rxClk = 0, *p.rxDv = valid, *p.rxEr = 0, *p.rxd = valid ? symbols_[at_] : 0;
    if (valid) ++at_;
  } else if (phase_ == info().cyclesPerNibble / 2) {
    *p.rxClk = 1;
  }
  phase_ = phase_ + 1 == info().cyclesPerNibble ? 0 : phase_ + 1;
}

void Core::transmit() {
  if (!*pins_.txTick) return;
  const uint8_t nibble = *pins_.ports[0].txd;
  if (!*pins_.ports[0].txEn) ended_ |= sfd_;
  else if (sfd_) received_.push_back(nibble);
  else sfd_ = nibble == 0xd;
}

}  // namespace hosts

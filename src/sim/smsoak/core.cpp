#include "smsoak/core.h"

namespace smsoak {

Core::Core(const Preset& preset)
    : preset_(preset),
      model_(preset.make(context_, "core")),
      pins_(model_->pins),
      perNibble_(preset.info.cyclesPerNibble) {
  *pins_.reset = 1;
  *pins_.ports[0].link = 1;
  if (pins_.pdiOperational) *pins_.pdiOperational = 1;
  for (int i = 0; i < 20; ++i) cycle();
  *pins_.reset = 0;
  // The core clears its register RAM, then takes the link.
  for (int i = 0; i < 2000; ++i) cycle();
}

void Core::send(std::vector<Nibble> symbols) {
  symbols_ = std::move(symbols);
  at_ = 0;
  returned_ = Returned();
}

void Core::access(bool write, unsigned address, uint32_t data, unsigned be) {
  *pins_.hostAddr = static_cast<uint16_t>(address & ~(lanes() - 1u));
  pins_.hostWdata.set(data);
  *pins_.hostBe = static_cast<CData>(be);
  *pins_.hostWrite = write;
  *pins_.hostReq = 1;
  state_ = Port::requested;
}

// The receive clock rises half a nibble after the data have changed, never together with the core clock.
void Core::receive() {
  const PortPins& p = pins_.ports[0];
  if (phase_ == 0 && slip_ > 0) {
    --slip_;
    return;
  }
  if (phase_ == 0) {
    const bool valid = at_ < symbols_.size();
    *p.rxClk = 0, *p.rxDv = valid, *p.rxEr = valid && symbols_[at_].error,
    *p.rxd = valid ? symbols_[at_].data : 0;
    if (valid) ++at_;
  } else if (phase_ == perNibble_ / 2) {
    *p.rxClk = 1;
  }
  phase_ = phase_ + 1 == perNibble_ ? 0 : phase_ + 1;
}

void Core::transmit() {
  if (!*pins_.txTick) return;
  if (!*pins_.ports[0].txEn) {
    returned_.ended |= returned_.sfd;
  } else if (returned_.sfd) {
    returned_.nibbles.push_back(*pins_.ports[0].txd);
    returned_.times.push_back(now_);
  } else {
    returned_.sfd = *pins_.ports[0].txd == 0xd;
  }
}

void Core::cycle() {
  *pins_.clock = 0;
  receive();
  model_->eval();
  // The host samples at the edge what is there before it, and changes its pins after it.
  const bool acknowledged = state_ == Port::requested && *pins_.hostAck;
  if (acknowledged) data_ = pins_.hostRdata.get();
  *pins_.clock = 1;
  model_->eval();
  ++now_;
  done_ = acknowledged;
  if (acknowledged) *pins_.hostReq = 0;
  if (acknowledged) state_ = Port::recover;
  else if (state_ == Port::recover) state_ = Port::idle;
  transmit();
}

}  // namespace smsoak

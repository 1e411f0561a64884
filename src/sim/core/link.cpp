#include "core/link.h"

Link::Link(const CableSpec& spec, End near, End far, uint64_t seed) : near_(near), far_(far), random_(seed) {
  there_ = connect(spec, near, far);
  back_ = connect(spec, far, near);
}

std::unique_ptr<Noise> Link::connect(const CableSpec& spec, End from, End to) {
  const Time delay = static_cast<Time>(spec.ns * kNs);
  if (to.slave) to.slave->receiver(to.port).setDelay(delay);
  NibbleSink& sink = to.slave ? to.slave->receiver(to.port) : to.card->receiver();
  auto noise = std::make_unique<Noise>(sink, spec.bitErrors, random_());
  if (from.slave) from.slave->connect(from.port, *noise);
  else from.card->connect(*noise, delay);
  return noise;
}

void Link::setWhole(bool whole) {
  whole_ = whole;
  update();
}

void Link::setBitErrors(uint64_t bits) {
  there_->setBits(bits);
  back_->setBits(bits);
}

void Link::update() {
  const bool up = whole_ && !dropped_;
  for (const End& end : {near_, far_}) {
    if (end.card) end.card->setLink(up);
    else end.slave->receiver(end.port).setCut(!up), end.slave->setLink(end.port, up);
  }
}

Time Link::after(double meanUs) {
  return kUs + static_cast<Time>(std::exponential_distribution<double>(1 / meanUs)(random_) * kUs);
}

void Link::setDrops(double perSecond, double us, Time now) {
  dropEveryUs_ = perSecond > 0 ? 1e6 / perSecond : 0;
  dropUs_ = us;
  if (dropped_) dropped_ = false, update();
  next_ = perSecond > 0 ? now + after(dropEveryUs_) : kNever;
}

void Link::change(Time now) {
  if (now < next_) return;
  dropped_ = !dropped_;
  drops_ += dropped_;
  update();
  next_ = now + after(dropped_ ? dropUs_ : dropEveryUs_);
}

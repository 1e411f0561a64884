#include "ring/fibre.h"

#include <algorithm>
#include <cmath>

namespace {
constexpr Time kDominant = 40 * kNs, kRecessive = 1000 * kNs;  // periods of the tones
constexpr Time kSlow = 100 * kNs;                              // longer ones are no dominant tone (FR-04)
constexpr Time kShortest = 5 * kNs;                            // what a module passes
constexpr Time kExtra = 10 * kNs;                              // that of samples: no node misses it
constexpr Time kDark = 2500 * kNs;                             // without an edge it is no light (FR-10)
constexpr double kQ = 7.03;                                    // of a receiver with one error in 10^12
constexpr double kDarkDb = 20;                                 // beyond what it needs
}  // namespace

Fibre::Fibre(double km, Time bit, uint64_t seed)
    : delay_(static_cast<Time>((kModulesNs + km * kNsPerKm) * static_cast<double>(kNs))),
      bit_(bit),
      random_(seed) {}

void Fibre::changed() {
  // Half of the light, 3 dB, is half of the current, and half of the distance from the noise. A hundredth is
  // no light any more.
  const double q = kQ * std::pow(10, -optics_.attenuationDb / 10);
  weak_ = optics_.attenuationDb >= kDarkDb ? 1
          : optics_.attenuationDb > 0      ? std::erfc(q / std::sqrt(2)) / 2
                                           : 0;
  errorAt_ = kNever;
  if (optics_.bitErrors > 0) planError(delivered_);
}

void Fibre::planError(Time from) {
  const double mean = static_cast<double>(optics_.bitErrors) * static_cast<double>(bit_);
  const double until = std::exponential_distribution<double>(1 / mean)(random_);
  errorAt_ = until < static_cast<double>(kNever - from) ? from + static_cast<Time>(until) : kNever;
}

void Fibre::emit(Time at, bool level) {
  if (level == level_) return;
  // Jitter and duty cycle never change the order of edges.
  at = std::max(at, lastAt_ + 1);
  level_ = level;
  lastAt_ = at;
  to_->push_back({at + delay_, level});
}

// One bit is the other one: it has the tone of the other level. Without any tone it would be no signal.
void Fibre::spoil(Time from) {
  ++bitsWrong_;
  errorEnd_ = from + bit_;
  const Time half = (distance_ > kSlow ? kDominant : kRecessive) / 2;
  for (Time t = from; t + half <= errorEnd_; t += half) emit(t, !level_);
}

// Without light there are no bits that could be wrong.
void Fibre::errorsUntil(Time now) {
  while (errorAt_ < now) {
    const Time at = errorAt_;
    const bool isLit = state_.passes() && at < litUntil_;
    if (isLit) spoil(at);
    planError(isLit ? at + bit_ : now);
  }
}

void Fibre::take(LightEdge edge) {
  if (edge.level) {
    distance_ = edge.at - rose_;
    rose_ = edge.at;
    skip_ = chance(weak_) || (optics_.missing > 0 && chance(1.0 / static_cast<double>(optics_.missing)));
    if (skip_) ++pulsesLost_;
  }
  if (edge.at < errorEnd_ || skip_) {
    if (!edge.level) skip_ = false;
    return;
  }
  litUntil_ = edge.at + kDark;
  Time at = edge.at;
  if (optics_.jitterNs > 0) {
    const double width = optics_.jitterNs * static_cast<double>(kNs);
    at += static_cast<Time>(std::uniform_real_distribution<double>(-width, width)(random_));
  }
  if (optics_.dutyPercent != 50 && !edge.level) {
    at += static_cast<Time>((optics_.dutyPercent - 50) / 100 * static_cast<double>(kDominant));
  }
  emit(at, edge.level);
  if (!edge.level && optics_.extra > 0 && chance(1.0 / static_cast<double>(optics_.extra))) {
    emit(at + kShortest, true);
    emit(at + kShortest + kExtra, false);
  }
}

// What a module sends that no longer obeys its node.
void Fibre::takeStuck(Time now) {
  stuckNext_ = std::max(stuckNext_, delivered_);
  if (state_.stuck == Stuck::dark || state_.stuck == Stuck::light) {
    if (stuckNext_ < now) emit(stuckNext_, state_.stuck == Stuck::light);
    return;
  }
  const Time half = (state_.stuck == Stuck::dominant ? kDominant : kRecessive) / 2;
  for (; stuckNext_ < now; stuckNext_ += half) emit(stuckNext_, !level_);
}

void Fibre::deliver(std::deque<LightEdge>& receiver, int phase, Time now) {
  std::vector<LightEdge>& launched = launched_[phase];
  to_ = &receiver;
  if (!state_.whole) {
    // It is dark behind the cut, from when the last light has passed.
    emit(delivered_, false);
  } else if (state_.stuck != Stuck::no) {
    takeStuck(now);
  } else {
    for (const LightEdge& e : launched) {
      errorsUntil(e.at);
      take(e);
    }
  }
  errorsUntil(now);
  launched.clear();
  delivered_ = now;
  state_ = wanted_;
}

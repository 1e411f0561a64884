// A fibre from the optical module of one port to that of another: it carries edges, and may be bad.
#pragma once

#include <deque>
#include <random>
#include <vector>

#include "core/slave.h"

using LightEdge = Slave::LightEdge;

// What is wrong with the light on a fibre; all zero: nothing.
struct Optics {
  uint64_t bitErrors = 0;    // one bit of so many is wrong, in the mean
  uint64_t missing = 0;      // one pulse of so many is missing
  uint64_t extra = 0;        // behind one pulse of so many there is another one
  double jitterNs = 0;       // edges are up to so much late or early
  double dutyPercent = 50;   // how much of a dominant tone's period is light; as much longer is any pulse
  double attenuationDb = 0;  // beyond what the receiver needs for one wrong pulse in 10^12
};

class Fibre {
 public:
  static constexpr double kModulesNs = 40;  // both together (FR-38)
  static constexpr double kNsPerKm = 5000;
  static constexpr double kMostJitterNs = 10, kMostDutyPercent = 70, kLeastDutyPercent = 30;
  static constexpr Time kEarliest = 20 * kNs;  // that an edge is before its time, by both

  // `bit`: the length of a bit on the ring, for errors.
  Fibre(double km, Time bit, uint64_t seed);

  Time delay() const { return delay_; }
  Optics& optics() { return optics_; }
  const Optics& optics() const { return optics_; }
  // To be called after the optics were changed.
  void changed();
  // The fibre is cut at its beginning: what is on its way arrives. This, and what a module is stuck at, holds
  // from the end of the next delivery on: what was launched until now still has to be handed over.
  bool whole() const { return wanted_.whole; }
  void setWhole(bool whole) { wanted_.whole = whole; }
  // A dead module behind a node that goes on: no light, constant light, or the tone of one level for ever.
  enum class Stuck { no, dark, light, dominant, recessive };
  Stuck stuck() const { return wanted_.stuck; }
  void setStuck(Stuck stuck) { wanted_.stuck = stuck; }

  // Two nodes may run at the same time, each by a processor of its own: one of them launches edges in phase 0
  // or 1, and meanwhile the other one gets those that were launched in the other phase.
  void launch(LightEdge edge, int phase) { launched_[phase].push_back(edge); }
  // Hands over what was launched in a phase, which ended at `now`, to the receiver, as it arrives there.
  void deliver(std::deque<LightEdge>& receiver, int phase, Time now);

  uint64_t bitsWrong() const { return bitsWrong_; }
  uint64_t pulsesLost() const { return pulsesLost_; }

 private:
  bool chance(double probability) {
    return probability > 0 && std::uniform_real_distribution<double>(0, 1)(random_) < probability;
  }
  void take(LightEdge edge);
  void takeStuck(Time now);
  void emit(Time at, bool level);
  void spoil(Time from);
  void errorsUntil(Time now);
  void planError(Time from);

  Time delay_, bit_;
  Optics optics_;
  struct State {
    bool whole = true;
    Stuck stuck = Stuck::no;
    bool passes() const { return whole && stuck == Stuck::no; }
  };
  State state_, wanted_;
  Time delivered_ = 0;  // until when edges were handed over
  Time stuckNext_ = 0;
  std::mt19937_64 random_;
  std::vector<LightEdge> launched_[2];
  std::deque<LightEdge>* to_ = nullptr;
  bool level_ = false;            // that was emitted last
  Time lastAt_ = 0;               // when
  bool skip_ = false;             // the pulse that is on is missing
  Time rose_ = 0, distance_ = 0;  // of rising edges launched
  Time litUntil_ = 0;             // as far as edges that have passed tell
  Time errorAt_ = kNever, errorEnd_ = 0;
  double weak_ = 0;  // probability that a pulse is too weak
  uint64_t bitsWrong_ = 0, pulsesLost_ = 0;
};

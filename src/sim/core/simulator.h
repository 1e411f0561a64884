// The event loop and what moves nibbles: clocked actors, cables, a sender and a collector of frames.
#pragma once

#include <algorithm>
#include <cstdint>
#include <deque>
#include <functional>
#include <limits>
#include <vector>

// Femtoseconds, so that a clock error of 1 ppm of a 4 ns half period does not drown in rounding; 2.5 hours
// fit.
using Time = int64_t;
constexpr Time kNs = 1'000'000;
constexpr Time kUs = 1000 * kNs;
constexpr Time kNever = std::numeric_limits<Time>::max();
constexpr Time kNibble = 40 * kNs;
constexpr int kMinimumGap = 24;  // nibbles between two frames

// The period of a clock of `mhz` that is `ppm` too fast.
inline Time periodOf(double mhz, double ppm) { return static_cast<Time>(1e9 / mhz / (1 + ppm * 1e-6) + 0.5); }

// What MII carries in one nibble time.
struct Symbol {
  bool dv = false, er = false;
  uint8_t data = 0;
  bool idle() const { return !dv && !er; }
};

// Takes the nibbles somebody sends, in order of time.
class NibbleSink {
 public:
  virtual ~NibbleSink() = default;
  virtual void nibble(Time launch, Symbol symbol) = 0;
};

// Something that happens at times of its own: `next` is the next one.
class Actor {
 public:
  virtual ~Actor() = default;
  virtual void step() = 0;
  Time next = kNever;
};

class Simulator {
 public:
  void add(Actor& actor) { actors_.push_back(&actor); }
  Time now() const { return now_; }

  // Called with the time that has been completed, before time moves on (tracing).
  std::function<void(Time)> onTimeDone;

  void step() {
    Actor* first = actors_.front();
    for (Actor* a : actors_)
      if (a->next < first->next) first = a;
    if (onTimeDone && first->next > now_) onTimeDone(now_);
    now_ = first->next;
    first->step();
  }

  void runUntil(Time end) {
    while (now_ < end) step();
  }
  // Somebody else has run all actors up to `t`.
  void advance(Time t) { now_ = std::max(now_, t); }

 private:
  std::vector<Actor*> actors_;
  Time now_ = 0;
};

// A frame as nibbles, from the first symbol with DV (or TX_EN) to the last.
struct NibbleFrame {
  Time start = 0, end = 0;
  std::vector<uint8_t> nibbles;
};

// Gathers nibbles to frames.
class FrameCollector : public NibbleSink {
 public:
  explicit FrameCollector(std::function<void(NibbleFrame&)> onFrame) : onFrame_(std::move(onFrame)) {}
  void nibble(Time launch, Symbol symbol) override {
    if (symbol.dv) {
      if (frame_.nibbles.empty()) frame_.start = launch;
      frame_.end = launch;
      frame_.nibbles.push_back(symbol.data);
      lastActive_ = launch;
    } else if (!frame_.nibbles.empty()) {
      onFrame_(frame_);
      frame_.nibbles.clear();
    }
  }
  bool inFrame() const { return !frame_.nibbles.empty(); }
  Time lastActive() const { return lastActive_; }
  const NibbleFrame& partial() const { return frame_; }

 private:
  std::function<void(NibbleFrame&)> onFrame_;
  Time lastActive_ = 0;
  NibbleFrame frame_;
};

// A clock of 25 MHz (less or more some ppm) that launches a queue of symbols, one per nibble, and idle when
// there is none.
class Sender : public Actor {
 public:
  Sender(NibbleSink& to, double ppm, Time firstSlot) : to_(to), period_(periodOf(25, ppm)) {
    next = firstSlot;
  }
  void step() override {
    Symbol s;
    if (!queue_.empty()) {
      s = queue_.front();
      queue_.pop_front();
      lastActive_ = next;
    }
    to_.nibble(next, s);
    next += period_;
  }
  void push(Symbol s) { queue_.push_back(s); }
  void pushIdle(int nibbles) { queue_.insert(queue_.end(), nibbles, Symbol{}); }
  // What waits is lost.
  void clear() { queue_.clear(); }
  void setPpm(double ppm) { period_ = periodOf(25, ppm); }
  void shift(Time by) { next += by; }
  // Leaves out the slots before `t`.
  void skipTo(Time t) {
    if (t > next) next += (t - next + period_ - 1) / period_ * period_;
  }
  Time nextSlot() const { return next; }
  size_t backlog() const { return queue_.size(); }
  // When the last queued symbol was launched; gaps between frames count as queued symbols.
  Time lastActive() const { return lastActive_; }

 private:
  NibbleSink& to_;
  Time period_;
  Time lastActive_ = 0;
  std::deque<Symbol> queue_;
};

// Proves the simulated fibre: what arrives at its end while it is cut, stuck, mended and bad. Exit code 1 if
// something is wrong.
#include <cstdio>

#include "ring/fibre.h"

namespace {
int failures = 0;

void check(const char* name, bool ok) {
  std::printf("%s %s\n", ok ? "ok   " : "WRONG", name);
  if (!ok) ++failures;
}

constexpr Time kWindow = 10 * kUs, kBit = 500 * kNs, kHalf = 20 * kNs;

// A fibre with a node before it that sends a dominant tone, or is dark.
class Bench {
 public:
  explicit Bench(double km = 2) : fibre(km, kBit, 1) {}

  void window(bool isLit = true) {
    fibre.deliver(arrived, 1 - phase_, now_);
    for (Time t = now_; isLit && t < now_ + kWindow; t += kHalf) fibre.launch({t, level_ = !level_}, phase_);
    if (!isLit && level_) fibre.launch({now_, level_ = false}, phase_);
    now_ += kWindow, phase_ = 1 - phase_;
  }
  Time now() const { return now_; }
  // The longest time without an edge at the end of the fibre, and the shortest distance of two.
  Time longest() const {
    return distance([](Time a, Time b) { return a > b; });
  }
  Time shortest() const {
    return distance([](Time a, Time b) { return a < b; });
  }

  Fibre fibre;
  std::deque<LightEdge> arrived;

 private:
  template <class Before>
  Time distance(Before isBefore) const {
    Time found = arrived.at(1).at - arrived.at(0).at;
    for (size_t i = 1; i < arrived.size(); ++i) {
      const Time d = arrived[i].at - arrived[i - 1].at;
      if (isBefore(d, found)) found = d;
    }
    return found;
  }
  Time now_ = 0;
  int phase_ = 0;
  bool level_ = false;
};

void cuts() {
  Bench b;
  for (int i = 0; i < 3; ++i) b.window();
  const Time cut = b.now();
  b.fibre.setWhole(false);
  for (int i = 0; i < 3; ++i) b.window();
  const Time last = b.arrived.back().at - b.fibre.delay();
  check("what was on its way before a cut arrives", last >= cut - kHalf && last <= cut);
  check("it is dark behind the cut", !b.arrived.back().level);
}

void sticks() {
  Bench b;
  for (int i = 0; i < 3; ++i) b.window();
  b.fibre.setStuck(Fibre::Stuck::dominant);
  const size_t before = b.arrived.size();
  for (int i = 0; i < 3; ++i) b.window();
  check("a module that is stuck goes on", b.arrived.size() > before && b.longest() <= 2 * kHalf);
  b.fibre.setWhole(false);
  for (int i = 0; i < 1000; ++i) b.window();
  b.arrived.clear();
  b.fibre.setWhole(true);
  for (int i = 0; i < 3; ++i) b.window();
  const auto edges = static_cast<Time>(b.arrived.size());
  check("the time of a cut is not made up for", edges >= kWindow / kHalf && edges <= 2 * kWindow / kHalf);
  check("in its tone", b.shortest() >= kHalf);
}

void errs() {
  Bench b;
  b.fibre.optics().bitErrors = 10;
  b.fibre.changed();
  for (int i = 0; i < 100; ++i) b.window();
  const uint64_t lit = b.fibre.bitsWrong();
  check("bits are wrong", lit > 100 && lit < 300);
  b.fibre.setWhole(false);
  for (int i = 0; i < 1000; ++i) b.window();
  b.fibre.setWhole(true);
  for (int i = 0; i < 3; ++i) b.window();
  check("but none behind a cut", b.fibre.bitsWrong() < lit + 20);
  const uint64_t before = b.fibre.bitsWrong();
  for (int i = 0; i < 100; ++i) b.window(false);
  check("and none of a node that is dark", b.fibre.bitsWrong() < before + 10);
}

void spoils() {
  Bench b;
  b.fibre.optics().extra = 1;
  b.fibre.changed();
  for (int i = 0; i < 3; ++i) b.window();
  Time pulse = kNever, rose = 0;
  for (const LightEdge& e : b.arrived)
    if (e.level) rose = e.at;
    else pulse = std::min(pulse, e.at - rose);
  check("a pulse too many is as long as nodes need to see it", pulse >= 10 * kNs);

  Bench dark;
  dark.fibre.optics().attenuationDb = 25;
  dark.fibre.changed();
  for (int i = 0; i < 3; ++i) dark.window();
  check("an attenuation of everything leaves nothing", dark.arrived.empty());
}
}  // namespace

int main() {
  cuts();
  sticks();
  errs();
  spoils();
  return failures == 0 ? 0 : 1;
}

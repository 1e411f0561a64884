#include <chrono>
#include <cinttypes>
#include <iostream>

#include "core/program.h"
#include "smsoak/host.h"
#include "smsoak/master.h"
#include "core/user_error.h"

namespace smsoak {
namespace {

class Soak {
 public:
  Soak(const Preset& preset, uint64_t seed)
      : random_(seed),
        core_(preset),
        host_(core_, slots_, random_),
        master_(slots_, random_),
        worlds_(1) {}

  // Until so many steps are done. False if something is wrong; why() then tells what.
  bool run(uint64_t steps) {
    slots_.place(random_);
    Frame first = master_.setUp();
    if (!pass(first, false)) return false;
    core_.cycle();
    while (this->steps() < steps) {
      Frame frame = master_.next();
      if (!pass(frame, true)) return false;
    }
    return true;
  }
  uint64_t steps() const { return busSteps_ + host_.steps(); }
  void summary(double seconds) const {
    uint64_t messages = 0;
    for (unsigned n = 0; n < kSms; ++n) messages += slots_[n].stamps.messagesRead();
    std::printf("steps %" PRIu64 " (bus %" PRIu64 ", host %" PRIu64 "), frames %" PRIu64 " (%" PRIu64
                " broken), whole messages read %" PRIu64 ", core cycles %" PRIu64
                ", most orders %zu, %.0f s, %.0f steps/s\n",
                steps(), busSteps_, host_.steps(), frames_, broken_, messages, core_.now(), mostOrders_,
                seconds, static_cast<double>(steps()) / seconds);
  }
  const std::string& why() const { return why_; }

 private:
  bool fail(const std::string& what) {
    why_ = "step " + std::to_string(steps()) + ": " + what;
    return false;
  }
  bool cycle(uint64_t frameEnd, bool withHost) {
    core_.cycle();
    if (withHost) host_.cycle(frameEnd);
    return host_.violation().empty() || fail(host_.violation());
  }

  // Sends a frame, and compares all that has happened until its effects have ended.
  bool pass(Frame& frame, bool withHost) {
    core_.slip(random_.below(4));
    const uint64_t began = core_.now(), end = began + core_.perNibble() * frame.symbols().size();
    core_.send(frame.symbols());
    ++frames_;
    broken_ += !frame.good();
    while (!core_.returned().ended) {
      if (!cycle(end + 14, withHost)) return false;
      if (core_.now() > end + 1000) return fail("the frame did not come back");
    }
    if (core_.returned().nibbles.size() < frame.processed()) return fail("the frame came back too short");
    History bus;
    frame.finish(
        core_, busSteps_, [this](unsigned a) { return slots_.managersAt(a); }, bus);
    busSteps_ += frame.datagrams().size();
    // The smallest gap is 24 nibbles; now and then a longer one.
    const uint64_t gap =
        end + core_.perNibble() * 24 + (random_.once(8) ? random_.below(2000) : random_.below(4));
    while (core_.now() <= frame.last() || !host_.settled(frame.last()) || core_.now() < gap)
      if (!cycle(0, withHost)) return false;
    std::string why;
    if (!merge(worlds_, bus, host_.takeHistory(), why))
      return fail("bus and host cannot be put into one order:\n" + why);
    mostOrders_ = std::max(mostOrders_, worlds_.size());
    const unsigned renewed = master_.takeBack(frame, began, frame.last());
    if (!master_.violation().empty()) return fail(master_.violation());
    for (unsigned n = 0; n < kSms; ++n)
      if (renewed >> n & 1 || slots_[n].held()) host_.drop(n);
    return true;
  }

  Random random_;
  Slots slots_;
  Core core_;
  Host host_;
  Master master_;
  std::vector<World> worlds_;
  uint64_t busSteps_ = 0, frames_ = 0, broken_ = 0;
  size_t mostOrders_ = 1;
  std::string why_;
};

}  // namespace
}  // namespace smsoak

int main(int argc, char** argv) {
  CLI::App app("Bus and host use the SyncManagers of one simulated slave at the same time, at random.",
               "flyframe-smsoak");
  std::string preset = "smsoak";
  uint64_t steps = 100000, seed = 1;
  bool list = false;
  app.add_option("--preset", preset, "preset, with 8 SyncManagers, 3 FMMUs, 1 KiB RAM and without EEPROM")
      ->capture_default_str();
  app.add_option("--steps", steps, "accesses of bus and host")->capture_default_str();
  app.add_option("--seed", seed, "of the random numbers")->capture_default_str();
  app.add_flag("--list", list, "print the presets built in");
  return runProgram(app, argc, argv, [&]() -> int {
    if (list) return std::cout << presetNames() << "\n", 0;
    const auto start = std::chrono::steady_clock::now();
    if (!findPreset(preset).info.hasHost) throw UserError("the preset '" + preset + "' has no host.");
    smsoak::Soak soak(findPreset(preset), seed);
    const bool right = soak.run(steps);
    soak.summary(std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
    if (!right) std::cout << "WRONG, seed " << seed << ", " << soak.why() << "\n";
    return right ? 0 : 1;
  });
}

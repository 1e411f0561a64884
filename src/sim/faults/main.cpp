// Slaves behind cables that fail: what comes back is right, the counters tell which cable was bad, and
// everything goes on by itself.
#include <chrono>
#include <cinttypes>
#include <iostream>

#include "core/model.h"
#include "core/program.h"
#include "core/user_error.h"
#include "faults/master.h"

namespace faults {
namespace {

struct Options {
  std::string preset = "slave";
  size_t slaves = 5;
  uint64_t cycles = 10'000, seed = 1;
  uint64_t bitErrors = 1'000'000;  // one bit of so many on the bad cable
  double drops = 300, dropUs = 1500;
  bool ring = false;
};

constexpr uint64_t kPhase = 500;    // cycles for which the same cable is bad
constexpr int kRecovers = 3000;     // cycles until all is well again, at most; the watchdog has 5 ms
constexpr size_t kCounters = 0x14;  // bytes, from the RX error counters to the last lost link counter
constexpr size_t kForwarded = esc::reg::kForwardedErrors - esc::reg::kRxErrors;
constexpr size_t kLost = esc::reg::kLostLinks - esc::reg::kRxErrors;

// An image without anything but a valid configuration area.
Bytes eepromImage() {
  Bytes image(2048, 0xff);
  std::fill_n(image.begin(), 16, 0);
  image[14] = siiCrc8(image.data(), 14);
  return image;
}

NetworkSpec networkOf(const Options& options) {
  std::mt19937_64 random(options.seed);
  auto ppm = [&] { return static_cast<double>(random() % 141) - 70; };
  NetworkSpec network;
  for (size_t i = 0; i < options.slaves; ++i) {
    SlaveSpec slave;
    slave.preset = options.preset;
    slave.host.program = "io";
    slave.behind = i > 0 ? i - 1 : 0;
    slave.cable.ns = 5 + static_cast<double>(random() % 496);  // 1 to 100 m
    slave.clockPpm = ppm(), slave.driftPpm = 20, slave.driftSeconds = 0.05;
    slave.eeprom = eepromImage();
    slave.eepromChip = eepromChipFor(slave.eeprom->size());
    network.slaves.push_back(slave);
  }
  if (options.ring) network.ring.emplace();
  network.masterPpm = ppm();
  network.seed = options.seed;
  return network;
}

class Run {
 public:
  explicit Run(const Options& options)
      : options_(options),
        random_(options.seed),
        bus_(networkOf(options)),
        master_(bus_, options.seed) {}

  // False if something is wrong; why() tells what.
  bool run() {
    while (master_.cycles() < options_.cycles)
      if (!(options_.ring ? cutAndMend() : badCable())) return false;
    return true;
  }
  void summary(double seconds) {
    uint64_t flipped = 0, drops = 0;
    for (size_t i = 0; i < bus_.network().links(); ++i) {
      flipped += bus_.network().link(i).bitsFlipped();
      drops += bus_.network().link(i).drops();
    }
    std::printf("cycles %" PRIu64 " (complete %" PRIu64 "), frames %" PRIu64 " (lost %" PRIu64
                ", bad %" PRIu64 "), bits flipped %" PRIu64 ", links dropped %" PRIu64
                ", cut and mended %" PRIu64 ", recoveries %" PRIu64 ", %.0f s\n",
                master_.cycles(), master_.completeCycles(), bus_.sent(), bus_.lost(), bus_.bad(), flipped,
                drops, cuts_, master_.recoveries(), seconds);
  }
  const std::string& why() const { return why_; }

 private:
  bool fail(const std::string& what) {
    why_ = what;
    return false;
  }
  bool right() { return master_.violation().empty() || fail(master_.violation()); }
  bool cycle(int64_t afterNs = 0, const Bus::Within& within = nullptr) {
    master_.cycle(afterNs, within);
    bus_.idle(static_cast<int64_t>(random_() % 10'000));
    return right();
  }

  // One cable is bad for a while; the others are not, and the counters say so.
  bool badCable() {
    Network& net = bus_.network();
    const size_t bad = random_() % net.links();
    if (!master_.writeAll(esc::reg::kRxErrors, Bytes(kCounters)))
      return fail("the counters cannot be cleared, with all cables whole");
    const uint64_t end = master_.cycles() + kPhase, flipped = net.link(bad).bitsFlipped(),
                   drops = net.link(bad).drops(), wrong = bus_.bad();
    net.link(bad).setBitErrors(options_.bitErrors);
    net.setDrops(bad, options_.drops, options_.dropUs);
    while (master_.cycles() < end)
      if (!cycle()) return false;
    net.link(bad).setBitErrors(0);
    net.setDrops(bad, 0, 1);
    if (!recovers("cable " + std::to_string(bad) + " was bad")) return false;
    return countersTell(bad, net.link(bad).bitsFlipped() - flipped, net.link(bad).drops() - drops,
                        bus_.bad() - wrong);
  }

  bool recovers(const std::string& behind) {
    for (int i = 0; i < kRecovers && !master_.healthy(); ++i)
      if (!cycle()) return false;
    return master_.healthy() || fail("behind what happened (" + behind + ") not all slaves reach OP again");
  }

  // Both ends of cable `bad` may have counted, the other ports nothing; what passed a port behind an error is
  // marked, and counts there as forwarded.
  bool countersTell(size_t bad, uint64_t flipped, uint64_t drops, uint64_t frames) {
    const auto all = master_.readAll(esc::reg::kRxErrors, kCounters);
    if (!all) return fail("the counters cannot be read, with all cables whole");
    uint64_t errors = 0, lost = 0;
    for (size_t i = 0; i < all->size(); ++i)
      for (size_t port = 0; port < 4; ++port) {
        const Bytes& c = (*all)[i];
        const bool end = (port == 0 && i == bad) || (port == 1 && i + 1 == bad);
        const unsigned received = c[2 * port] + c[2 * port + 1], links = c[kLost + port];
        if (!end && (received || links))
          return fail("cable " + std::to_string(bad) + " was bad, but port " + std::to_string(port) +
                      " of slave " + std::to_string(i) + " has counted " + hex(c));
        errors += received, lost += links;
      }
    // Not every bit that flips is one of a frame, and the master's own card counts nothing here.
    if (bad > 0 && drops > 0 && lost == 0) return fail("links dropped, and nobody has counted it");
    if (bad > 0 && flipped > 20 && frames > 5 && errors == 0)
      return fail("frames were bad, and nobody has counted it");
    return true;
  }

  // A ring is cut in mid-frame: the next frame reaches all slaves, from both ends.
  bool cutAndMend() {
    Network& net = bus_.network();
    const size_t place = cuts_ % net.links();
    const auto after = static_cast<int64_t>(random_() % 12'000);
    if (!recovers("the ring was mended")) return false;
    for (const bool whole : {false, true}) {
      if (!cycle(after, [&] { net.link(place).setWhole(whole); })) return false;
      if (!cycle()) return false;
      if (!master_.complete())
        return fail("the ring was " + std::string(whole ? "mended" : "cut") + " at " + std::to_string(place) +
                    ", " + std::to_string(after) +
                    " ns into a frame, and the next one does not reach all slaves");
      for (int i = 0; i < 3; ++i)
        if (!cycle()) return false;
      if (!master_.healthy()) return fail("a slave has left OP because the ring was cut for a cycle");
    }
    ++cuts_;
    return true;
  }

  Options options_;
  std::mt19937_64 random_;
  Bus bus_;
  Master master_;
  uint64_t cuts_ = 0;
  std::string why_;
};

}  // namespace
}  // namespace faults

int main(int argc, char** argv) {
  CLI::App app("Slaves behind cables that fail, in OP with a master of their own.", "flyframe-faults");
  faults::Options o;
  bool list = false;
  app.add_option("--preset", o.preset, "preset of the slaves, with 2 ports, 8 FMMUs and an EEPROM")
      ->capture_default_str();
  app.add_option("--slaves", o.slaves, "how many")->capture_default_str()->check(CLI::Range(1, 64));
  app.add_option("--cycles", o.cycles, "cycles of the master")->capture_default_str();
  app.add_option("--seed", o.seed, "of all that is random")->capture_default_str();
  app.add_option("--bit-errors", o.bitErrors, "one bit of so many is flipped on the bad cable")
      ->capture_default_str();
  app.add_option("--drops", o.drops, "link losses of the bad cable in a second")->capture_default_str();
  app.add_option("--drop-us", o.dropUs, "how long they are")->capture_default_str();
  app.add_flag("--ring", o.ring, "a ring with both ends at the master, cut in mid-frame and mended");
  app.add_flag("--list", list, "print the presets built in");
  return runProgram(app, argc, argv, [&]() -> int {
    if (list) return std::cout << presetNames() << "\n", 0;
    const auto start = std::chrono::steady_clock::now();
    faults::Run run(o);
    const bool right = run.run();
    run.summary(std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
    if (!right) std::cout << "WRONG, seed " << o.seed << ", " << run.why() << "\n";
    return right ? 0 : 1;
  });
}

// A microcontroller with an asynchronous bus, at times of its own.
#include "hosts/host.h"

namespace hosts {
namespace {

class BusHost : public WordHost {
 public:
  BusHost(Core& core, Random& random)
      : WordHost(core, random),
        readHigh_(core.parameter("busReadHigh")),
        enablesHigh_(core.parameter("busByteEnableHigh")),
        early_(core.parameter("busWriteEarly")),
        readAll_(core.parameter("busReadAll")),
        driver_(core.parameter("busBusyDriver")),
        select_(core.pin("bus_cs_n")),
        read_(core.pin("bus_rd")),
        write_(core.pin("bus_wr_n")),
        enables_(core.pin("bus_be")),
        address_(core.pin("bus_a")),
        in_(core.pin("bus_d_in")),
        out_(core.pin("bus_d_out")),
        drive_(core.pin("bus_d_drive")),
        busy_(core.pin("bus_busy")),
        busyDrive_(core.pin("bus_busy_drive")) {}

  void rest() override {
    release();
    select_.set(1);
    core_.settle();
  }

  Bad bad(unsigned address) override {
    switch (random_.below(6)) {
      case 0: return glitch(address);
      case 1: return selectOnly();
      case 2: return nothing(address);
      case 3: return tooFast(address);
      case 4: return hasty(address);
      default: return cut(address);
    }
  }

 protected:
  uint32_t access(bool write, unsigned word, uint32_t value, unsigned enables) override {
    begin(write, word, value, enables);
    core_.wait(cycles(6, hurries_ ? 6 : 9));
    if (drive_.get() != (write ? 0u : 1u)) throw Wrong("the data pins are driven by the wrong side");
    for (int i = 0; waits(); ++i) {
      if (i > 100000) throw Wrong("BUSY does not end");
      core_.wait(core_.period() / 4);
    }
    core_.wait(random_.below(hurries_ ? 1 : 2 * static_cast<unsigned>(core_.period())));
    const uint32_t data = out_.get();
    end();
    return data;
  }

 private:
  // From `least` to `most` core cycles, at any moment between.
  Time cycles(double least, double most) {
    const double part = hurries_ ? 0 : random_.below(1000) / 1000.0;
    return static_cast<Time>((least + (most - least) * part) * static_cast<double>(core_.period()));
  }
  bool waits() {
    core_.settle();
    const bool level = busy_.get(), drive = busyDrive_.get();
    switch (driver_) {
      case 0: return !level;
      case 1: return drive && !level;
      case 2: return level;
      default: return drive && level;
    }
  }
  void strobe(bool write, bool on) {
    if (write) write_.set(!on);
    else read_.set(on == readHigh_);
  }
  void release() { strobe(true, false), strobe(false, false); }
  // Chip select and strobe in either order.
  void begin(bool write, unsigned word, uint32_t value, unsigned enables) {
    address_.set(word), in_.set(value);
    enables_.set(enablesHigh_ ? enables : ~enables & ((1u << lanes()) - 1));
    core_.wait(cycles(0, 2));
    const bool selectFirst = random_.once(2);
    if (selectFirst) select_.set(0);
    else strobe(write, true);
    core_.wait(cycles(0, random_.once(2) ? 0 : 2));
    select_.set(0), strobe(write, true);
    core_.settle();
  }
  // What comes with a strobe stands a cycle longer; then it changes at any time.
  void end(double rest = 3) {
    switch (random_.below(3)) {
      case 0: select_.set(1); break;
      case 1: release(); break;
      default: select_.set(1), release();
    }
    core_.wait(cycles(1, 1.5));
    release();
    if (!random_.once(3)) select_.set(1);
    in_.set(random_.below(0x10000)), address_.set(random_.below(0x4000)), enables_.set(random_.below(16));
    core_.wait(cycles(rest - 1, rest + 3));
    select_.set(1);
  }

  uint16_t codeOf(bool write, bool none) { return static_cast<uint16_t>(1u << (2 * none + write)); }

  // Shorter than a core cycle: none.
  Bad glitch(unsigned address) {
    core_.wait(cycles(3, 5));
    const bool write = random_.once(2);
    address_.set(wordOf(address)), in_.set(random_.below(0x10000)), enables_.set(random_.below(16));
    select_.set(0), strobe(write, true);
    core_.wait(random_.range(1, static_cast<int>(core_.period()) * 9 / 10));
    select_.set(1), release();
    core_.wait(cycles(6, 10));
    return {write ? "glitch of write" : "glitch of read", 0, 0, 0, 0, {}};
  }
  Bad selectOnly() {
    select_.set(0);
    core_.wait(cycles(0.1, 20));
    select_.set(1);
    core_.wait(cycles(3, 6));
    return {"chip select alone", 0, 0, 0, 0, {}};
  }
  Bad nothing(unsigned address) {
    const bool write = random_.once(2), counted = write || !readAll_;
    access(write, wordOf(address), random_.below(0x10000), 0);
    return {"no byte enabled", counted, counted, codeOf(write, true), 0xffff, {}};
  }
  // Strobes at 110 % of the speed that they may have.
  Bad tooFast(unsigned address) {
    Bad bad{"strobes at 110 %", 0, 2, 0, 0, {}};
    for (unsigned a : {address, address + 4}) {
      const uint8_t value = random_.byte();
      address_.set(wordOf(a)), in_.set(inLane(a, value));
      enables_.set(enablesHigh_ ? enableOf(a) : ~enableOf(a) & ((1u << lanes()) - 1));
      select_.set(0), strobe(true, true);
      core_.wait(cycles(6 / 1.1, 6 / 1.1));
      release(), select_.set(1);
      core_.wait(cycles(3 / 1.1, 3 / 1.1));
      bad.written.push_back({a, value, false});
    }
    core_.wait(cycles(3, 6));
    return bad;
  }
  // A second access that does not look at BUSY behind a write.
  Bad hasty(unsigned address) {
    const uint8_t value = random_.byte();
    access(true, wordOf(address), inLane(address, value), enableOf(address));
    begin(false, wordOf(address), 0, enableOf(address));
    core_.wait(cycles(2, 6));
    end();
    core_.wait(cycles(3, 6));
    return {"BUSY not looked at", 0, 1, codeOf(false, false), 0xffff, {{address, value, true}}};
  }
  // Ended anywhere.
  Bad cut(unsigned address) {
    const bool write = early_ && random_.once(2);
    const uint8_t value = random_.byte();
    begin(write, wordOf(address), inLane(address, value), enableOf(address));
    core_.wait(cycles(0.1, 40));
    end();
    core_.wait(cycles(3, 6));
    Bad bad{write ? "write cut" : "read cut", 0, 1, codeOf(write, false), 0xffff, {}};
    if (write) bad.written.push_back({address, value, false});
    return bad;
  }

  const bool readHigh_, enablesHigh_, early_, readAll_;
  const int driver_;
  WidePin &select_, &read_, &write_, &enables_, &address_, &in_, &out_, &drive_, &busy_, &busyDrive_;
};

}  // namespace

std::unique_ptr<Host> makeMicrocontroller(Core& core, Random& random) {
  return std::make_unique<BusHost>(core, random);
}

}  // namespace hosts

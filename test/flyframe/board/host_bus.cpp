// The host bus of the board against a microcontroller's memory interface (STM32 FSMC, modes 1 and A,
// asynchronous wait) that has a clock of its own, and registers behind the host port that answer when they
// like (HB-01 to HB-06).
//   host-bus --accesses 100000 --seed 1      exit code 0 if all was right, 1 with a message if not
#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <deque>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include "Vboard_support.h"
#include "verilated.h"

namespace {
using Time = int64_t;  // ps
constexpr Time kNs = 1000, kMs = 1'000'000'000;
constexpr Time kCore = 1000 * kNs / CORE_MHZ;
constexpr int kLanes = WIDTH / 8;
constexpr uint32_t kLaneMask = (1u << kLanes) - 1;
constexpr int kWords = 8192 / kLanes;

// What fpga/alarm/board.sdc allows.
constexpr Time kPayloadDelay = 15 * kNs, kOutputDelay = 15 * kNs;
// Strobes: 8 ns there, and 2 ns of difference on the board.
constexpr Time kStrobeDelay = 10 * kNs;
// What the host may do: give address, enables and data so long after the strobe.
constexpr Time kPayloadLate = 15 * kNs;
// What fpga/README.md asks of the host. The strobe is high so long that a clock edge sees it, whatever the
// pins' delays.
constexpr Time kStrobeHigh = kCore + kStrobeDelay + 5 * kNs;
// Wait is looked at so long after it rose: a cycle until an edge sees it, two more until `released` is false.
constexpr Time kWaitAfterStrobe = kStrobeDelay + 3 * kCore + kOutputDelay;
// And so long after NE fell, which needs no clock.
constexpr Time kWaitAfterNe = kStrobeDelay + kOutputDelay;
// An access stands at the host port, or it is not certain to be carried out: a cycle until an edge sees it,
// three more.
constexpr Time kTaken = kStrobeDelay + 4 * kCore;

std::mt19937_64 random64;
uint64_t random(uint64_t below) { return random64() % below; }
uint32_t randomWord() { return static_cast<uint32_t>(random64() & (0xffffffffull >> (32 - WIDTH))); }

[[noreturn]] void fail(Time now, const std::string& what) {
  std::printf("at %.3f us: %s\n", static_cast<double>(now) / 1e6, what.c_str());
  std::exit(1);
}

struct Access {
  bool write;
  uint32_t word, enabled, data;
  bool operator==(const Access& o) const {
    return write == o.write && word == o.word && enabled == o.enabled && (!write || data == o.data);
  }
};
std::string show(const Access& a) {
  char text[80];
  std::snprintf(text, sizeof text, "%s of word 0x%x, bytes 0x%x, data 0x%x", a.write ? "write" : "read",
                a.word, a.enabled, a.data);
  return text;
}

// Registers behind the host port: answers after a random time, and sees that the port is used as it must be.
class Registers {
 public:
  std::array<uint8_t, 8192> bytes{};
  std::vector<Access> seen;

  uint32_t read(uint32_t word) const {
    uint32_t value = 0;
    for (int i = 0; i < kLanes; ++i) value |= static_cast<uint32_t>(bytes[word * kLanes + i]) << (8 * i);
    return value;
  }
  // At a rising edge: `port` as it was before, the result is the answer behind it.
  struct Answer {
    bool ack;
    uint32_t data;
  };
  Answer edge(const Vboard_support& port, Time now) {
    const Answer none{false, randomWord()};
    if (!port.host_req) {
      if (wait_ >= 0) fail(now, "host_req was taken back");
      mustBeLow_ = false;
      return none;
    }
    if (port.host_ack) {
      mustBeLow_ = true;
      return none;
    }
    const Access a{static_cast<bool>(port.host_write), static_cast<uint32_t>(port.host_addr) / kLanes,
                   port.host_be, port.host_wdata};
    if (mustBeLow_) fail(now, "host_req stayed high after host_ack");
    if (port.host_addr >= bytes.size()) fail(now, "host_addr is outside 8 KiB");
    if (wait_ < 0) {
      pending_ = a;
      const auto kind = random(100);
      wait_ = kind < 70   ? static_cast<int>(random(4))
              : kind < 98 ? static_cast<int>(random(30))
                          : static_cast<int>(random(400));
    }
    if (!(a == pending_)) fail(now, "the host port changed during an access");
    if (wait_-- > 0) return none;
    wait_ = -1;
    seen.push_back(a);
    if (a.write)
      for (int i = 0; i < kLanes; ++i)
        if (a.enabled >> i & 1) bytes[a.word * kLanes + i] = static_cast<uint8_t>(a.data >> (8 * i));
    return {true, a.write ? none.data : read(a.word)};
  }

 private:
  int wait_ = -1;
  bool mustBeLow_ = false;
  Access pending_{};
};

// The device: pins change at times of their own, the core clock has its.
class Device {
 public:
  Vboard_support top;
  Registers registers;
  Time now = 0;
  uint64_t cycles = 0;

  Device() {
    top.bus_cs_n = top.bus_rd = top.bus_wr_n = 1;
    top.eval();
  }
  // A pin takes its value somewhat later than the host gives it.
  void pin(std::function<void(Vboard_support&)> change, Time most) {
    changes_.push_back({now + Time(random(most)), std::move(change)});
  }
  void ne(bool v) {
    pin([v](auto& t) { t.bus_cs_n = v; }, kStrobeDelay);
  }
  void noe(bool v) {
    pin([v](auto& t) { t.bus_rd = v; }, kStrobeDelay);
  }
  void nwe(bool v) {
    pin([v](auto& t) { t.bus_wr_n = v; }, kStrobeDelay);
  }
  void address(uint32_t v) {
    pin([v](auto& t) { t.bus_a = v; }, kPayloadDelay);
  }
  void enables(uint32_t v) {
    pin([v](auto& t) { t.bus_be = ~v & kLaneMask; }, kPayloadDelay);
  }
  void data(uint32_t v) {
    pin([v](auto& t) { t.bus_d_in = v; }, kPayloadDelay);
  }
  // What the host sees.
  bool nwait() const { return random(2) ? top.bus_busy : outputs_.front().nwait; }  // early or late
  uint32_t readData() const { return outputs_.front().data; }

  void runUntil(Time end) {
    while (true) {
      auto change =
          std::min_element(changes_.begin(), changes_.end(), [](auto& a, auto& b) { return a.at < b.at; });
      const bool edgeFirst = change == changes_.end() || edge_ <= change->at;
      const Time next = edgeFirst ? edge_ : change->at;
      if (next > end) break;
      now = next;
      if (edgeFirst) {
        clock();
      } else {
        const auto f = std::move(change->apply);
        changes_.erase(change);
        f(top);
        top.eval();
      }
      look();
    }
    now = end;
    while (outputs_.size() > 1 && outputs_[1].at + kOutputDelay <= now) outputs_.pop_front();
  }
  void run(Time time) { runUntil(now + time); }

 private:
  struct Change {
    Time at;
    std::function<void(Vboard_support&)> apply;
  };
  struct Outputs {
    Time at;
    bool nwait;
    uint32_t data;
  };
  void clock() {
    const auto answer = top.reset ? Registers::Answer{} : registers.edge(top, now);
    top.clock = 1, top.eval();
    top.host_ack = answer.ack, top.host_rdata = answer.data;
    top.clock = 0, top.eval();
    edge_ += kCore;
    ++cycles;
  }
  void look() {
    if (top.bus_d_drive != (!top.bus_cs_n && !top.bus_rd))
      fail(now, "the data pins' direction does not follow NE and NOE");
    if (top.bus_cs_n && !top.bus_busy) fail(now, "NWAIT is low though this device is not selected");
    if (outputs_.back().nwait != top.bus_busy || outputs_.back().data != top.bus_d_out)
      outputs_.push_back({now, static_cast<bool>(top.bus_busy), top.bus_d_out});
  }
  std::vector<Change> changes_;
  std::deque<Outputs> outputs_{{0, true, 0}};
  Time edge_ = kCore;
};

// The host's memory interface. Times are in periods of its clock, `hclk`.
class Host {
 public:
  explicit Host(Device& device) : device_(device) {}

  void access(const Access& a) {
    hclk_ = periods_[random(periods_.size())] + Time(random(50));
    const int addressSetup = 1 + static_cast<int>(random(4));
    // The least that is allowed, or a little more. Four periods before its end the interface looks at wait.
    const Time least =
        std::max(kWaitAfterNe, kWaitAfterStrobe - (device_.now - rose_)) - addressSetup * hclk_;
    const int dataSetup = 4 + static_cast<int>(std::max<Time>(1, (least + hclk_ - 1) / hclk_) + random(3));
    const bool modeA = random(2) != 0;
    const uint32_t expected = device_.registers.read(a.word);

    const bool late = random(4) == 0;
    device_.ne(false);
    if (!late) payload(a);
    // Mode 1: NOE falls with NE. Mode A: the strobe falls when the address has been set up.
    const Time early = device_.now - rose_;
    if (a.write || modeA || early < kStrobeHigh)
      device_.run(std::max(addressSetup * hclk_, kStrobeHigh - early));
    a.write ? device_.nwe(false) : device_.noe(false);
    if (late) {
      device_.run(kPayloadLate);
      payload(a);
    }
    if (!a.write && !modeA) device_.run(addressSetup * hclk_);
    device_.run((dataSetup - 4) * hclk_);
    int waited = 0;
    while (!device_.nwait()) {
      device_.run(hclk_);
      if (++waited > 5000) fail(device_.now, "wait without end: " + show(a));
    }
    device_.run((3 + Time(random(2))) * hclk_);
    const uint32_t got = device_.readData();
    end();
    uint32_t mask = 0;
    for (int i = 0; i < kLanes; ++i) mask |= a.enabled >> i & 1 ? 0xffu << (8 * i) : 0;
    if (!a.write && ((got ^ expected) & mask))
      fail(device_.now, show(a) + ": got " + std::to_string(got) + ", expected " + std::to_string(expected));
    expect({a});
  }
  // HB-05: the host takes no notice of wait.
  void abort(const Access& a) {
    payload(a);
    device_.ne(false);
    device_.run(10 * kNs);
    a.write ? device_.nwe(false) : device_.noe(false);
    device_.run(kTaken);
    end();
    device_.run(600 * kCore);
    expect({a});
  }
  // The bus is busy with another device, or selects this one and asks for nothing.
  void elsewhere() {
    const bool selected = random(2) != 0;
    if (selected) device_.ne(false);
    for (int i = 0; i < 3; ++i) {
      device_.address(static_cast<uint32_t>(random(kWords))), device_.data(randomWord()),
          device_.enables(kLaneMask);
      const bool write = random(2) != 0;
      if (!selected) write ? device_.nwe(false) : device_.noe(false);
      device_.run(100 * kNs + Time(random(20 * kNs)));
      if (!selected) write ? device_.nwe(true) : device_.noe(true);
      if (i < 2) device_.run(kStrobeHigh);
    }
    if (selected) device_.ne(true);
    rose_ = device_.now;
    // This device may be next, after a period of the fastest clock.
    device_.run(random(2) && !selected ? periods_.back() : kPayloadDelay);
    expect({});
  }

 private:
  void payload(const Access& a) { device_.address(a.word), device_.enables(a.enabled), device_.data(a.data); }
  // All pins go at once; address and data have no hold time.
  void end() {
    device_.ne(true), device_.noe(true), device_.nwe(true);
    rose_ = device_.now;
    device_.address(static_cast<uint32_t>(random(kWords))), device_.data(randomWord()),
        device_.enables(static_cast<uint32_t>(random(kLaneMask + 1)));
    // Back to back in half of the cases.
    device_.run(kStrobeHigh + (random(2) ? 0 : Time(random(200 * kNs))));
  }
  void expect(const std::vector<Access>& wanted) {
    auto& seen = device_.registers.seen;
    if (seen != wanted) {
      std::string text = "at the host port:";
      for (const auto& a : seen) text += " " + show(a) + ";";
      text += " wanted:";
      for (const auto& a : wanted) text += " " + show(a) + ";";
      fail(device_.now, text);
    }
    seen.clear();
  }

  // 72, 100, 120, 168 MHz.
  static constexpr std::array<Time, 4> periods_{13888, 10000, 8333, 5952};
  Device& device_;
  Time hclk_ = 0, rose_ = -1 * kMs;
};

// HB-06: without the PLL's lock reset is on at once; behind it for at least 10 ms; meanwhile no host has to
// wait.
void reset(Device& device) {
  device.top.pll_locked = 0;
  device.top.eval();
  if (!device.top.reset) fail(device.now, "no reset without a clock");
  device.run(1000 * kNs);
  device.top.pll_locked = 1;
  device.ne(false);
  device.run(100 * kNs);
  const Time start = device.now;
  while (device.top.reset) {
    if (!device.top.bus_busy) fail(device.now, "wait in reset");
    device.run(kNs * 1000);
    if (device.now - start > 20 * kMs) fail(device.now, "reset does not end");
  }
  if (device.now - start < 10 * kMs) fail(device.now, "reset is shorter than 10 ms");
  device.ne(true);
  device.run(1000 * kNs);
}
}  // namespace

int main(int argc, char** argv) {
  uint64_t accesses = 100000, seed = 1;
  for (int i = 1; i + 1 < argc; i += 2) {
    if (!std::strcmp(argv[i], "--accesses")) accesses = std::strtoull(argv[i + 1], nullptr, 10);
    if (!std::strcmp(argv[i], "--seed")) seed = std::strtoull(argv[i + 1], nullptr, 10);
  }
  random64.seed(seed);
  Device device;
  Host host(device);
  reset(device);
  uint64_t reads = 0, writes = 0;
  for (uint64_t i = 0; i < accesses; ++i) {
    // Few words, so that what was written is read again.
    const uint32_t word =
        random(4) ? static_cast<uint32_t>(random(16)) : static_cast<uint32_t>(random(kWords));
    const Access a{random(2) != 0, word, 1 + static_cast<uint32_t>(random(kLaneMask)), randomWord()};
    const auto kind = random(200);
    if (kind < 20) host.elsewhere();
    kind == 0 ? host.abort(a) : host.access(a);
    ++(a.write ? writes : reads);
  }
  reset(device);
  std::printf("accesses %llu (%llu reads, %llu writes), core cycles %llu, errors 0\n",
              static_cast<unsigned long long>(accesses), static_cast<unsigned long long>(reads),
              static_cast<unsigned long long>(writes), static_cast<unsigned long long>(device.cycles));
}

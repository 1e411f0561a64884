// A microcontroller with SPI, whose clock has nothing to do with the core's.
#include <algorithm>

#include "hosts/host.h"

namespace hosts {
namespace {

enum Command : unsigned { kRead = 2, kReadWithPause = 3, kWrite = 4, kExtension = 6 };

class SpiHost : public Host {
 public:
  SpiHost(Core& core, Random& random)
      : Host(core, random),
        mode_(core.parameter("spiMode")),
        late_(core.parameter("spiLateSample")),
        selHigh_(core.parameter("spiSelHigh")),
        sel_(core.pin("spi_sel")),
        clk_(core.pin("spi_clk")),
        mosi_(core.pin("spi_mosi")),
        miso_(core.pin("spi_miso")),
        drive_(core.pin("spi_miso_drive")) {
    const int managers = core.parameter("syncManagers");
    fastest_ = core.period() * (managers > 8 ? 6 : managers > 4 ? 5 : 4);
    bit_ = fastest_;
  }

  void rest() override {
    sel_.set(!selHigh_), clk_.set(mode_ >= 2), mosi_.set(0);
    core_.settle();
  }
  int64_t eventsSeen() const override { return events_; }

  void read(unsigned address, uint8_t* data, unsigned length) override {
    begin();
    const bool pause = hurries_ || random_.once(2);
    head(address, pause ? kReadWithPause : kRead);
    if (pause) byte(0xff);
    else core_.wait(core_.period() * static_cast<Time>(some(120, 200)));
    // The first bit says whether it is the last byte; the others say nothing.
    for (unsigned i = 0; i < length; ++i)
      data[i] = byte(static_cast<uint8_t>((i + 1 == length ? 0x80 : 0) | random_.below(0x80)));
    end();
  }

  void write(unsigned address, const uint8_t* data, unsigned length) override {
    begin();
    head(address, kWrite);
    for (unsigned i = 0; i < length; ++i) byte(data[i]);
    end();
  }

  Bad bad(unsigned address) override {
    switch (random_.below(8)) {
      case 0: return glitch();
      case 1: return deselected();
      case 2: return tooFast(address);
      default: return aborted(address);
    }
  }

 private:
  void begin() {
    bit_ = hurries_ ? fastest_ : fastest_ + random_.below(random_.once(4) ? 200000 : 3000);
    sel_.set(selHigh_);
    core_.wait(core_.period() * static_cast<Time>(some(1, 4)) + random_.below(core_.period()) + bit_ / 2);
    if (drive_.get() != 1) throw Wrong("MISO is not driven");
  }
  void end() {
    core_.wait(bit_ / 2);
    mosi_.set(random_.below(2));
    sel_.set(!selHigh_);
    core_.settle();
    if (drive_.get()) throw Wrong("MISO is driven though not selected");
    core_.wait(core_.period() * static_cast<Time>(some(5, 12)) + random_.below(core_.period()));
  }
  bool bit(bool mosi) {
    const bool rest = mode_ >= 2, first = mode_ % 2 ? !rest : rest;
    // In modes 1 and 3 bits change with the first edge, in the others half a clock before it.
    mosi_.set(mosi), clk_.set(first);
    core_.wait(bit_ / 2);
    const bool early = miso_.get();
    clk_.set(!first);
    core_.wait(bit_ - bit_ / 2);
    return late_ ? miso_.get() : early;
  }
  uint8_t byte(unsigned value, int bits = 8) {
    unsigned in = 0;
    for (int i = 7; i >= 8 - bits; --i) in = in << 1 | bit(value >> i & 1);
    // Back to rest, if the host waits.
    clk_.set(mode_ >= 2);
    return static_cast<uint8_t>(in);
  }
  static std::vector<uint8_t> headOf(unsigned address, unsigned command, bool extended) {
    const auto low = [&](unsigned c) { return static_cast<uint8_t>((address & 0x1f) << 3 | c); };
    const auto high = static_cast<uint8_t>(address >> 5);
    if (!extended) return {high, low(command)};
    return {high, low(kExtension), static_cast<uint8_t>((address >> 8 & 0xe0) | command << 2)};
  }
  void head(unsigned address, unsigned command) {
    const std::vector<uint8_t> bytes = headOf(address, command, address > 0x1fff || some(0, 3) == 3);
    events_ = 0;
    for (size_t i = 0; i < bytes.size(); ++i) events_ |= static_cast<int64_t>(byte(bytes[i])) << (8 * i);
    if (bytes.size() == 2) events_ |= int64_t{1} << 32;  // two bytes of them only
  }

  // Selected for a moment, without a clock.
  Bad glitch() {
    sel_.set(selHigh_);
    core_.wait(random_.below(20 * static_cast<unsigned>(core_.period())) + 1);
    sel_.set(!selHigh_);
    core_.wait(core_.period() * 5 + random_.below(20000));
    return {"select without a clock", 0, 0, 0, 0, {}};
  }
  // The clock of another slave.
  Bad deselected() {
    bit_ = fastest_;
    for (int i = random_.range(1, 40); i > 0; --i) bit(random_.below(2));
    clk_.set(mode_ >= 2);
    core_.wait(core_.period());
    return {"clock without select", 0, 0, 0, 0, {}};
  }
  // A clock of 110 % of the limit: what is wrong is counted.
  Bad tooFast(unsigned address) {
    begin();
    bit_ = fastest_ * 10 / 11;
    const uint8_t value = random_.byte();
    const bool write = random_.once(2);
    for (uint8_t b : headOf(address, write ? kWrite : kReadWithPause, false)) byte(b);
    if (!write) byte(0xff);
    byte(write ? value : 0xff);
    end();
    Bad bad{"clock at 110 %", 0, 1, 0, 0, {}};
    if (write) bad.written.push_back({address, value, false});
    return bad;
  }

  // Any bytes, ended behind any bit.
  Bad aborted(unsigned address) {
    const bool extended = random_.once(2);
    const unsigned commands[] = {kRead, kReadWithPause, kWrite, kWrite, random_.below(8)};
    unsigned command = commands[random_.below(5)];
    if (command == kExtension) command = 0;
    std::vector<uint8_t> bytes = headOf(address, command, extended);
    const size_t header = bytes.size();
    for (int i = 0; i < 4; ++i) bytes.push_back(random_.byte());
    const unsigned bits = random_.below(static_cast<unsigned>(8 * bytes.size() + 1));
    Bad bad{"ended behind a bit", 0, 0, 0, 0xffff, {}};
    begin();
    for (size_t i = 0; 8 * i < bits; ++i) byte(bytes[i], static_cast<int>(std::min<size_t>(8, bits - 8 * i)));
    end();

    const size_t whole = bits / 8;
    const bool known = whole >= header;
    bad.code = static_cast<uint16_t>(bits % 8);
    if (whole >= 2) bad.code |= static_cast<uint16_t>((known ? command : +kExtension) >> 1 << 6);
    if (command == kWrite)
      for (size_t i = header; i < whole; ++i)
        bad.written.push_back({static_cast<unsigned>(address + i - header), bytes[i], true});
    if (known && (command == kRead || command == kReadWithPause)) {
      bool terminated = false, over = false, beyond = false;
      for (size_t i = header + (command == kReadWithPause); 8 * i < bits; ++i) {
        beyond |= over;
        terminated |= bytes[i] >> 7;
        if (8 * i + 8 <= bits) over = terminated;
      }
      bad.code |= static_cast<uint16_t>((!terminated) << 4 | beyond << 5);
      // Without a pause the first byte comes too early.
      if (command == kRead && bits > 8 * header) bad.code |= 8, bad.known &= ~8;
    }
    bad.most = (bad.code & 0x3f) != 0;
    bad.least = (bad.code & 0x3f & bad.known) != 0;
    return bad;
  }

  const int mode_;
  const bool late_, selHigh_;
  Time fastest_, bit_;
  int64_t events_ = 0;
  WidePin &sel_, &clk_, &mosi_, &miso_, &drive_;
};

}  // namespace

std::unique_ptr<Host> makeSpi(Core& core, Random& random) { return std::make_unique<SpiHost>(core, random); }

}  // namespace hosts

// Hosts by the core's clock, one access at a time: the plain port, Avalon-MM, Wishbone B4.
#include "hosts/host.h"

namespace hosts {
namespace {

constexpr int kLongest = 20000;  // core cycles that an access may take

class ClockedHost : public WordHost {
 public:
  using WordHost::WordHost;
  void rest() override { idle(); }

 protected:
  virtual void ask(bool write, unsigned word, uint32_t data, unsigned enables) = 0;
  virtual void idle() = 0;
  virtual bool done() = 0;
  virtual uint32_t data() = 0;

  uint32_t access(bool write, unsigned word, uint32_t value, unsigned enables) override {
    ask(write, word, value, enables);
    for (int i = 0; i < kLongest; ++i) {
      core_.toEdge();
      const bool is = done();
      const uint32_t read = is ? data() : 0;
      core_.edge();
      if (!is) continue;
      idle();
      pause();
      return read;
    }
    throw Wrong("an access is not answered");
  }
  // Between two accesses.
  virtual void pause() { core_.cycle(random_.once(3) ? some(0, 3) : 0); }

  // The pins as they are stand for so many cycles or until the answer; then they change. Whether it came.
  bool cut(int cycles) {
    bool is = false;
    for (int i = 0; i < cycles && !is; ++i) {
      core_.toEdge();
      is = done();
      core_.edge();
    }
    // What stands there now counts for nothing.
    ask(false, random_.below(0x4000), random_.below(0x10000), enablesAtRandom());
    idle();
    core_.cycle(random_.range(1, 3));
    return is;
  }
  unsigned enablesAtRandom() { return random_.below(1u << lanes()); }
  // Withdrawn somewhere: it is carried out as it began.
  Bad withdrawn(unsigned address, uint16_t code) {
    const bool write = random_.once(2);
    const uint8_t value = random_.byte();
    core_.cycle();
    ask(write, wordOf(address), inLane(address, value), enableOf(address));
    const bool answered = cut(random_.range(1, 40));
    Bad bad{write ? "write withdrawn" : "read withdrawn", !answered, !answered, code, 0xffff, {}};
    if (write) bad.written.push_back({address, value, true});
    return bad;
  }
  Bad nothing(unsigned address) {
    access(random_.once(2), wordOf(address), random_.below(0x10000), 0);
    return {"no byte enabled", 0, 0, 0, 0, {}};
  }
};

class PortHost : public ClockedHost {
 public:
  using ClockedHost::ClockedHost;
  bool counts() const override { return false; }
  Bad bad(unsigned address) override { return nothing(address); }

 protected:
  void ask(bool write, unsigned word, uint32_t value, unsigned enables) override {
    Pins& p = core_.pins();
    // The bits within a word are ignored.
    *p.hostAddr = static_cast<SData>(word * lanes() + random_.below(lanes()));
    *p.hostReq = 1, *p.hostWrite = write, *p.hostBe = static_cast<CData>(enables);
    p.hostWdata.set(value);
  }
  void idle() override { *core_.pins().hostReq = 0; }
  bool done() override { return *core_.pins().hostAck; }
  uint32_t data() override { return core_.pins().hostRdata.get(); }
  void pause() override { core_.cycle(some(1, 3)); }
};

class AvalonHost : public ClockedHost {
 public:
  AvalonHost(Core& core, Random& random)
      : ClockedHost(core, random),
        address_(core.pin("avalon_address")),
        read_(core.pin("avalon_read")),
        write_(core.pin("avalon_write")),
        enables_(core.pin("avalon_byteenable")),
        out_(core.pin("avalon_writedata")),
        in_(core.pin("avalon_readdata")),
        wait_(core.pin("avalon_waitrequest")) {}

  Bad bad(unsigned address) override {
    if (random_.once(4)) return nothing(address);
    if (!random_.once(3)) return withdrawn(address, 2);
    // Read and write at once: it writes.
    const uint8_t value = random_.byte();
    core_.cycle();
    read_.set(1);
    both_ = true;
    access(true, wordOf(address), inLane(address, value), enableOf(address));
    both_ = false;
    return {"read and write at once", 1, 1, 1, 0xffff, {{address, value, true}}};
  }

 protected:
  void ask(bool write, unsigned word, uint32_t value, unsigned enables) override {
    address_.set(word), enables_.set(enables), out_.set(value);
    read_.set(!write || both_), write_.set(write);
  }
  void idle() override { read_.set(0), write_.set(0); }
  bool done() override { return !wait_.get(); }
  uint32_t data() override { return in_.get(); }

 private:
  WidePin &address_, &read_, &write_, &enables_, &out_, &in_, &wait_;
  bool both_ = false;
};

class WishboneHost : public ClockedHost {
 public:
  WishboneHost(Core& core, Random& random)
      : ClockedHost(core, random),
        cycle_(core.pin("wb_cyc")),
        strobe_(core.pin("wb_stb")),
        write_(core.pin("wb_we")),
        address_(core.pin("wb_adr")),
        enables_(core.pin("wb_sel")),
        out_(core.pin("wb_dat_w")),
        in_(core.pin("wb_dat_r")),
        ack_(core.pin("wb_ack")),
        stall_(core.pin("wb_stall")) {}

  Bad bad(unsigned address) override {
    if (random_.once(4)) return nothing(address);
    if (!random_.once(3)) return withdrawn(address, 2);
    // A strobe without a cycle, or the other way round, asks for nothing.
    core_.cycle();
    ask(true, wordOf(address), random_.below(0x10000), enableOf(address));
    (random_.once(2) ? cycle_ : strobe_).set(0);
    for (int i = random_.range(1, 12); i > 0; --i) {
      core_.toEdge();
      if (ack_.get()) throw Wrong("an answer that nobody has asked for");
      core_.edge();
    }
    idle();
    return {"strobe without cycle", 0, 0, 0, 0, {}};
  }

 protected:
  void ask(bool write, unsigned word, uint32_t value, unsigned enables) override {
    cycle_.set(1), strobe_.set(1), write_.set(write);
    address_.set(word), enables_.set(enables), out_.set(value);
  }
  // Now and then the cycle goes on.
  void idle() override { cycle_.set(random_.once(2)), strobe_.set(0); }
  bool done() override {
    if (ack_.get() == stall_.get()) throw Wrong("a pipelined master would ask a second time");
    return ack_.get();
  }
  uint32_t data() override { return in_.get(); }

 private:
  WidePin &cycle_, &strobe_, &write_, &address_, &enables_, &out_, &in_, &ack_, &stall_;
};

}  // namespace

std::unique_ptr<Host> makePort(Core& core, Random& random) {
  return std::make_unique<PortHost>(core, random);
}
std::unique_ptr<Host> makeAvalon(Core& core, Random& random) {
  return std::make_unique<AvalonHost>(core, random);
}
std::unique_ptr<Host> makeWishbone(Core& core, Random& random) {
  return std::make_unique<WishboneHost>(core, random);
}

}  // namespace hosts

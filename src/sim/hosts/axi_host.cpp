// A manager of AXI4-Lite: channels begin in any order, answers are taken sooner or later.
#include "hosts/host.h"

namespace hosts {
namespace {

constexpr int kLongest = 20000;

// Valid and ready of a channel that the host asks by.
struct Channel {
  WidePin &valid, &ready;
  bool taken = false;  // taken at the last edge
};

class AxiHost : public WordHost {
 public:
  AxiHost(Core& core, Random& random)
      : WordHost(core, random),
        aw_{core.pin("axi_awvalid"), core.pin("axi_awready")},
        w_{core.pin("axi_wvalid"), core.pin("axi_wready")},
        ar_{core.pin("axi_arvalid"), core.pin("axi_arready")},
        bValid_(core.pin("axi_bvalid")),
        bReady_(core.pin("axi_bready")),
        rValid_(core.pin("axi_rvalid")),
        rReady_(core.pin("axi_rready")) {}

  void rest() override {
    for (Channel* c : {&aw_, &w_, &ar_}) c->valid.set(0);
    bReady_.set(0), rReady_.set(0);
  }

  // One or two channels are withdrawn; what had begun is carried out and not answered.
  Bad bad(unsigned address) override {
    core_.cycle(2);
    const uint8_t value = random_.byte();
    const unsigned which = random_.range(1, 4);  // 1 AW, 2 W, 3 both, 4 AR
    if (which & 1) askWrite(address);
    if (which & 2) askData(inLane(address, value), enableOf(address));
    if (which == 4) askRead(address);
    bool taken = false;
    for (int i = random_.range(1, 40); i > 0 && !taken; --i) taken = edge();
    rest();
    core_.pin("axi_wdata").set(random_.below(0x10000));
    core_.pin("axi_awaddr").set(random_.below(0x10000));
    Bad bad{"withdrawn " + std::to_string(which), !taken, !taken, static_cast<uint16_t>(which), 0xffff, {}};
    if (which == 3) bad.written.push_back({address, value, true});
    core_.cycle(random_.range(1, 3));
    if (taken) (which == 4 ? rReady_ : bReady_).set(1);
    for (int i = 0; taken && !(which == 4 ? rValid_ : bValid_).get(); ++i) {
      if (i > kLongest) throw Wrong("an answer does not come");
      core_.cycle();
    }
    core_.cycle();
    rest();
    return bad;
  }

 protected:
  uint32_t access(bool write, unsigned word, uint32_t value, unsigned enables) override {
    const unsigned address = word * lanes() + random_.below(hurries_ ? 1 : lanes());
    WidePin& valid = write ? bValid_ : rValid_;
    WidePin& ready = write ? bReady_ : rReady_;
    int begins[2] = {some(0, 3), some(0, 3)}, takes = some(0, 4);
    if (!random_.once(3)) begins[0] = begins[1] = 0;
    for (int i = 0; i < kLongest; ++i) {
      if (i == begins[0]) write ? askWrite(address) : askRead(address);
      if (write && i == begins[1]) askData(value, enables);
      if (i >= takes) ready.set(1);
      core_.toEdge();
      const bool is = valid.get() && ready.get();
      const bool open = (write ? aw_ : ar_).valid.get() || w_.valid.get();
      if (valid.get() && (open || i < begins[0] || (write && i < begins[1])))
        throw Wrong("an answer before its request");
      const uint32_t read = core_.pin("axi_rdata").get();
      if (is && (write ? core_.pin("axi_bresp") : core_.pin("axi_rresp")).get()) throw Wrong("not OKAY");
      handshakes();
      core_.edge();
      drop();
      if (!is) continue;
      ready.set(0);
      core_.cycle(random_.once(3) ? some(0, 3) : 0);
      return read;
    }
    throw Wrong("an access is not answered");
  }

 private:
  void askWrite(unsigned address) { core_.pin("axi_awaddr").set(address), aw_.valid.set(1); }
  void askRead(unsigned address) { core_.pin("axi_araddr").set(address), ar_.valid.set(1); }
  void askData(uint32_t value, unsigned enables) {
    core_.pin("axi_wdata").set(value), core_.pin("axi_wstrb").set(enables), w_.valid.set(1);
  }
  // What has been taken at an edge falls behind it.
  bool handshakes() {
    bool any = false;
    for (Channel* c : {&aw_, &w_, &ar_}) c->taken = c->valid.get() && c->ready.get(), any |= c->taken;
    return any;
  }
  void drop() {
    for (Channel* c : {&aw_, &w_, &ar_})
      if (c->taken) c->valid.set(0);
  }
  bool edge() {
    core_.toEdge();
    const bool any = handshakes();
    core_.edge();
    drop();
    return any;
  }

  Channel aw_, w_, ar_;
  WidePin &bValid_, &bReady_, &rValid_, &rReady_;
};

}  // namespace

std::unique_ptr<Host> makeAxiLite(Core& core, Random& random) {
  return std::make_unique<AxiHost>(core, random);
}

}  // namespace hosts

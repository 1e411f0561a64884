#include "core/slave.h"

#include <algorithm>

#include "core/user_error.h"

void Cable::nibble(Time launch, Symbol symbol) {
  // The recovered clock has the sender's period, known once two nibbles have come. A gap (a held clock) is no
  // period.
  if (lastLaunch_ >= 0 && launch - lastLaunch_ < 2 * kNibble) half_ = (launch - lastLaunch_) / 2;
  lastLaunch_ = launch;
  arrivals_.push_back({launch + delay_, cut_ ? Symbol{} : symbol});
  if (slave_) slave_->next = std::min(slave_->next, nextEdge());
}

void Cable::arrive(Time now) {
  for (; !arrivals_.empty() && arrivals_.front().at <= now; arrivals_.pop_front())
    rmii_->arrive(arrivals_.front().symbol);
}

void RmiiPhy::arrive(Symbol symbol) {
  if (!symbol.idle() || !last_.idle()) kept_.push_back(symbol);
  last_ = symbol;
}

void RmiiPhy::half(const PortPins& pins) {
  constexpr size_t kKept = 3;  // nibbles; the longest frame slips by less than one
  second_ = !second_;
  if (!second_) {
    reads_ = !kept_.empty() && (reads_ || kept_.size() >= kKept || last_.idle());
    now_ = reads_ ? kept_.front() : Symbol{};
    if (reads_) kept_.pop_front();
    reads_ = reads_ && !now_.idle();
  }
  *pins.rxDv = last_.dv || (now_.dv && second_);
  *pins.rxEr = now_.er;
  *pins.rxd = now_.dv ? now_.data >> (second_ ? 2 : 0) & 3 : 0;
}

Slave::Slave(const Preset& preset, VerilatedContext& context, const std::string& name, double ppm, Time phase)
    : preset_(preset),
      model_(preset.make(context, name)),
      pins_(model_->pins),
      ports_(preset.info.ports),
      half_(periodOf(preset.info.coreClockMhz, ppm) / 2),
      coreNext_(phase) {
  if (!pins_.host.empty())
    throw UserError("the preset '" + preset.info.name +
                    "' has a host interface that only flyframe-hosts drives.");
  for (Cable& c : receivers_) c.slave_ = this;
  if (pins_.digitalEnable) *pins_.digitalEnable = 1;
  for (OpticalPins& o : pins_.optical)
    if (o.signal) *o.signal = 1;
  if (pins_.canRx) *pins_.canRx = 1;
  if (pins_.optical[0].rx) eager_ = samplesTwice();
  for (int y = 0; y < ports_; ++y) {
    if (!pins_.ports[y].rmii) continue;
    hasRmii_ = true;
    receivers_[y].rmii_ = &rmii_[y];
  }
  eval();
  schedule();
}

void Slave::eval() {
  model_->eval();
  unseenLow_ = 0;
}

void Slave::setLink(int port, bool up) { *pins_.ports[port].link = up, unseenLow_ |= 1; }
void Slave::setReset(bool active) { *pins_.reset = active, unseenLow_ |= 1; }
void Slave::setPdiOperational(bool on) {
  if (pins_.pdiOperational) *pins_.pdiOperational = on, unseenLow_ |= 1;
}

void Slave::setHost(std::unique_ptr<Host> host) {
  hostProgram_ = std::move(host);
  if (port_ == HostPort::requested) {
    *pins_.hostReq = 0, unseenLow_ |= 1;
    port_ = HostPort::recover;
  }
  if (hostProgram_) hostProgram_->attach(*this);
}

void Slave::setEeprom(std::unique_ptr<Eeprom> eeprom) {
  eeprom_ = std::move(eeprom);
  if (pins_.siiTwoByte) *pins_.siiTwoByte = eeprom_ && eeprom_->chip().addressBytes == 2;
  eepromLines_ = -1;
  eepromLines(coreNext_);
  unseenLow_ |= 1;
}

// Both lines have pull-ups; without a chip nobody but the core pulls.
void Slave::eepromLines(Time now) {
  const int lines = (*pins_.siiSclLow ? 1 : 0) | (*pins_.siiSdaLow ? 2 : 0);
  if (lines == eepromLines_) return;
  eepromLines_ = lines;
  const bool scl = !(lines & 1), coreSda = !(lines & 2);
  // A falling SCL may make the chip change SDA, which is no event for the chip itself.
  bool sda = coreSda;
  if (eeprom_) {
    eeprom_->lines(now, scl, coreSda && !eeprom_->sdaLow());
    sda = coreSda && !eeprom_->sdaLow();
    eeprom_->lines(now, scl, sda);
  }
  *pins_.siiSda = sda;
  unseenLow_ |= 1;
}

// It has a pull-up, and no PHY on it.
void Slave::managementLine() {
  const CData level = *pins_.miMdioEnable ? *pins_.miMdioOut : 1;
  if (*pins_.miMdioIn != level) *pins_.miMdioIn = level, unseenLow_ |= 1;
}

void Slave::hostAccess(uint16_t addr, bool write, uint32_t data, unsigned lanes) {
  *pins_.hostAddr = addr & ~(info().lanes() - 1);
  pins_.hostWdata.set(data);
  *pins_.hostBe = lanes;
  *pins_.hostWrite = write;
  *pins_.hostReq = 1;
  unseenLow_ |= 1;
  port_ = HostPort::requested;
}

void Slave::hostWriteByte(uint16_t addr, uint8_t value) {
  int lane = addr & (info().lanes() - 1);
  hostAccess(addr, true, uint32_t{value} << (8 * lane), 1u << lane);
}

void Slave::hostReadBytes(uint16_t addr, int count) {
  hostAccess(addr, false, 0, ((1u << count) - 1) << (addr & (info().lanes() - 1)));
}

void Slave::schedule() {
  next = coreNext_;
  for (int y = 0; y < ports_; ++y) next = std::min(next, receivers_[y].nextEdge());
}

// All edges of this slave at one time are one evaluation, as they are one moment for the RTL.
void Slave::step() {
  const Time now = next;
  const bool core = coreNext_ == now, coreRise = core && !*pins_.clock;
  unsigned rises = coreRise ? 1 : 0;
  bool fell = false;
  for (int y = 0; y < ports_; ++y) {
    Cable& rx = receivers_[y];
    if (rx.nextEdge() != now) continue;
    if (rx.rise_ == now) {
      rises |= 2u << y;
    } else {
      const PortPins& p = pins_.ports[y];
      const Symbol s = arriving_[y] = rx.arrivals_.front().symbol;
      rx.arrivals_.pop_front();
      rx.rise_ = now + rx.half_;
      *p.rxClk = 0, *p.rxDv = s.dv, *p.rxEr = s.er, *p.rxd = s.data;
      unseenLow_ |= 2u << y;
      fell = true;
    }
  }
  if (core && !coreRise) {
    *pins_.clock = 0;
    unseenLow_ |= 1;
    if (pins_.optical[0].rx && eager_) lightIn(now);
    coreNext_ += half_;
    fell = true;
  }
  if ((unseenLow_ & rises) || (eager_ && fell)) eval();
  if (rises) {
    for (int y = 0; y < ports_; ++y)
      if (rises & (2u << y)) {
        *pins_.ports[y].rxClk = 1;
        receivers_[y].rise_ = kNever;
        sampled(y, now, arriving_[y]);
      }
    if (rises & 1) coreEdge(now);
    else eval();
  }
  schedule();
}

// The reference clock of RMII ports has two periods per nibble and rises with the core clock. Half nibbles
// change where it falls.
void Slave::rmiiHalves(Time now) {
  const int period = preset_.info.cyclesPerNibble / 2;
  const bool falls = period == 1 || cycles_ % period == 1, rises = period == 1 || !falls;
  const auto forRmii = [&](auto act) {
    for (int y = 0; y < ports_; ++y)
      if (pins_.ports[y].rmii) act(y, pins_.ports[y]);
  };
  if (falls)
    forRmii([&](int y, const PortPins& p) {
      receivers_[y].arrive(now);
      *p.rxClk = 0;
      rmii_[y].half(p);
    });
  if (falls && rises) model_->eval();
  if (rises)
    forRmii([&](int y, const PortPins& p) {
      *p.rxClk = 1;
      if (const Symbol* s = rmii_[y].sampled()) sampled(y, now, *s);
    });
}

void Slave::sampled(int port, Time now, Symbol symbol) {
  if (symbol.dv && !receives_[port]) arrivals_[port] = now;
  receives_[port] = symbol.dv;
  if (onSample) onSample(port, now, symbol);
}

void Slave::syncSignals(Time now) {
  for (size_t n = 0; n < syncs_.size(); ++n) {
    if (!pins_.sync[n] || syncs_[n] == (*pins_.sync[n] != 0)) continue;
    syncs_[n] = !syncs_[n];
    if (onSync) onSync(static_cast<int>(n), syncs_[n], now);
  }
}

void Slave::send(int port, Time now, Symbol symbol) {
  if (symbol.dv) lastActive_ = now;
  if (sinks_[port] && (symbol.dv || !muted_)) sinks_[port]->nibble(now, symbol);
}

void Slave::idleUntil(Time end) {
  muted_ = true;
  while (next < end) step();
  muted_ = false;
}

void Slave::idleUntilSending(Time end) {
  muted_ = true;
  const Time before = lastActive_;
  while (next < end && lastActive_ == before) step();
  muted_ = false;
}

std::optional<uint32_t> Slave::digitalOutputs() const {
  if (!pins_.digitalDriven || !*pins_.digitalDriven) return std::nullopt;
  return pins_.digitalOutput.get();
}

void Slave::setDigitalInputs(uint32_t levels) {
  if (!pins_.digitalInput.at || pins_.digitalInput.get() == levels) return;
  pins_.digitalInput.set(levels), unseenLow_ |= 1;
}

void Slave::setAlarmCurrent(unsigned comparators) {
  if (pins_.alarmCurrent) *pins_.alarmCurrent = static_cast<CData>(comparators), unseenLow_ |= 1;
}

void Slave::setConfigurationFault(bool on) {
  if (pins_.alarmConfigFault) *pins_.alarmConfigFault = on, unseenLow_ |= 1;
}

// What comes to a ring node is sampled where its clock rises, with a slow one also where it falls (FR-03).
void Slave::lightIn(Time now) {
  for (size_t y = 0; y < light_.size(); ++y) {
    std::deque<LightEdge>& edges = light_[y];
    for (; !edges.empty() && edges.front().at <= now; edges.pop_front())
      *pins_.optical[y].rx = edges.front().level;
  }
  for (; !pairLevels_.empty() && pairLevels_.front().at <= now; pairLevels_.pop_front())
    *pins_.canRx = pairLevels_.front().level;
}

void Slave::lightOut(Time now) {
  for (size_t y = 0; y < lit_.size(); ++y) {
    const bool level = *pins_.optical[y].tx;
    if (lit_[y] == level) continue;
    lit_[y] = level;
    if (onLight) onLight(static_cast<int>(y), {now, level});
  }
  if (pins_.canTx && pair_ != (*pins_.canTx != 0)) {
    pair_ = !pair_;
    if (onPair) onPair({now, pair_});
  }
}

void Slave::levels(Time now) {
  unsigned all = 0;
  for (size_t i = 0; i < pins_.levels.size(); ++i) all |= unsigned{*pins_.levels[i]} << i;
  if (all != levels_) onLevels(now, all);
  levels_ = all;
}

void Slave::standStill(Time until) {
  if (*pins_.clock) step();
  const Time period = 2 * half_;
  if (until > coreNext_) coreNext_ += (until - coreNext_ + period - 1) / period * period;
  schedule();
}

void Slave::coreEdge(Time now) {
  // The host samples acknowledge and data at the edge, that is as they were before it, and changes its pins
  // after it.
  const bool acknowledged = port_ == HostPort::requested && *pins_.hostAck;
  if (acknowledged) hostResult_ = pins_.hostRdata.get();
  if (hasRmii_) rmiiHalves(now);
  if (pins_.optical[0].rx) lightIn(now);
  *pins_.clock = 1;
  eval();
  ++cycles_;
  coreNext_ = now + half_;
  if (acknowledged) {
    *pins_.hostReq = 0;
    unseenLow_ |= 1;
    port_ = HostPort::recover;
  } else if (port_ == HostPort::recover) {
    port_ = HostPort::idle;
  }
  if (hostProgram_ && cycles_ >= hostProgram_->wakeAt() && port_ == HostPort::idle) hostProgram_->resume();
  if (pins_.siiSclLow) eepromLines(now);
  if (pins_.miMdioIn) managementLine();
  if (pins_.sync[0]) syncSignals(now);
  if (wired_) setDigitalInputs(digitalOutputs().value_or(0));
  if (supplied_ != alarmSupply()) {
    supplied_ = !supplied_;
    if (onAlarmSupply) onAlarmSupply(supplied_);
  }
  if (pins_.optical[0].tx) lightOut(now);
  if (onLevels) levels(now);
  if (!pins_.txTick) return;
  const bool tick = *pins_.txTick, second = cycles_ == firstHalf_ + preset_.info.cyclesPerNibble / 2;
  for (int y = 0; y < ports_; ++y) {
    const PortPins& p = pins_.ports[y];
    if (p.rmii && second) send(y, now, rmii_[y].sent(p));
    if (p.rmii && cycles_ == firstHalf_) rmii_[y].firstSent(p);
    if (!p.rmii && tick) send(y, now, {*p.txEn != 0, false, *p.txd});
  }
  if (tick) firstHalf_ = cycles_ + 1;  // what is sent leaves a core cycle later than with MII
}

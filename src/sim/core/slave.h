// One simulated slave: a Verilated preset with its core clock, the receive clocks its PHYs recover, its
// EEPROM and its host.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <string>

#include "core/eeprom.h"
#include "core/host.h"
#include "core/model.h"
#include "core/simulator.h"

class Slave;

// One direction of a cable and the PHY at its end, which recovers RX_CLK from what arrives: data changes at
// the falling edge, half a nibble later it is sampled at the rising edge. RX_CLK runs for as long as the far
// end sends nibbles, idle ones included.
class Cable : public NibbleSink {
 public:
  void nibble(Time launch, Symbol symbol) override;
  void setDelay(Time delay) { delay_ = delay; }
  // A cut cable carries idle nibbles only.
  void setCut(bool cut) { cut_ = cut; }

 private:
  friend class Slave;
  struct Arrival {
    Time at;
    Symbol symbol;
  };
  Slave* slave_ = nullptr;
  Time delay_ = 0;
  bool cut_ = false;
  Time lastLaunch_ = -1;
  Time half_ = kNibble / 2;
  Time rise_ = kNever;  // the rising edge that follows the last falling one
  std::deque<Arrival> arrivals_;
  class RmiiPhy* rmii_ = nullptr;  // has no receive clock of its own: takes what has arrived when it looks
  void arrive(Time now);
  Time nextEdge() const {
    if (rmii_) return kNever;
    return rise_ != kNever ? rise_ : arrivals_.empty() ? kNever : arrivals_.front().at;
  }
};

// A PHY with RMII. Its reference clock is that of the slave, so it keeps some nibbles of what arrives: it
// knows of the carrier before it has data, and has data when the carrier has gone.
class RmiiPhy {
 public:
  void arrive(Symbol symbol);
  // Begins the next half of a nibble: sets the pins to it.
  void half(const PortPins& pins);
  // The nibble whose second half is at the pins; none in its first half.
  const Symbol* sampled() const { return second_ ? &now_ : nullptr; }
  // The first half of a nibble that leaves is at the pins; the second one is: the whole nibble.
  void firstSent(const PortPins& pins) { low_ = *pins.txd; }
  Symbol sent(const PortPins& pins) const {
    return {*pins.txEn != 0, false, static_cast<uint8_t>(low_ | *pins.txd << 2)};
  }

 private:
  std::deque<Symbol> kept_;
  Symbol now_{}, last_{};
  bool reads_ = false, second_ = true;
  uint8_t low_ = 0;
};

class Slave : public Actor {
 public:
  Slave(const Preset& preset, VerilatedContext& context, const std::string& name, double ppm, Time phase);

  const PresetInfo& info() const { return preset_.info; }
  Model& model() { return *model_; }
  Time corePeriod() const { return 2 * half_; }
  uint64_t cycles() const { return cycles_; }
  // When the core clock rises next.
  Time nextRise() const { return *pins_.clock ? coreNext_ + half_ : coreNext_; }

  // The PHY of a port; what is sent into it arrives at the port.
  Cable& receiver(int port) { return receivers_[port]; }
  // Where the nibbles of a port go.
  void connect(int port, NibbleSink& sink) { sinks_[port] = &sink; }
  void setLink(int port, bool up);
  // The error of its crystal from now on.
  void setPpm(double ppm) { half_ = periodOf(preset_.info.coreClockMhz, ppm) / 2; }
  void setReset(bool active);
  void setPdiOperational(bool on);
  // Evaluate every clock edge in its own step; needed for a readable trace, costs time.
  void setEager(bool eager) { eager_ = eager; }
  // The last time a port sent something.
  Time lastActive() const { return lastActive_; }

  // Runs the core alone, without receive clocks and nibbles, until `end`: for times at which nothing is on
  // any wire. EEPROM and host go on. Much faster than step().
  void idleUntil(Time end);
  // The same, but returns earlier, with `next` still to come, as soon as a port sends.
  void idleUntilSending(Time end);

  // The host port: one access at a time, `addr` is a byte address, the byte lanes follow from it.
  void hostWriteByte(uint16_t addr, uint8_t value);
  void hostReadBytes(uint16_t addr, int count);  // of one word
  // Any lanes of one word; data in their places.
  void hostAccess(uint16_t addr, bool write, uint32_t data, unsigned lanes);
  bool hostBusy() const { return port_ != HostPort::idle; }
  uint32_t hostResult() const { return hostResult_; }
  // The interrupt pin, or either of two; false if the core has none.
  bool irq() const { return (pins_.irq && *pins_.irq) || (pins_.ringIrq && *pins_.ringIrq); }
  bool hasSync() const { return pins_.sync[0] != nullptr; }
  // The program that from now on owns the host port; null for none. An access under way is given up.
  void setHost(std::unique_ptr<Host> host);
  Host* host() { return hostProgram_.get(); }

  // The EEPROM at the pins of a core that has such pins.
  bool takesEeprom() const { return pins_.hasEeprom(); }
  void setEeprom(std::unique_ptr<Eeprom> eeprom);
  Eeprom* eeprom() { return eeprom_.get(); }

  // Digital outputs, while they are driven.
  std::optional<uint32_t> digitalOutputs() const;
  // The levels of digital inputs; without effect where the core has none.
  void setDigitalInputs(uint32_t levels);
  // The digital inputs are connected to the outputs from now on: they are 0 while these are not driven.
  void wireDigital() { wired_ = true; }

  // The pins of an alarm slave or master; without effect, or false, where the core has not got them.
  void setAlarmCurrent(unsigned comparators);
  bool hasDetector() const { return pins_.alarmCurrent; }
  bool alarmSupply() const { return pins_.alarmSupply && *pins_.alarmSupply; }
  bool alarmBuzzer() const { return pins_.alarmBuzzer && *pins_.alarmBuzzer; }
  bool alarmLamp() const { return pins_.alarmLamp && *pins_.alarmLamp; }
  bool alarmFire() const { return pins_.alarmFire && *pins_.alarmFire; }
  // The pin is low then.
  bool alarmFault() const { return pins_.alarmFaultN && !*pins_.alarmFaultN; }
  bool alarmDisabled() const { return pins_.alarmDisabled && *pins_.alarmDisabled; }
  bool alarmSounder() const { return pins_.alarmSounder && *pins_.alarmSounder; }
  // What the device's checker of its configuration says.
  void setConfigurationFault(bool on);
  bool configurationFault() const { return pins_.alarmConfigFault && *pins_.alarmConfigFault; }
  // Called when the supply of the detector's line has been switched.
  std::function<void(bool on)> onAlarmSupply;

  // The optical ports of a ring node: edges that come, in order of time, and those that leave.
  struct LightEdge {
    Time at;
    bool level;
  };
  std::deque<LightEdge>& light(int port) { return light_[static_cast<size_t>(port)]; }
  std::function<void(int port, LightEdge)> onLight;
  // Of the transceiver on a twisted pair, likewise: levels that come, and those that leave.
  bool hasPair() const { return pins_.canTx != nullptr; }
  std::deque<LightEdge>& pairLevels() { return pairLevels_; }
  std::function<void(LightEdge)> onPair;
  // The levels inside a ring node, a bit for each in the order of Pins::levels: called when one has changed.
  std::function<void(Time, unsigned levels)> onLevels;
  static constexpr unsigned kNoLevels = ~0u;  // of a node without power
  void loseLevels(Time now) {
    levels_ = kNoLevels;
    if (onLevels) onLevels(now, levels_);
  }
  // The optional pin by which an optical module says that it has light.
  void setOpticalSignal(int port, bool on) {
    *pins_.optical[static_cast<size_t>(port)].signal = on, unseenLow_ |= 1;
  }
  // A ring node without power: its clock, between two of its periods, stands still until then.
  void standStill(Time until);
  // With a slow clock a ring node samples light at both edges.
  bool samplesTwice() const { return preset_.info.coreClockMhz < 100; }

  // Called at each rising edge of a port's receive clock with the symbol sampled there.
  std::function<void(int port, Time, Symbol)> onSample;
  // Called when a SYNC signal has changed.
  std::function<void(int signal, bool level, Time)> onSync;
  // When the first nibble of the last frame came to a port.
  Time arrival(int port) const { return arrivals_[port]; }

  void step() override;

 private:
  friend class Cable;
  enum class HostPort { idle, requested, recover };

  void eepromLines(Time now);
  void managementLine();
  void coreEdge(Time now);
  void send(int port, Time now, Symbol symbol);
  void sampled(int port, Time now, Symbol symbol);
  void syncSignals(Time now);
  void rmiiHalves(Time now);
  void lightIn(Time now);
  void lightOut(Time now);
  void levels(Time now);
  void schedule();
  void eval();

  const Preset& preset_;
  std::unique_ptr<Model> model_;
  Pins& pins_;
  int ports_;
  Time half_, coreNext_;
  uint64_t cycles_ = 0;
  Time lastActive_ = 0;
  std::array<Cable, 4> receivers_;
  std::array<Symbol, 4> arriving_{};
  std::array<Time, 4> arrivals_{};
  std::array<bool, 4> receives_{};
  std::array<bool, 2> syncs_{};
  std::array<std::deque<LightEdge>, 2> light_;
  std::array<bool, 2> lit_{};
  std::deque<LightEdge> pairLevels_;
  bool pair_ = true;
  unsigned levels_ = 0;
  std::array<RmiiPhy, 4> rmii_;
  bool hasRmii_ = false;
  uint64_t firstHalf_ = 0;  // core cycle in which the first half of a nibble is at the pins of RMII ports
  std::array<NibbleSink*, 4> sinks_{};
  // Falling edges do nothing in the RTL, so they are evaluated together with the next rising edge of another
  // clock. A clock whose low level the model has not seen yet has its bit set: bit 0 the core clock, bit 1 +
  // y the receive clock of port y.
  unsigned unseenLow_ = 0;
  bool eager_ = false, muted_ = false, supplied_ = false, wired_ = false;
  HostPort port_ = HostPort::idle;
  uint32_t hostResult_ = 0;
  std::unique_ptr<Host> hostProgram_;
  std::unique_ptr<Eeprom> eeprom_;
  int eepromLines_ = -1;  // what the core did to the lines: bit 0 SCL low, bit 1 SDA low
};

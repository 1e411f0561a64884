// The Verilated presets behind one type: their pins as pointers, and how to evaluate and trace them.
#pragma once

#include <verilated.h>

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

class VerilatedFstC;

// What the generator wrote about a preset (generated/<preset>.json).
struct PresetInfo {
  std::string name;
  int ports, cyclesPerNibble, coreClockMhz, dataBusWidth;
  bool hasHost;  // a plain host port
  std::map<std::string, int> parameters;
  int lanes() const { return dataBusWidth / 8; }
};

// Pins of a preset that are up to 8, 16 or 32 bits wide: data of the host, digital outputs and inputs.
struct WidePin {
  void* at = nullptr;
  int bytes = 1;
  void bind(CData* p) { at = p, bytes = 1; }
  void bind(SData* p) { at = p, bytes = 2; }
  void bind(IData* p) { at = p, bytes = 4; }
  uint32_t get() const {
    return bytes == 1   ? *static_cast<CData*>(at)
           : bytes == 2 ? *static_cast<SData*>(at)
                        : *static_cast<IData*>(at);
  }
  void set(uint32_t v) {
    if (bytes == 1) *static_cast<CData*>(at) = v;
    else if (bytes == 2) *static_cast<SData*>(at) = v;
    else *static_cast<IData*>(at) = v;
  }
};

// With RMII rxClk is the reference clock, and rxDv is CRS_DV.
struct PortPins {
  CData *rxClk, *rxDv, *rxEr, *rxd, *link, *txEn, *txd;
  bool rmii;
};

// Of an optical module of a ring node.
struct OpticalPins {
  CData *rx = nullptr, *signal = nullptr, *tx = nullptr;
};

struct Pins {
  CData *clock, *reset;
  CData* txTick;  // null where there is no port with MII
  CData *hostReq, *hostWrite, *hostBe, *hostAck;
  SData* hostAddr;
  WidePin hostWdata, hostRdata;
  std::map<std::string, WidePin> host;  // of the other host interfaces, by their names
  std::array<PortPins, 4> ports;
  // Pins that not every core has; null where it has not. Those of the host neither.
  WidePin digitalOutput, digitalInput;
  CData *digitalDriven, *digitalEnable;
  CData *pdiOperational, *irq, *ringIrq;
  CData *siiSclLow, *siiSdaLow, *siiSda, *siiTwoByte;
  CData *miMdioIn, *miMdioOut, *miMdioEnable;
  std::array<CData*, 2> sync;
  CData *alarmCurrent, *alarmSupply, *alarmBuzzer, *alarmLamp;
  CData *alarmFire, *alarmFaultN, *alarmDisabled, *alarmSounder, *alarmConfigFault;
  std::array<OpticalPins, 2> optical;
  CData *canRx, *canTx;                // of the transceiver on a twisted pair
  std::array<const CData*, 6> levels;  // inside a ring node: bus, drive, R1, R2, T1, T2
  bool hasEeprom() const { return siiSclLow && siiSdaLow && siiSda; }
};

// One instance of a preset.
class Model {
 public:
  virtual ~Model() = default;
  virtual void eval() = 0;
  virtual void trace(VerilatedFstC& file) = 0;
  Pins pins{};
};

struct Preset {
  PresetInfo info;
  std::unique_ptr<Model> (*make)(VerilatedContext& context, const std::string& name);
};

// All presets linked into this program. The generated adapters enter themselves here before main().
std::vector<Preset>& builtInPresets();

// The preset of that name; a UserError that lists what is built in if there is none.
const Preset& findPreset(const std::string& name);

// The names of all presets built in, for messages.
std::string presetNames();

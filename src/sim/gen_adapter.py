#!/usr/bin/env python3
"""Writes the C++ adapter of one preset: it says which Verilated pin is which.

Usage: gen_adapter.py PRESET.json PRESET.v > adapter.cpp"""
import json
import re
import sys

# Pins that not every core has.
OPTIONAL_PINS = {
    "pdi_operational": "pdiOperational",
    "irq": "irq",
    "ring_irq": "ringIrq",
    "sii_scl_low": "siiSclLow",
    "sii_sda_low": "siiSdaLow",
    "sii_sda": "siiSda",
    "sii_two_byte": "siiTwoByte",
    "mi_mdio_in": "miMdioIn",
    "mi_mdio_out": "miMdioOut",
    "mi_mdio_enable": "miMdioEnable",
    "digital_output_driven": "digitalDriven",
    "digital_output_enable": "digitalEnable",
    "clock_signals_sync_0": "sync[0]",
    "clock_signals_sync_1": "sync[1]",
    "alarm_current": "alarmCurrent",
    "alarm_supply": "alarmSupply",
    "alarm_buzzer": "alarmBuzzer",
    "alarm_lamp": "alarmLamp",
    "alarm_fire": "alarmFire",
    "alarm_fault_n": "alarmFaultN",
    "alarm_disabled": "alarmDisabled",
    "alarm_sounder": "alarmSounder",
    "alarm_config_fault": "alarmConfigFault",
    "mii_tx_tick": "txTick",
    "optical_1_rx": "optical[0].rx",
    "optical_1_signal": "optical[0].signal",
    "optical_1_tx": "optical[0].tx",
    "optical_2_rx": "optical[1].rx",
    "optical_2_signal": "optical[1].signal",
    "optical_2_tx": "optical[1].tx",
    "can_rx": "canRx",
    "can_tx": "canTx",
}
# The same of those that are as wide as the parameters say.
WIDE_PINS = {"digital_output": "digitalOutput", "digital_input": "digitalInput"}
# Inside a ring node, where src/sim/ring/levels.vlt makes them readable, in the order of Pins::levels.
LEVELS = ["bus", "drive"] + [f"_ports_{y}_{what}" for what in ("report_level", "send") for y in (0, 1)]
# Of a plain host port: hostInterface 0. Pins of the others, by their names: flyframe-hosts drives them.
HOST_PINS = """    pins.hostReq = &v.host_req, pins.hostWrite = &v.host_write, pins.hostAddr = &v.host_addr;
    pins.hostBe = &v.host_be, pins.hostAck = &v.host_ack;
    pins.hostWdata.bind(&v.host_wdata), pins.hostRdata.bind(&v.host_rdata);
"""
# By the interface of the port's PHY, in the order of PortPins.
PORT_PINS = {
    "mii": ["rx_clk", "rx_dv", "rx_er", "rxd", "link", "tx_en", "txd"],
    "rmii": ["ref_clk", "crs_dv", "rx_er", "rxd", "link", "tx_en", "txd"],
}

with open(sys.argv[1]) as file:
    preset = json.load(file)
top = preset["top"]
with open(sys.argv[2]) as file:
    header = re.search(rf"^module\s+{top}\b.*?;", file.read(), re.M | re.S)
if not header:
    sys.exit(f"{sys.argv[2]} holds no module {top}.")
pins = set(re.findall(r"\w+", re.sub(r"//.*", "", header.group())))
has_host = "host_req" in pins
bus_pins = sorted(pin for pin in pins if re.match(r"(avalon|axi|wb|spi|bus)_", pin))
if not has_host and not bus_pins and preset["hostInterface"] != 6:
    sys.exit(f"{sys.argv[2]} has hostInterface {preset['hostInterface']} but no pins of one.")
# A master of a ring has one more than its parameter `ports` says.
links = (re.fullmatch(r"(r?mii)_(\d+)_link", pin) for pin in pins)
interfaces = {int(link.group(2)): link.group(1) for link in links if link}
ports = len(interfaces)
optional = "".join(f"    pins.{name} = &v.{pin};\n" for pin, name in OPTIONAL_PINS.items() if pin in pins)
optional += "".join(f"    pins.{name}.bind(&v.{pin});\n" for pin, name in WIDE_PINS.items() if pin in pins)
optional += "".join(f'    pins.host["{pin}"].bind(&v.{pin});\n' for pin in bus_pins)
if "optical_1_rx" in pins:
    inside = f"{top}__DOT__ring" if preset.get("role") == 2 else f"{top}__DOT__node__DOT__ring"
    levels = ", ".join(f"&v.rootp->{inside}__DOT__{name}" for name in LEVELS)
    optional += f"    pins.levels = {{{levels}}};\n"
if has_host:
    optional = HOST_PINS + optional
binds = "\n".join(
    f"    pins.ports[{y}] = {{"
    + ", ".join(f"&v.{kind}_{y}_{pin}" for pin in PORT_PINS[kind])
    + f", {str(kind == 'rmii').lower()}}};"
    for y, kind in sorted(interfaces.items())
)
numbers = [ports] + [preset[key] for key in ("cyclesPerNibble", "coreClockMhz", "dataBusWidth")]
parameters = ", ".join(f'{{"{name}", {value}}}' for name, value in preset.items() if isinstance(value, int))
info = f'"{preset["preset"]}", ' + ", ".join(map(str, numbers)) + f", {str(has_host).lower()}"
info += f", {{{parameters}}}"
root = f'#include "V{top}___024root.h"\n' if "optical_1_rx" in pins else ""
print(
    f"""// Made by gen_adapter.py from {preset["preset"]}.json.
#include <verilated_fst_c.h>

#include <stdexcept>

#include "V{top}.h"
{root}#include "core/model.h"

namespace {{
class Adapter : public Model {{
 public:
  Adapter(VerilatedContext& context, const std::string& name) : v(&context, name.c_str()) {{
    pins.clock = &v.clock, pins.reset = &v.reset;
{optional}{binds}
  }}
  ~Adapter() override {{ v.final(); }}
  void eval() override {{ v.eval(); }}
#if COSIM_TRACE
  void trace(VerilatedFstC& file) override {{ v.trace(&file, 99); }}
#else
  void trace(VerilatedFstC&) override {{
    throw std::runtime_error("this program is built without waveforms (COSIM_TRACE=0).");
  }}
#endif

 private:
  V{top} v;
}};

const bool registered = [] {{
  builtInPresets().push_back(
      {{{{{info}}},
       [](VerilatedContext& context, const std::string& name) -> std::unique_ptr<Model> {{
         return std::make_unique<Adapter>(context, name);
       }}}});
  return true;
}}();
}}  // namespace"""
)

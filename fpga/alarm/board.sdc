# Timing constraints of the alarm board. What every controller has (MII, its crossings) is in ../flyframe.sdc.

# ---- What to adapt -----------------------------------------------------------------------------------------
if {![info exists core_mhz]} { set core_mhz 100 }   ;# coreClockMhz; alarm.tcl sets it as generated
set tx_shift   0        ;# parameter txShift of the generator
set core_port  ""
set core_clock {pll|auto_generated|pll1|clk[0]}

# When a PHY's TX_CLK rises at the FPGA after the PLL's 25 MHz rises: output buffer, board, PHY (data sheet),
# modulo 40 ns.
set tx_clk_ns  0.0

# With RMII: when the 50 MHz rises at the PHYs after the PLL's 25 MHz rises (its phase in board.v, output
# buffer, board), and when the clock rises that takes RXD in the FPGA, modulo 20 ns.
set ref_clk_ns 13.0
set capture_ns 15.0
set rmii_clock {pll|auto_generated|pll1|clk[3]}

# ---- Clocks and controller ---------------------------------------------------------------------------------
create_clock -name clk_50 -period 20 [get_ports clk_50]
source [file join [file dirname [info script]] .. flyframe.sdc]

# The PHYs' clock: what comes back is a virtual clock, mii_tx_clk or rmii_clk.
set_false_path -to [get_ports phy_clk]

# ---- Host bus ----------------------------------------------------------------------------------------------
# MemoryBusCrossing. The strobes pass two flip-flops and are compared once: an access is taken three core
# cycles after the first of them sees it, at 100 MHz 30 ns. Address, byte enables and data have 15 ns of these
# from their pins; the other 15 ns are for the host, which may give them later than the strobe. The strobes
# have 8 ns, so that they do not come too differently. A slower core clock takes later, and the host is not
# asked for more: the limits stay.
set strobes [get_ports {bus_ne bus_noe bus_nwe}]
set meta    [get_registers -compatibility_mode {*MemoryBusCrossing:*|meta_*}]
set_max_delay -from $strobes -to $meta 8
set_false_path -hold -from $strobes
set payload [get_ports {bus_a* bus_d* bus_nbl*}]
set taken   [get_registers -compatibility_mode {*MemoryBusCrossing:*|taken_*}]
set_max_delay -from $payload -to $taken 15
set_false_path -hold -from $payload -to $taken

# Towards the host nothing is clocked: read data and wait change with the core clock, and with the pins. Both
# have the same limit, whatever the clock: read data are there when the host sees wait end.
set answer [get_ports {bus_d* bus_nwait}]
set states [get_registers -compatibility_mode {
  *MicrocontrollerInterface:*|readData* *MicrocontrollerInterface:*|released
}]
set_max_delay -from $states -to $answer 15
set_max_delay -from [get_ports {bus_ne bus_noe}] -to $answer 15
set_false_path -hold -to $answer

# ---- Levels ------------------------------------------------------------------------------------------------
set_false_path -from [get_ports {host_ready alarm_current*}]
set_false_path -from [get_ports -nowarn config_error]
set_false_path -to [get_ports {phy_reset_n irq alarm_supply alarm_buzzer alarm_lamp}]
set_false_path -to [get_ports -nowarn alarm_disabled]

# ResetCrossing: begins without a clock.
set_false_path -to [get_pins -compatibility_mode {*ResetCrossing:*|*|clrn}]

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

# ---- Host bus and reset ------------------------------------------------------------------------------------
source [file join [file dirname [info script]] .. host_bus.sdc]

# ---- Levels ------------------------------------------------------------------------------------------------
set_false_path -from [get_ports {host_ready alarm_current*}]
set_false_path -from [get_ports -nowarn config_error]
set_false_path -to [get_ports {phy_reset_n irq alarm_supply alarm_buzzer alarm_lamp}]
set_false_path -to [get_ports -nowarn alarm_disabled]

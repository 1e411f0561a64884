# Timing constraints of the ring board. What every controller has (MII, optical ports, its crossings) is in
# ../flyframe.sdc.

# ---- What to adapt -----------------------------------------------------------------------------------------
if {![info exists core_mhz]} { set core_mhz 100 }   ;# coreClockMhz; ring.tcl sets it as generated
set tx_shift   0        ;# parameter txShift of the generator
set core_port  ""
set core_clock {pll|auto_generated|pll1|clk[0]}

# When a PHY's TX_CLK rises at the FPGA after the PLL's 25 MHz rises: output buffer, board, PHY (data sheet),
# modulo 40 ns.
set tx_clk_ns  0.0

# ---- Clocks and controller ---------------------------------------------------------------------------------
create_clock -name clk_50 -period 20 [get_ports clk_50]
set phy_clk  [get_ports -nowarn phy_clk]
set has_phys [expr {[get_collection_size $phy_clk] > 0}]
source [file join [file dirname [info script]] .. flyframe.sdc]

# The PHYs' clock: what comes back is a virtual clock, mii_tx_clk.
if {$has_phys} { set_false_path -to [get_ports {phy_clk phy_reset_n}] }

# ---- Host bus and reset ------------------------------------------------------------------------------------
source [file join [file dirname [info script]] .. host_bus.sdc]

# ---- EEPROM of a gateway -----------------------------------------------------------------------------------
# Its lines change a quarter of a microsecond apart, or more.
set eeprom [get_ports -nowarn {sii_scl sii_sda}]
if {[get_collection_size $eeprom] > 0} {
  set_false_path -to $eeprom
  set_false_path -from [get_ports sii_sda]
}

# Timing constraints of a flyframe controller, for the Timing Analyzer (TimeQuest) of Quartus 13 and later.
#
# As it stands it fits the controller alone, as top module (quartus.tcl). In your own design set what differs
# in a file of your own and source this one from there, as alarm/board.sdc does; the names of the crossings
# hold at any depth of the hierarchy.

# ---- What to adapt -----------------------------------------------------------------------------------------
proc default {name value} { upvar 1 $name variable; if {![info exists variable]} { set variable $value } }
default core_mhz   100      ;# parameter coreClockMhz
default tx_shift   0        ;# parameter txShift
default core_port  clock    ;# pin of the core clock; "" if it comes from a PLL: name the PLL's output below
default core_clock core     ;# name of the core clock
default mii        mii_     ;# pins are named ${mii}0_rx_clk, ${mii}0_rx_dv, ... as ports of the top module
default rmii       rmii_    ;# and these ${rmii}0_ref_clk, ${rmii}0_crs_dv, ...

# When a PHY's TX_CLK rises at the FPGA after the 25 MHz output of the PLL rises: output buffer, board, PHY
# (data sheet), modulo 40 ns.
default tx_clk_ns  0.0

# When the 50 MHz of the RMII rises at the PHYs after the 25 MHz output of the PLL rises, modulo 20 ns; when
# the clock does that takes RXD, and its name, if it comes from a PLL.
default ref_clk_ns 0.0
default capture_ns $ref_clk_ns
default rmii_clock ""

# ---- Clocks ------------------------------------------------------------------------------------------------
set core_ns [expr {1000.0 / $core_mhz}]
if {$core_port ne ""} {
  create_clock -name $core_clock -period $core_ns [get_ports $core_port]
}
derive_pll_clocks
derive_clock_uncertainty

# TX_CLK never enters the FPGA, as the core clock has its frequency; a virtual clock stands for it.
create_clock -name mii_tx_clk -period 40 -waveform [list $tx_clk_ns [expr {$tx_clk_ns + 20}]]

# The same for RMII, whose clock goes from the PLL to the PHYs.
create_clock -name rmii_clk -period 20 -waveform [list $ref_clk_ns [expr {$ref_clk_ns + 10}]]

# ---- Pins --------------------------------------------------------------------------------------------------
# TXD changes once in 40 ns: five core cycles and txShift after the PLL's 25 MHz rises (SlotTimer two, one
# more for each of the three steps of a nibble slot). At 25 MHz there is nothing to align: it changes with
# every core clock edge.
set slot_cycles [expr {$core_mhz / 25}]
set change_ns [expr {$slot_cycles == 1 ? 0.0 : fmod((5 + $tx_shift) * $core_ns, 40)}]
# From there to the clock edge that takes it, in whole core cycles; the analysis by itself would take the last
# core edge.
proc cycles_to {edge_ns change_ns period_ns} {
  global core_ns
  set distance [expr {fmod($edge_ns - $change_ns + 2 * $period_ns, $period_ns)}]
  if {$distance < 0.001} { set distance $period_ns }
  return [expr {int(ceil($distance / $core_ns - 0.001))}]
}
set tx_cycles [cycles_to $tx_clk_ns $change_ns 40.0]

for {set y 0} {$y < 4} {incr y} {
  set rx_clk [get_ports -nowarn ${mii}${y}_rx_clk]
  if {[get_collection_size $rx_clk] == 0} { continue }

  # 100 ppm do not matter here: nothing relates this clock to the core clock.
  create_clock -name mii_${y}_rx_clk -period 40 $rx_clk

  # The PHY holds RXD, RX_DV and RX_ER steady from 10 ns before to 10 ns after RX_CLK rises: the next value
  # comes at the latest 30 ns after an edge and at the earliest 10 ns after it.
  set rx [get_ports "${mii}${y}_rx_dv ${mii}${y}_rx_er ${mii}${y}_rxd*"]
  set_input_delay -clock mii_${y}_rx_clk -max 30 $rx
  set_input_delay -clock mii_${y}_rx_clk -min 10 $rx

  # The PHY wants TXD and TX_EN 15 ns before TX_CLK rises, and may drop them at once (hold 0).
  set tx [get_ports "${mii}${y}_tx_en ${mii}${y}_txd*"]
  set_output_delay -clock mii_tx_clk -max 15 $tx
  set_output_delay -clock mii_tx_clk -min 0 $tx
  set_multicycle_path -setup -start -from [get_clocks $core_clock] -to $tx $tx_cycles
  set_multicycle_path -hold -start -from [get_clocks $core_clock] -to $tx [expr {$slot_cycles - 1}]

  # A level, brought over by LevelCrossing:core_link_crossing.
  set_false_path -from [get_ports ${mii}${y}_link]
}

# With RMII half nibbles change once in 20 ns, one core cycle later than those of MII.
set half_ns [expr {fmod((6 + $tx_shift) * $core_ns, 20)}]
set half_cycles [cycles_to $ref_clk_ns $half_ns 20.0]
for {set y 0} {$y < 4} {incr y} {
  set crs [get_ports -nowarn ${rmii}${y}_crs_dv]
  if {[get_collection_size $crs] == 0} { continue }

  # The reference clock is a pin if the controller is alone; the pins are timed against the PHYs' clock in
  # both cases.
  set capture $rmii_clock
  if {$capture eq ""} {
    set capture rmii_${y}_ref_clk
    create_clock -name $capture -period 20 -waveform [list $ref_clk_ns [expr {$ref_clk_ns + 10}]] \
      [get_ports ${rmii}${y}_ref_clk]
  }

  # Both sides want 4 ns of setup and 2 ns of hold (RMII specification 1.2, section 7.4).
  set rx [get_ports "${rmii}${y}_crs_dv ${rmii}${y}_rx_er ${rmii}${y}_rxd*"]
  set_input_delay -clock rmii_clk -max 16 $rx
  set_input_delay -clock rmii_clk -min 2 $rx
  # A clock that rises shortly behind that of the PHYs takes what they gave a period before.
  if {fmod($capture_ns - $ref_clk_ns + 19.999, 20) < 16} {
    set_multicycle_path -setup -from $rx -to [get_clocks $capture] 2
  }
  set tx [get_ports "${rmii}${y}_tx_en ${rmii}${y}_txd*"]
  set_output_delay -clock rmii_clk -max 4 $tx
  set_output_delay -clock rmii_clk -min -2 $tx
  set_multicycle_path -setup -start -from [get_clocks $core_clock] -to $tx $half_cycles
  set_multicycle_path -hold -start -from [get_clocks $core_clock] -to $tx [expr {$slot_cycles / 2 - 1}]
  set_false_path -from [get_ports ${rmii}${y}_link]
}

# ---- Clock crossings ---------------------------------------------------------------------------------------
# There are two kinds of crossing in every controller, both in src/rtl/clocks/Crossings.scala. No
# set_clock_groups and no false path between whole clocks: those would switch the following limits off, and
# hide a crossing that was not meant to be.

# 1. MiiRxWriteSide (RX_CLK) to MiiRxReadSide (core clock). One bit of the Gray pointer changes per 40 ns;
#    within one core cycle it must be at the first flip-flop. The symbol it points to has been written at the
#    same edge and is read when the pointer has passed two flip-flops, so it has two core cycles; half of one
#    is kept for the difference of the clocks' delays.
#    A ring node has no PHY: whoever has one in a design says so with has_phys 0.
default has_phys [expr {[get_collection_size [get_ports -nowarn phy_clk_ref]] > 0 || $core_port eq ""}]
if {$has_phys} {
  set pointer [get_registers -compatibility_mode {*writeSide|gray*}]
  set symbols [get_registers -compatibility_mode {*writeSide|storage_*}]
  set_max_delay -from $pointer -to [get_registers -compatibility_mode {*readSide|meta*}] $core_ns
  set_max_delay -from $symbols -to [get_clocks $core_clock] [expr {1.5 * $core_ns}]
  set_false_path -hold -from $pointer -to [get_clocks $core_clock]
  set_false_path -hold -from $symbols -to [get_clocks $core_clock]
}

# 2. LevelCrossing: the first of its two flip-flops may take any time.
set_false_path -to [get_registers -compatibility_mode {*LevelCrossing:*|meta}]

# ---- Slow pins ---------------------------------------------------------------------------------------------
# Named as ports of the top module, as far as they are there. Whoever is at the other end has no clock of the
# controller: levels, and buses that the controller clocks itself, much slower than any delay of a pin.
#   sii: the lines of the EEPROM change a quarter of a microsecond apart, or more.
#   mi: MDIO changes where MDC falls, and the PHY takes it where MDC rises, 256 ns later or more. Its answer
#     comes at most 300 ns behind a rise, and is taken 500 ns behind it or later, by way of a LevelCrossing.
#   optical: which cycle takes an edge is of no account; what arrives as it is taken counts as earlier or
#     later, in an EdgeSampleCrossing.
#   Other inputs have a LevelCrossing, or a SampleCrossing at which nobody looks for two core cycles; of LATCH
#     that loses a core cycle, beside which a pin's delay does not matter.
set slow_inputs {
  pdi_operational sii_sda sii_two_byte mi_mdio_in clock_signals_latch_* general_input digital_input
  digital_latch digital_output_enable alarm_current alarm_config_fault
  optical_1_rx optical_2_rx optical_1_signal optical_2_signal can_rx
}
set slow_outputs {
  eeprom_loaded irq ring_irq sii_scl_low sii_sda_low mi_mdc mi_mdio_out mi_mdio_enable phy_port_reset_n_*
  reset_request led_* digital_output digital_output_driven digital_output_valid digital_frame_begins
  general_output alarm_supply alarm_buzzer alarm_lamp alarm_fire alarm_sounder alarm_fault_n alarm_disabled
  optical_1_tx optical_2_tx can_tx
}
foreach name $slow_inputs {
  set pins [get_ports -nowarn $name]
  if {[get_collection_size $pins] > 0} { set_false_path -from $pins }
}
foreach name $slow_outputs {
  set pins [get_ports -nowarn $name]
  if {[get_collection_size $pins] > 0} { set_false_path -to $pins }
}

# At an edge of SYNC slaves do something together: they have the limit of the host bus (host_bus.sdc), so
# that no placement makes one slave later than another by more than that.
set sync_pins [get_ports -nowarn clock_signals_sync_*]
if {[get_collection_size $sync_pins] > 0} {
  set_max_delay -to $sync_pins 15
  set_false_path -hold -to $sync_pins
}

# ---- Hosts with pins ---------------------------------------------------------------------------------------
# SPI (hostInterface 4). The host's clock has a quarter of the core clock's frequency at most, and half a
# period lies between the change of a bit and the edge that takes it; nothing relates it to the core clock.
set spi_clk [get_ports -nowarn spi_clk]
if {[get_collection_size $spi_clk] > 0} {
  create_clock -name spi_clk -period [expr {4 * $core_ns}] $spi_clk
  set_max_delay -from [get_ports {spi_sel spi_mosi}] $core_ns
  set_false_path -hold -from [get_ports {spi_sel spi_mosi}]
  set_max_delay -to [get_ports {spi_miso spi_miso_drive}] 15
  set_false_path -hold -to [get_ports {spi_miso spi_miso_drive}]

  # SpiCrossing: what goes with a change stands two core cycles before it is looked at, and what is sent four
  # before it is taken.
  set received [get_registers -compatibility_mode {
    *SpiShift:*|received* *SpiShift:*|firstBit *SpiShift:*|bits*
  }]
  set_max_delay -from $received -to [get_clocks $core_clock] [expr {2 * $core_ns}]
  set_false_path -hold -from $received -to [get_clocks $core_clock]
  set sent [get_registers -compatibility_mode {*SpiInterface:*|next*}]
  set_max_delay -from $sent -to [get_clocks spi_clk] [expr {2 * $core_ns}]
  set_false_path -hold -from $sent -to [get_clocks spi_clk]
}

# An asynchronous microcontroller bus (hostInterface 5), with the limits of the boards; host_bus.sdc says why.
# With busWriteEarly 0 the data are taken until their strobe ends, and stay 5 ns longer.
set bus_strobes [get_ports -nowarn {bus_cs_n bus_rd bus_wr_n}]
if {[get_collection_size $bus_strobes] > 0} {
  set_max_delay -from $bus_strobes -to [get_registers -compatibility_mode {*MemoryBusCrossing:*|meta_*}] 8
  set taken [get_registers -compatibility_mode {*MemoryBusCrossing:*|taken_*}]
  set_max_delay -from $bus_strobes -to $taken 8
  set_false_path -hold -from $bus_strobes
  set payload [get_ports {bus_a bus_d_in bus_be}]
  set_max_delay -from $payload -to $taken 15
  set_false_path -hold -from $payload -to $taken
  set answer [get_ports {bus_d_out bus_d_drive bus_busy bus_busy_drive}]
  set_max_delay -to $answer 15
  set_false_path -hold -to $answer
}

# ---- The controller alone ----------------------------------------------------------------------------------
# Inside a design these are not pins. Alone, the host port gets a register's delay on either side, so that its
# paths count for Fmax.
if {$core_port ne ""} {
  # From the PLL: the analysis sees the real path once the PLL is there.
  if {$has_phys} {
    set_false_path -from [get_ports phy_clk_ref]
    set_false_path -to [get_ports {phy_reset_n mii_tx_tick}]
  }
  set host_in  [get_ports -nowarn {
    reset host_req host_write host_addr host_wdata host_be
    avalon_address avalon_read avalon_write avalon_byteenable avalon_writedata
    axi_awaddr axi_awprot axi_awvalid axi_wdata axi_wstrb axi_wvalid axi_bready
    axi_araddr axi_arprot axi_arvalid axi_rready
    wb_cyc wb_stb wb_we wb_adr wb_sel wb_dat_w
  }]
  set host_out [get_ports -nowarn {
    host_ack host_rdata avalon_readdata avalon_waitrequest
    axi_awready axi_wready axi_bresp axi_bvalid axi_arready axi_rdata axi_rresp axi_rvalid
    wb_dat_r wb_ack wb_stall
  }]
  set_input_delay -clock $core_clock -max 1 $host_in
  set_input_delay -clock $core_clock -min 0 $host_in
  set_output_delay -clock $core_clock 1 $host_out
  # Virtual pins are cells with no place of their own: their hold says nothing.
  set_false_path -hold -from $host_in
  set_false_path -hold -to $host_out
}

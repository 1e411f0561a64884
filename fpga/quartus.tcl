# Makes a Quartus project of one preset, for an EP4CE6E22C8N unless told otherwise, and compiles it, to see
# size and speed. Nothing is assigned to pins.
#   quartus_sh -t fpga/quartus.tcl [PRESET [DEVICE]]
# PRESET as in generated/PRESET.v, default cyclone4-min; DEVICE such as EP4CE10E22C8.
# Everything is written to build/quartus/PRESET. Quartus names the device without the N (lead-free).
load_package flow

set preset cyclone4-min
if {[llength $quartus(args)] > 0} { set preset [lindex $quartus(args) 0] }
if {[llength $quartus(args)] > 1} { set device [lindex $quartus(args) 1] }
if {[info exists device] && ![regexp {^EP4CE[0-9]+[EFUM][0-9]+[CIA][0-9]L?$} $device]} {
  post_message -type error "DEVICE is $device but must be a Cyclone IV E, such as EP4CE10E22C8."
  qexit -error
}

set root    [file dirname [file dirname [file normalize [info script]]]]
set verilog [file join $root generated $preset.v]
if {![file exists $verilog]} {
  post_message -type error "generated/$preset.v is missing: make verilog ARGS=\"--preset $preset\""
  qexit -error
}

# The name of the top module is the preset's, with an underscore for everything that is no letter or digit.
regsub -all {[^A-Za-z0-9]} $preset _ top

source [file join $root fpga clock.tcl]
set core_mhz [core_clock [file join $root generated $preset.json]]

set work [file join $root build quartus $preset]
file mkdir $work
cd $work

project_new $top -overwrite
source [file join $root fpga device.tcl]
set_global_assignment -name TOP_LEVEL_ENTITY $top
set_global_assignment -name VERILOG_INPUT_VERSION VERILOG_2001
set_global_assignment -name VERILOG_FILE $verilog
constrain [file join $root fpga flyframe.sdc] $core_mhz
set_global_assignment -name PROJECT_OUTPUT_DIRECTORY output

# The host port, and what a PLL or a reset circuit on the chip drives, are virtual pins: logic cells instead
# of pins. Bit by bit, as every version of Quartus understands it. Clocks and MII stay pins; the fitter places
# them.
set file [open $verilog]
set in_top 0
while {[gets $file line] >= 0} {
  if {[string match "module ${top}(*" $line]} { set in_top 1 }
  if {!$in_top} { continue }
  if {[string match "*);*" $line]} { break }
  if {![regexp {^\s*(?:input|output)\s+(?:\[(\d+):0\]\s*)?(\w+)} $line all high name]} { continue }
  if {![regexp {^(host_|pdi_operational$|phy_clk_ref$|reset$|mii_tx_tick$)} $name]} { continue }
  if {$high eq ""} {
    set_instance_assignment -name VIRTUAL_PIN ON -to $name
  } else {
    for {set bit 0} {$bit <= $high} {incr bit} {
      set_instance_assignment -name VIRTUAL_PIN ON -to "${name}\[${bit}\]"
    }
  }
}
close $file

export_assignments
if {[catch {execute_flow -compile} message]} {
  post_message -type error $message
  project_close
  qexit -error
}
project_close
post_message "Size: build/quartus/$preset/output/$top.fit.summary; speed: $top.sta.rpt there"

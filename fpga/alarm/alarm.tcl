# Makes a Quartus project of the alarm board and compiles it. `make quartus` generates the Verilog and calls
#   quartus_sh -t fpga/alarm/alarm.tcl ROLE WIDTH [DIRECTORY]
# ROLE is slave or master, WIDTH the bits of the host's data bus. A master with linePorts 2 has three ports.
# Reads what was generated, *.v and alarm-ROLE.json, from DIRECTORY (default build/board/ROLE); writes to
# DIRECTORY/quartus. The core clock is the one in alarm-ROLE.json: PLL and constraints follow it.
load_package flow

set role  [lindex $quartus(args) 0]
set width [lindex $quartus(args) 1]
set here  [file dirname [file normalize [info script]]]
set root  [file dirname [file dirname $here]]
set rtl   [file join $root build board $role]
if {[llength $quartus(args)] > 2} { set rtl [file normalize [lindex $quartus(args) 2]] }

source [file join $root fpga board.tcl]
set json     [file join $rtl alarm-$role.json]
set core_mhz [board_clock $json alarm]
set ring     [expr {$role eq "master" && [parameter $json linePorts] == 2}]
set wide     [expr {$width == 32}]
set rmii     [parameter $json rmiiPorts]
set all      [expr {$ring ? 7 : 3}]
if {$rmii != 0 && $rmii != $all} { refuse "rmiiPorts is $rmii but must be 0 or $all on the alarm board." }
if {$ring && $wide} {
  refuse "dataBusWidth is 32 but must be 8 or 16 on the alarm board with linePorts 2."
}

set work [file join $rtl quartus]
file mkdir $work
cd $work

project_new alarm_$role -overwrite
source [file join $root fpga device.tcl]
set sources [list [file join $here board.v] [file join $rtl board_support.v] [file join $rtl alarm-$role.v]]
board_project $sources [file join $here board.sdc] $core_mhz $width
set_parameter -name ROLE [expr {$role eq "master"}]
if {$rmii} { set_global_assignment -name VERILOG_MACRO RMII=1 }
if {$ring} { set_global_assignment -name VERILOG_MACRO RING=1 }
if {$wide} { set_global_assignment -name VERILOG_MACRO WIDE_BUS=1 }
if {!$wide} { check_configuration }

# As many bits of the host bus as there are.
set bits [dict create bus_d $width bus_nbl [expr {$width / 8}] bus_a [expr {13 - $width / 16}]]
source [file join $here pins.tcl]
compile_board $work alarm_$role

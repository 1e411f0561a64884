# Makes a Quartus project of the ring board and compiles it. `make quartus BOARD=ring` generates the Verilog
# and calls
#   quartus_sh -t fpga/ring/ring.tcl ROLE WIDTH DEVICE [DIRECTORY]
# ROLE is bus, node, node-tp, server or gateway, WIDTH the bits of the host's data bus. Reads what was
# generated, *.v and ring-ROLE.json, from DIRECTORY (default build/board/ROLE); writes to DIRECTORY/quartus.
# The core clock is the one in ring-ROLE.json: PLL and constraints follow it.
load_package flow

set role   [lindex $quartus(args) 0]
set width  [lindex $quartus(args) 1]
set device [lindex $quartus(args) 2]
set here   [file dirname [file normalize [info script]]]
set root   [file dirname [file dirname $here]]
set rtl    [file join $root build board $role]
if {[llength $quartus(args)] > 3} { set rtl [file normalize [lindex $quartus(args) 3]] }

source [file join $root fpga board.tcl]
set core_mhz [board_clock [file join $rtl ring-$role.json] ring]
set widths [expr {$role eq "gateway" ? {8} : {8 16}}]
if {$width ni $widths} {
  refuse "dataBusWidth is $width but must be [join $widths { or }] on the ring board with ROLE $role."
}
if {![regexp {^EP4CE(6|10|15)E22} $device]} {
  refuse "device is $device but must be an EP4CE6, EP4CE10 or EP4CE15 with E22 on the ring board."
}

set work [file join $rtl quartus]
file mkdir $work
cd $work

project_new ring_$role -overwrite
source [file join $root fpga device.tcl]
set sources [list [file join $here board.v] [file join $rtl board_support.v] [file join $rtl ring-$role.v]]
board_project $sources [file join $here board.sdc] $core_mhz $width
set_global_assignment -name VERILOG_MACRO CORE=[string map {- _} ring-$role]
set phys [dict get {bus 0 node 0 node-tp 0 server 1 gateway 2} $role]
if {$role eq "node-tp"} { set_global_assignment -name VERILOG_MACRO TWISTED_PAIR=1 }
if {$phys > 0}          { set_global_assignment -name VERILOG_MACRO PHYS=$phys }
if {$phys > 1}          { set_global_assignment -name VERILOG_MACRO GATEWAY=1 }
check_configuration

# As many bits of the host bus as there are.
set bits [dict create bus_d $width bus_nbl [expr {$width / 8}] \
  bus_a [expr {($role eq "gateway" ? 15 : 13) - $width / 16}]]
source [file join $here pins.tcl]
compile_board $work ring_$role

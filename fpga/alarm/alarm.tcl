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

source [file join $root fpga clock.tcl]
set core_mhz [core_clock [file join $rtl alarm-$role.json]]
if {$core_mhz != 50 && $core_mhz != 100} {
  post_message -type error "coreClockMhz is $core_mhz but must be 50 or 100 on the alarm board."
  qexit -error
}

set ring [expr {$role eq "master" && [parameter [file join $rtl alarm-$role.json] linePorts] == 2}]
set wide [expr {$width == 32}]
set rmii [parameter [file join $rtl alarm-$role.json] rmiiPorts]
set all  [expr {$ring ? 7 : 3}]
if {$rmii != 0 && $rmii != $all} {
  post_message -type error "rmiiPorts is $rmii but must be 0 or $all on the alarm board."
  qexit -error
}
if {$ring && $wide} {
  post_message -type error "dataBusWidth is 32 but must be 8 or 16 on the alarm board with linePorts 2."
  qexit -error
}

set work [file join $rtl quartus]
file mkdir $work
cd $work

project_new alarm_$role -overwrite
source [file join $root fpga device.tcl]
set_global_assignment -name TOP_LEVEL_ENTITY board
set_global_assignment -name VERILOG_INPUT_VERSION VERILOG_2001
set_global_assignment -name VERILOG_FILE [file join $here board.v]
set_global_assignment -name VERILOG_FILE [file join $rtl board_support.v]
set_global_assignment -name VERILOG_FILE [file join $rtl alarm-$role.v]
constrain [file join $here board.sdc] $core_mhz
set_global_assignment -name PROJECT_OUTPUT_DIRECTORY output
set_parameter -name ROLE [expr {$role eq "master"}]
set_parameter -name DATA_BUS_WIDTH $width
set_parameter -name CORE_MHZ $core_mhz
if {$rmii} { set_global_assignment -name VERILOG_MACRO RMII=1 }
if {$ring} { set_global_assignment -name VERILOG_MACRO RING=1 }
if {$wide} { set_global_assignment -name VERILOG_MACRO WIDE_BUS=1 }

# The device checks its configuration while it works, and says at pin CRC_ERROR (99) if it is damaged.
if {!$wide} {
  set_global_assignment -name CRC_ERROR_CHECKING ON
  set_global_assignment -name ERROR_CHECK_FREQUENCY_DIVISOR 2
}

# Configuration from a serial memory; nCEO (pin 101) is an ordinary pin.
set_global_assignment -name CYCLONEIII_CONFIGURATION_SCHEME "ACTIVE SERIAL"
set_global_assignment -name CYCLONEII_RESERVE_NCEO_AFTER_CONFIGURATION "USE AS REGULAR IO"
set_global_assignment -name RESERVE_ALL_UNUSED_PINS_WEAK_PULLUP "AS INPUT TRI-STATED WITH WEAK PULL-UP"

# Pins: as many bits of the host bus as there are.
set bits [dict create bus_d $width bus_nbl [expr {$width / 8}] bus_a [expr {13 - $width / 16}]]
proc free {port pins} {
  global bits
  set bus [expr {[llength $pins] > 1}]
  if {[dict exists $bits $port]} { set pins [lrange $pins 0 [dict get $bits $port]-1] }
  set bit 0
  foreach pin $pins {
    set_location_assignment PIN_$pin -to [expr {$bus ? "${port}\[$bit\]" : $port}]
    incr bit
  }
}
proc fixed {port pins} { free $port $pins }
source [file join $here pins.tcl]

export_assignments
if {[catch {execute_flow -compile} message]} {
  post_message -type error $message
  project_close
  qexit -error
}
project_close
post_message "Size: $work/output/alarm_$role.fit.summary; speed: alarm_$role.sta.rpt there"

# Runs a project script in plain Tcl and prints its assignments.
#   tclsh test/flyframe/board/pins.tcl fpga/alarm/alarm.tcl ROLE WIDTH DIRECTORY
# Lines: pin NAME NUMBER | global NAME VALUE | parameter NAME VALUE | port NAME ASSIGNMENT VALUE
package require Tcl 8.5
set quartus(args) [lrange $argv 1 end]
set argv0 [lindex $argv 0]
proc load_package {args} {}
proc project_new {args} {}
proc project_close {} {}
proc export_assignments {} {}
proc execute_flow {args} {}
proc post_message {args} { if {"error" in $args} { puts stderr [lindex $args end] } }
proc qexit {args} { exit 1 }
proc set_global_assignment {option name value} { puts "global $name [list $value]" }
proc set_parameter {option name value} { puts "parameter $name $value" }
proc set_instance_assignment {option name value to port} { puts "port $port $name [list $value]" }
proc set_location_assignment {location option port} { puts "pin [string map {PIN_ {}} $location] $port" }
source $argv0

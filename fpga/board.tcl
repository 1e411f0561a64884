# What the project scripts of all boards share: alarm/alarm.tcl, ring/ring.tcl. Sourced by them.
source [file join [file dirname [info script]] clock.tcl]

# Ends the script with a sentence.
proc refuse {sentence} {
  post_message -type error $sentence
  qexit -error
}

# The core clock in `json`, which the PLL of a board must be able to give.
proc board_clock {json board} {
  set mhz [core_clock $json]
  if {$mhz != 50 && $mhz != 100} {
    refuse "coreClockMhz is $mhz but must be 50 or 100 on the $board board."
  }
  return $mhz
}

# What every board's project has: its files, the constraints, parameters and pins of the configuration.
proc board_project {sources sdc mhz width} {
  set_global_assignment -name TOP_LEVEL_ENTITY board
  set_global_assignment -name VERILOG_INPUT_VERSION VERILOG_2001
  foreach file $sources { set_global_assignment -name VERILOG_FILE $file }
  constrain $sdc $mhz
  set_global_assignment -name PROJECT_OUTPUT_DIRECTORY output
  set_parameter -name DATA_BUS_WIDTH $width
  set_parameter -name CORE_MHZ $mhz

  # Configuration from a serial memory; nCEO (pin 101) is an ordinary pin.
  set_global_assignment -name CYCLONEIII_CONFIGURATION_SCHEME "ACTIVE SERIAL"
  set_global_assignment -name CYCLONEII_RESERVE_NCEO_AFTER_CONFIGURATION "USE AS REGULAR IO"
  set_global_assignment -name RESERVE_ALL_UNUSED_PINS_WEAK_PULLUP "AS INPUT TRI-STATED WITH WEAK PULL-UP"

  # A host in reset leaves its strobes open: no access then.
  foreach strobe {bus_ne bus_noe bus_nwe} {
    set_instance_assignment -name WEAK_PULL_UP_RESISTOR ON -to $strobe
  }
}

# The device checks its configuration while it works, and says at pin CRC_ERROR (99) if it is damaged.
proc check_configuration {} {
  set_global_assignment -name CRC_ERROR_CHECKING ON
  set_global_assignment -name ERROR_CHECK_FREQUENCY_DIVISOR 2
}

# For the files of pins: bit i of `port` is on the i-th of `pins`; of a port in `bits` there are only as many.
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

# Quartus takes 3.3 V beside DCLK only for a signal of which it is told that it does not switch.
proc slow {port pin} {
  free $port $pin
  set_instance_assignment -name IO_MAXIMUM_TOGGLE_RATE "0 MHz" -to $port
}

# Compiles the open project.
proc compile_board {work name} {
  export_assignments
  if {[catch {execute_flow -compile} message]} {
    project_close
    refuse $message
  }
  project_close
  post_message "Size: $work/output/$name.fit.summary; speed: $name.sta.rpt there"
}

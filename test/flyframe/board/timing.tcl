# Runs the constraint file and the pin file of the board in plain Tcl, against the names of a netlist.
#   tclsh test/flyframe/board/timing.tcl NAMES clock.sdc
# Every pattern must match; prints each constrained register and port.
# NAMES has a line for each name: port NAME, register NAME or pin NAME, as Quartus writes them.
set names [dict create port {} register {} pin {}]
set file [open [lindex $argv 0]]
while {[gets $file line] >= 0} { dict lappend names [lindex $line 0] [lindex $line 1] }
close $file

set failed 0
proc complain {text} { global failed; puts stderr $text; set failed 1 }

# Brackets of a bus index are no character class in Quartus.
proc literal {pattern} { string map {\[ \\\[ \] \\\]} $pattern }
proc get {kind patterns quiet} {
  global names
  set found {}
  foreach pattern $patterns {
    set hits {}
    foreach name [dict get $names $kind] {
      set plain [literal $pattern]
      if {[string match $plain $name] || [string match $plain\\\[*\\\] $name]} { lappend hits $name }
    }
    if {[llength $hits] == 0 && !$quiet} { complain "No $kind matches $pattern." }
    lappend found {*}$hits
  }
  return $found
}
proc get_of {kind arguments} {
  set quiet [expr {"-nowarn" in $arguments}]
  get $kind [lindex $arguments end] $quiet
}
proc get_ports     {args} { get_of port $args }
proc get_registers {args} { get_of register $args }
proc get_pins      {args} { get_of pin $args }
proc get_collection_size {collection} { llength $collection }

set clocks {}
proc create_clock {args} {
  global clocks
  lappend clocks [dict get [lrange $args 0 [expr {[llength $args] / 2 * 2 - 1}]] -name]
}
proc derive_pll_clocks {} {
  global clocks
  foreach output {0 1 2 3} { lappend clocks "pll|auto_generated|pll1|clk\[$output\]" }
}
proc derive_clock_uncertainty {} {}
proc get_clocks {name} {
  global clocks
  if {$name ni $clocks} { complain "No clock is named $name." }
  return $name
}
proc set_clock_groups {args} { complain "set_clock_groups would overrule the limits of the crossings." }

# What a constraint names, each on a line: command (max with its ns), from or to, name.
proc note {command arguments} {
  foreach {side} {-from -to} {
    set at [lsearch -exact $arguments $side]
    if {$at >= 0} {
      foreach name [lindex $arguments [expr {$at + 1}]] { puts "$command [string range $side 1 end] $name" }
    }
  }
}
proc set_false_path      {args} { note [expr {"-hold" in $args ? "hold" : "false"}] $args }
proc set_max_delay       {args} { note max=[lindex $args end] $args }
proc set_multicycle_path {args} { note [expr {"-hold" in $args ? "hold" : "multicycle"}] $args }
proc delay {direction arguments} {
  get_clocks [lindex $arguments [expr {[lsearch -exact $arguments -clock] + 1}]]
  set which [expr {"-min" in $arguments ? "min" : "max"}]
  foreach name [lindex $arguments end] { puts "$direction $which $name" }
}
proc set_input_delay  {args} { delay input $args }
proc set_output_delay {args} { delay output $args }

source [lindex $argv 1]
exit $failed

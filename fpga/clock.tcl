# A project follows what was generated.

# Parameter `name` as it stands in `json`, beside the controller's Verilog; ends the script with a sentence if
# it does not.
proc parameter {json name} {
  set value ""
  if {[file exists $json]} {
    set file [open $json]
    regexp "\"$name\": *(\[0-9\]+)" [read $file] all value
    close $file
  }
  if {$value eq ""} {
    post_message -type error "$json with $name is missing: generate the controller again."
    qexit -error
  }
  return $value
}
proc core_clock {json} { parameter $json coreClockMhz }

# Gives the open project the constraint file `sdc` at `mhz`, by way of clock.sdc in the work directory.
proc constrain {sdc mhz} {
  set file [open clock.sdc w]
  puts $file "# Made by the project's script: the core clock as generated.\nset core_mhz $mhz\nsource {$sdc}"
  close $file
  set_global_assignment -name SDC_FILE clock.sdc
}

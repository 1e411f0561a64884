# Runs a component of Platform Designer (_hw.tcl) in plain Tcl: prints what it says, a command on a line with
# tabs between its arguments.
#   tclsh test/flyframe/hw_tcl.tcl FILE
foreach name {
  set_module_property add_fileset set_fileset_property add_fileset_file add_interface set_interface_property
  add_interface_port
} { proc $name {args} "puts \[join \[concat $name \$args\] \\t\]" }
rename package plain_package
proc package {args} { if {$args ne "require -exact qsys 13.0"} { error "package $args" } }
source [lindex $argv 0]

# Timing of what board_support.v has: the host bus (pins bus_*, MemoryBusCrossing) and the reset. Sourced by
# the constraints of each board.

# The strobes pass two flip-flops and are compared once: an access is taken three core cycles after the first
# of them sees it, at 100 MHz 30 ns. Address, byte enables and data have 15 ns of these from their pins; the
# other 15 ns are for the host, which may give them later than the strobe. The strobes have 8 ns, so that they
# do not come too differently. A slower core clock takes later, and the host is not asked for more: the limits
# stay.
set strobes [get_ports {bus_ne bus_noe bus_nwe}]
set meta    [get_registers -compatibility_mode {*MemoryBusCrossing:*|meta_*}]
set_max_delay -from $strobes -to $meta 8
set_false_path -hold -from $strobes
set payload [get_ports {bus_a* bus_d* bus_nbl*}]
set taken   [get_registers -compatibility_mode {*MemoryBusCrossing:*|taken_*}]
set_max_delay -from $payload -to $taken 15
set_max_delay -from $strobes -to $taken 8
set_false_path -hold -from $payload -to $taken

# Towards the host nothing is clocked: read data and wait change with the core clock, and with the pins. Both
# have the same limit, whatever the clock: read data are there when the host sees wait end.
set answer [get_ports {bus_d* bus_nwait}]
set states [get_registers -compatibility_mode {
  *MicrocontrollerInterface:*|readData* *MicrocontrollerInterface:*|released
}]
set_max_delay -from $states -to $answer 15
set_max_delay -from [get_ports {bus_ne bus_noe}] -to $answer 15
set_false_path -hold -to $answer

# ResetCrossing: begins without a clock. Pins have the names of instances alone.
set_false_path -to [get_pins -compatibility_mode {*boardReset|crossing|*|clrn}]

# Settings of every project. The device is an EP4CE6E22C8N unless the script has set another one; Quartus
# names it without the N (lead-free).
if {![info exists device]} { set device EP4CE6E22C8 }
set_global_assignment -name FAMILY "Cyclone IV E"
set_global_assignment -name DEVICE $device

# The stages behind the synchronisers must stay flip-flops, not become a shift register in RAM.
set_global_assignment -name AUTO_SHIFT_REGISTER_RECOGNITION OFF
set_global_assignment -name SYNCHRONIZER_IDENTIFICATION "FORCED IF ASYNCHRONOUS"

# MII has 3.3 V levels.
set_global_assignment -name STRATIX_DEVICE_IO_STANDARD "3.3-V LVTTL"

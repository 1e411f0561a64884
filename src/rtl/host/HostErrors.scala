package flyframe.host

import chisel3._
import flyframe.memory.{RegisterBus, RegisterUnit}
import flyframe.registers.HostErrorRegisters

/** Counts accesses of the host that were in error, and keeps what was wrong with the last one (ERR-11). */
class HostErrors(side: HostSide) extends RegisterUnit(HostErrorRegisters.all) {
  def connect(bus: RegisterBus): Unit = {
    bus.counts("pdi_error") := side.error.valid
    // Code and counter are cleared together.
    val cleared = bus.writes("pdi_error")
    bus.set("pdi_error_code", side.error.valid || cleared, Mux(side.error.valid, side.error.bits, 0.U))
  }
}

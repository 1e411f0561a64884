package flyframe.registers

import RegisterTable._

/** What a host interface counts (ERR-11); used by [[flyframe.host.HostErrors]]. */
object HostErrorRegisters {
  // format: off
  val all: Seq[Register] = Seq(
    register(0x030d, 1, "pdi_error",      clr, r, "ERR-11", "PDI error counter",
      field("pdi_error",       7, 0, counter("pdi"), 0,
          "Accesses of the host with an error of its interface")),
    register(0x030e, 2, "pdi_error_code", r,   r, "ERR-11", "PDI error code",
      field("pdi_error_code", 15, 0, loadable,       0, "What was wrong with the last of them (B-116)"))
  )
  // format: on
}

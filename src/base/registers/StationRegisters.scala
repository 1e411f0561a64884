package flyframe.registers

import flyframe.params.EscParams
import RegisterTable._

/** The addresses under which a slave is reached; used by [[flyframe.frame.CommandDecode]]. */
object StationRegisters {
  val Address = 0x0010
  val Alias   = 0x0012

  // format: off
  def apply(p: EscParams): Seq[Register] = {
    // Of the register RAM a whole register is read, and messages of an alarm slave have the place there.
    val held = if (p.hasRegisterRam && p.nodeIdWidth == 16 && !p.hasAlarm) mirrored else stored
    Seq(
    register(Address, 2, "station_address", rw, r,  "FP-15", "Configured station address",
      field("station_address", p.nodeIdWidth - 1, 0, held, 0,
          "Node address compared for FPRD, FPWR, FPRW and FRMW")),
    register(Alias,   2, "station_alias",   r,  rw, "FP-15", "Configured station alias",
      field("station_alias",   p.nodeIdWidth - 1, 0, held, 0,
          "Second node address while 0x0100[24] is set; written by the host"))
    )
  }
  // format: on
}

package flyframe.registers

import flyframe.params.EscParams
import RegisterTable._

/** The state of the slave's application (AL-01 to AL-06); used by [[flyframe.application.Application]]. */
object ApplicationRegisters {
  val Control = 0x0120
  val Status  = 0x0130

  private val free  = rwIf("al_control_free")
  private val byPdi = rwIf("al_status_by_pdi")

  // format: off
  def apply(p: EscParams): Seq[Register] = {
    // Without a host nobody writes the code.
    val byHost = if (p.isDigitalIo) constant else ram
    Seq(
    register(Control, 2, "al_control",     free, ack,   "AL-01, AL-04",        "AL control",
      field("al_control",      6, 0, stored,   1, "Requested state, bit 4: error acknowledge")),
    register(Status,  2, "al_status",      ack,  byPdi, "AL-01, AL-05, AL-06", "AL status",
      field("al_status",       6, 0, loadable, 1, "Present state, bit 4: error indication")),
    register(0x0134,  2, "al_status_code", r,    rw,    "AL-06",               "AL status code",
      field("al_status_code", 15, 0, byHost,   0, "Why the state was refused or left"))
    )
  }
  // format: on
}

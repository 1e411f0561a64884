package flyframe.registers

import flyframe.params.EscParams
import RegisterTable._

/** Outputs that the bus drives (SM-26, PDI-11); used by [[flyframe.SlaveController]]. The one register that
  * SyncManagers act on and that is written bit by bit.
  */
object DigitalOutputRegisters {
  val Outputs = 0x0f00

  // format: off
  def apply(p: EscParams): Seq[Register] = Seq(
    register(Outputs, 4, "digital_output", rw, r, "SM-26, PDI-11", "Digital I/O output data",
      field("digital_output", 8 * p.digitalOutputs - 1, 0, stored, 0,
          "Outputs, driven while the process data watchdog runs; single bits can be written through an " +
            "FMMU"))
  ).map(_.copy(managed = true, bitWritable = true))
  // format: on
}

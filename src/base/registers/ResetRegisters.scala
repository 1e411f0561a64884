package flyframe.registers

import RegisterTable._

/** By which bus and host ask for a reset (SYS-04); used by [[flyframe.application.ResetRequest]]. */
object ResetRegisters {
  val Ecat = 0x0040
  val Pdi  = 0x0041

  /** What is written there, in this order. */
  val Sequence: Seq[Int] = Seq(0x52, 0x45, 0x53)

  // format: off
  val all: Seq[Register] = Seq(
    register(Ecat, 1, "reset_ecat", rw, r,  "SYS-04", "ESC reset ECAT",
      field("reset_ecat", 1, 0, status, 0, "Values of 0x52, 0x45, 0x53 written one after the other")),
    register(Pdi,  1, "reset_pdi",  r,  rw, "SYS-04", "ESC reset PDI",
      field("reset_pdi",  1, 0, status, 0, "The same by the host"))
  )
  // format: on
}

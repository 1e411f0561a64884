package flyframe.registers

import RegisterTable._

/** By which the bus protects registers, or all it can write, against frames that do not ask to write (SYS-02,
  * SYS-03); used by [[flyframe.memory.WriteProtection]].
  */
object ProtectionRegisters {

  /** A frame writes them to write what is protected: registers; all. */
  val RegisterEnable = 0x0020
  val EscEnable      = 0x0030

  // format: off
  val all: Seq[Register] = Seq(
    register(RegisterEnable, 1, "register_write_enable", rw, r, "SYS-02, OP-22", "Register write enable",
      field("register_write_enable",     0, 0, status, 0,
          "1: written since the last frame began, while registers are protected")),
    register(0x0021, 1, "register_write_protection",     rw, r, "SYS-02", "Register write protection",
      field("register_write_protection", 0, 0, stored, 0, "1: a frame that writes registers must enable it")),
    register(EscEnable, 1, "esc_write_enable",           rw, r, "SYS-03, OP-22", "ESC write enable",
      field("esc_write_enable",          0, 0, status, 0,
          "1: written since the last frame began, while all is protected")),
    register(0x0031, 1, "esc_write_protection",          rw, r, "SYS-03", "ESC write protection",
      field("esc_write_protection",      0, 0, stored, 0, "1: a frame that writes anything must enable it"))
  )
  // format: on
}

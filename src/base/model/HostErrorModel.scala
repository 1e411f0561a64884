package flyframe.model

import flyframe.registers.Register

/** Errors of the host's interface, as registers show them (ERR-11, B-116). */
class HostErrorModel(registers: ModelRegisters) extends ModelUnit {

  /** An access was in error, and how. */
  def happens(code: Int): Unit = {
    registers.count("pdi_error")
    registers.set("pdi_error_code", code)
  }

  override def written(register: Register, address: Int, byte: Int, byHost: Boolean): Unit =
    if (register.name == "pdi_error") registers.set("pdi_error_code", 0)
}

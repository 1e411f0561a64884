package flyframe.model

import flyframe.registers.{ProtectionRegisters, Register, RegisterMap}

/** Write protection of registers and of the whole controller, against frames (SYS-02, SYS-03, OP-22, B-110).
  */
class ProtectionModel(registers: ModelRegisters) extends ModelUnit {
  private val enables =
    Map(ProtectionRegisters.RegisterEnable -> "register", ProtectionRegisters.EscEnable -> "esc")
  private var enabled = Set.empty[String] // by the frame

  private def isOn(name: String): Boolean  = registers.value(s"${name}_write_protection") == 1
  private def locks(name: String): Boolean = isOn(name) && !enabled(name)

  /** The frame may not write this byte. */
  def refuses(address: Int): Boolean =
    !enables.contains(address) &&
      (locks("esc") || (address < RegisterMap.UserRamStart && locks("register")))

  /** A new frame has enabled nothing. */
  def frameStarts(): Unit = enabled = Set.empty

  /** The frame has written this byte; how the frame ends does not matter. */
  def passes(address: Int): Unit = enables.get(address).filter(isOn).foreach(enabled += _)

  override def status(field: String): Option[Int] = enables.values
    .find(name => field == s"${name}_write_enable")
    .map(name => if (enabled(name)) 1 else 0)

  /** Without protection there is no enable, and none comes back with it. */
  override def written(register: Register, address: Int, byte: Int, byHost: Boolean): Unit =
    enabled = enabled.filter(isOn)
}

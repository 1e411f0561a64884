package flyframe.memory

import chisel3._
import flyframe.registers.ProtectionRegisters

/** A byte that a frame wants to write, where writes may be refused; as the frame processor sees it. */
class ProtectedWrite extends Bundle {

  /** Bit 16: there is nothing. */
  val address = Output(UInt(17.W))

  /** It is addressed as a register; its place may be in a buffer of a SyncManager behind those. */
  val isRegister = Output(Bool())

  /** It is written in this cycle. */
  val accepted = Output(Bool())

  /** In the same cycle: it must not be. */
  val refused = Input(Bool())
}

/** Refuses what frames write while it is protected and they have not enabled it (SYS-02, SYS-03, B-110). The
  * enable counts from the next byte of its frame on, so it is taken from what passes, and not, as all other
  * register writes, from what takes effect behind the frame.
  */
class WriteProtection(write: ProtectedWrite) extends RegisterUnit(ProtectionRegisters.all) {
  import ProtectionRegisters.{EscEnable, RegisterEnable}

  def connect(bus: RegisterBus): Unit = {
    def isAt(address: Int): Bool = write.address === address.U

    /** It is protected, and this frame has not enabled it. */
    def closed(name: String, enable: Int): Bool = {
      val isProtected = bus.bool(s"${name}_write_protection")
      val enabled     = RegInit(false.B).suggestName(s"${name}_write_enabled") // reset: by no frame
      when(write.accepted && isAt(enable)) { enabled := true.B }
      when(bus.frame.begins || !isProtected) { enabled := false.B }
      bus.status(s"${name}_write_enable") := enabled
      isProtected && !enabled
    }
    val isEnable = isAt(RegisterEnable) || isAt(EscEnable)
    write.refused := !isEnable &&
      (closed("esc", EscEnable) || (closed("register", RegisterEnable) && write.isRegister))
  }
}

package flyframe.application

import chisel3._
import chisel3.util._
import flyframe.memory.{RegisterBus, RegisterUnit}
import flyframe.registers.ResetRegisters

/** Asks for a reset of the whole chip when bus or host have written the sequence for it (SYS-04, B-72).
  *
  * @param request
  *   the pin; high from the last value on, until there is a reset
  */
class ResetRequest(request: Bool) extends RegisterUnit(ResetRegisters.all) {
  private val Complete = ResetRegisters.Sequence.size

  def connect(bus: RegisterBus): Unit = {
    val added = RegInit(false.B) // the frame has written a value; reset: none has
    val ecat  = progress(bus, "reset_ecat", cancel = bus.nextFrame && !added, isFirst = !added)
    val pdi   = progress(bus, "reset_pdi", cancel = bus.hostAccess && !bus.hostWrites("reset_pdi"))
    when(bus.nextFrame) { added := false.B }
    when(bus.writes("reset_ecat")) { added := true.B }
    // In a register, as a spike would reset the chip. Reset: nothing is asked for.
    request := RegNext(ecat === Complete.U || pdi === Complete.U, false.B)
  }

  /** How many values of the sequence are written; `isFirst`: the one that is written now may be the next. */
  private def progress(bus: RegisterBus, register: String, cancel: Bool, isFirst: Bool = true.B): UInt = {
    val count  = RegInit(0.U(2.W)).suggestName(register) // reset: none
    val byte   = bus.writtenBytes(register).head
    val wanted = VecInit(ResetRegisters.Sequence.map(_.U(8.W)) :+ 0.U(8.W))(count)
    when(count =/= Complete.U) {
      when(cancel) { count := 0.U }
      when(byte.valid) { count := Mux(byte.bits === wanted && isFirst, count + 1.U, 0.U) }
    }
    bus.status(register) := count
    count
  }
}

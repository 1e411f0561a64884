package flyframe.memory

import chisel3._
import chisel3.util._
import flyframe.registers.{Register, RegisterNames}

/** Register writes as they take effect, whoever they come from, by the names of registers and fields: each is
  * seen in the one cycle behind which the register has its new value.
  *
  * @param registers
  *   those that can be named
  */
class RegisterWrites(registers: Seq[Register], val write: Valid[RegisterWrite]) {
  protected val names: RegisterNames = new RegisterNames(registers)

  private def byte(address: Int): Valid[UInt] = write.bits.byteAt(write.valid, address)

  /** A byte of the register is written. */
  def writes(register: String): Bool = names.register(register).range.map(byte(_).valid).reduce(_ || _)

  /** The first byte of the register is written. */
  def begins(register: String): Bool = byte(names.register(register).address).valid

  /** The last byte of the register is written. */
  def completes(register: String): Bool = byte(names.register(register).range.last).valid

  /** What is written to the field, which lies in one byte; valid when that is. */
  def written(field: String): Valid[UInt] = {
    val place  = names.field(field)
    val source = byte(place.byte)
    val result = Wire(Valid(UInt(place.field.width.W)))
    result.valid := source.valid
    result.bits  := source.bits(place.high, place.low)
    result
  }

  /** What is written to the bytes of the field, lowest first. */
  def writtenBytes(field: String): Seq[Valid[UInt]] = names.field(field).bytes.map(byte)
}

package flyframe.can

import chisel3._

/** A run of equal bits: what stuffing needs to know (CAN-09). */
class EqualBits extends Bundle {

  /** The level of the last bit, and how many of that level came in a row, modulo 8. */
  val level = Bool()
  val count = UInt(3.W)

  /** The next bit is a stuff bit, and of the other level. */
  def isFull: Bool = count === EqualBits.Most.U

  /** The run behind one more bit. */
  def and(bit: Bool): EqualBits = {
    val next = Wire(new EqualBits)
    next.level := bit
    next.count := Mux(bit === level && count =/= 0.U, count + 1.U, 1.U)
    next
  }
}

object EqualBits {

  /** Behind so many equal bits comes one of the other level. */
  val Most = 5

  /** No bit yet. */
  def none: EqualBits = 0.U.asTypeOf(new EqualBits)

  /** One dominant bit: the start of a frame. */
  def start: EqualBits = {
    val run = Wire(new EqualBits)
    run.level := false.B
    run.count := 1.U
    run
  }
}

/** A CRC that takes one bit at a time, most significant bit first.
  *
  * @param width
  *   of its register
  * @param polynomial
  *   without the highest term
  */
final case class SerialCrc(width: Int, polynomial: BigInt) {

  /** The register behind one more bit. The bits of the CRC itself leave 0 if all were right. */
  def and(crc: UInt, bit: Bool): UInt =
    (crc << 1)(width - 1, 0) ^ Mux(crc(width - 1) ^ bit, polynomial.U(width.W), 0.U)
}

object SerialCrc {

  /** That of CAN frames (CAN-09); it starts with 0. */
  val Can: SerialCrc = SerialCrc(15, 0x4599)
}

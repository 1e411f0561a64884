package flyframe.frame

import chisel3._
import chisel3.util._
import flyframe.fmmu.Mapped

/** A local byte with what is to be written to it.
  *
  * @param isProtected
  *   see [[Fetched]]
  */
class WrittenByte(isProtected: Boolean) extends Bundle {

  /** Bit 16: there is nothing. */
  val address = UInt(17.W)

  /** It may be written. */
  val may  = Bool()
  val data = UInt(8.W)

  /** Its bits that are written; see [[flyframe.memory.EcatAccess]]. */
  val mask = UInt(8.W)

  /** See [[Fetched.isRegister]]. */
  val isRegister = UInt((if (isProtected) 1 else 0).W)
}

/** Moves the bits of a byte of a datagram between the nibbles that pass and local bytes: *move* in
  * [[TranslatedAccess]].
  *
  * @param bitwise
  *   FMMUs map bits
  * @param isProtected
  *   see [[Fetched]]
  */
abstract class ByteMover(bitwise: Boolean, isProtected: Boolean) extends Module {
  val schedule = IO(Input(new Schedule))

  /** The local byte that is read, whether it may be, and where the byte of the datagram leads: all from the
    * cycle before its first nibble ends to its end.
    */
  val readByte = IO(Input(UInt(8.W)))
  val isRead   = IO(Input(Bool()))
  val readFrom = IO(Input(new Mapped(bitwise)))

  /** The nibble that passes, and which of its bits are read. */
  val high       = IO(Input(Bool()))
  val readNibble = IO(Output(UInt(4.W)))
  val readMask   = IO(Output(UInt(4.W)))

  /** The byte that has passed, if it is to be written: pulses in the cycles 0 and 1 behind it. It is the last
    * one of the datagram.
    */
  val passed = IO(Input(UInt(8.W)))
  val first  = IO(Input(Bool()))
  val second = IO(Input(Bool()))
  val isLast = IO(Input(Bool()))

  /** The local byte it leads to; and where. */
  val address = IO(Input(UInt(17.W)))
  val may     = IO(Input(Bool()))
  val writeTo = IO(Input(new Mapped(bitwise)))

  /** See [[Fetched.isRegister]]. */
  val isRegister = IO(Input(UInt((if (isProtected) 1 else 0).W)))

  /** A local byte is complete. */
  val written = IO(Output(Valid(new WrittenByte(isProtected))))
}

/** For whole bytes: each is a local one. */
class WholeByteMover(isProtected: Boolean) extends ByteMover(false, isProtected) {
  readNibble := Mux(high, readByte(7, 4), readByte(3, 0))
  readMask   := Fill(4, isRead)

  written.valid           := second
  written.bits.address    := address
  written.bits.may        := may
  written.bits.data       := passed
  written.bits.mask       := 0xff.U
  written.bits.isRegister := isRegister
}

/** For bits: those of a byte of the datagram lie in two local bytes, the upper one and the one before. */
class BitMover(isProtected: Boolean) extends ByteMover(true, isProtected) {

  /** Where the bits of a byte of the datagram are. */
  private class Bits(m: Mapped) {
    private val bits = m.bits.get
    private val low  = Mux(bits.first, bits.startBit, 0.U)
    private val high = Mux(bits.last, bits.stopBit, 7.U)
    private val some = m.hit && !bits.early && !m.before && low <= high
    val turn         = bits.turn
    val isLast       = bits.last

    /** The bit `b` of the byte is mapped; it lies in the lower local byte. */
    def has(b: UInt): Bool     = some && b >= low && b <= high
    def inLower(b: UInt): Bool = turn.orR && !(b +& turn)(3)

    /** Bit `i` of a local byte: it belongs to the lower one. */
    def isLower(i: Int): Bool = turn.orR && i.U >= turn

    /** There are bits in the lower, in the upper one. */
    def lower: Bool = some && inLower(low)
    def upper: Bool = some && !inLower(high)
  }
  private def rotateRight(bits: Seq[Bool], by: UInt): Seq[Bool] = (0 to 2).foldLeft(bits) { (all, k) =>
    all.indices.map(i => Mux(by(k), all((i + (1 << k)) % 8), all(i)))
  }

  // Reading: this local byte and the one before.
  private val byteBefore   = RegEnable(readByte(7, 1), schedule.ends) // bit 0 is never in the lower one
  private val isReadBefore = RegEnable(isRead, schedule.ends)
  private val from         = new Bits(readFrom)
  private val both = readByte(0) +: (1 to 7).map(i => Mux(from.isLower(i), byteBefore(i - 1), readByte(i)))
  readNibble := VecInit(rotateRight(both, from.turn ^ (high ## 0.U(2.W))).take(4)).asUInt
  readMask := VecInit((0 to 3).map { i =>
    val bit = high ## i.U(2.W)
    from.has(bit) && Mux(from.inLower(bit), isReadBefore, isRead)
  }).asUInt

  // Writing: the last bits of the lower byte come in the first cycle; the upper one follows in the
  // second, and waits for more unless none are to come. Both are written at once: the lower one before
  // the next byte is read, the upper one after that (B-48).
  private val to = new Bits(writeTo)
  private def turned(bits: Int => Bool, lower: Boolean): UInt = {
    val local = rotateRight((0 to 7).map(bits), 0.U - to.turn)
    VecInit((0 to 7).map(i => local(i) && to.isLower(i) === lower.B)).asUInt
  }
  private def data(lower: Boolean): UInt = turned(i => passed(i) && to.has(i.U(3.W)), lower)
  private def mask(lower: Boolean): UInt = turned(i => to.has(i.U(3.W)), lower)
  private val upper                      = Wire(new WrittenByte(isProtected))
  upper.address    := address
  upper.may        := may
  upper.data       := data(lower = false)
  upper.mask       := mask(lower = false)
  upper.isRegister := isRegister
  private val upperBefore = RegEnable(upper, second)
  private val lower       = WireDefault(upperBefore)
  lower.data := upperBefore.data | data(lower = true)
  lower.mask := upperBefore.mask | mask(lower = true)
  private val upperIsComplete = !to.turn.orR || to.isLast || isLast
  written.bits  := Mux(first, lower, upper)
  written.valid := (first && to.lower) || (second && to.upper && upperIsComplete)
}

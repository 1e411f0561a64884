package flyframe.fmmu

import chisel3._

/** Where a byte of a datagram leads, for one direction: what is found for it is kept in block RAM until the
  * byte has passed.
  *
  * @param bitwise
  *   FMMUs map bits
  */
class Mapped(bitwise: Boolean) extends Bundle {
  val hit = Bool()

  /** Local address; if bits are mapped, of the upper one of the two bytes that they may lie in. Bit 16:
    * beyond the address space.
    */
  val address = UInt(17.W)

  /** It is the byte before the datagram's first. */
  val before = Bool()

  /** What is different when bits are mapped. */
  val bits: Option[MappedBits] = Option.when(bitwise)(new MappedBits)

  /** The byte is needed only for bits of the byte behind it. */
  def early: Bool = before || bits.fold(false.B)(_.early)

  /** There is something for the byte at `address`. */
  def exists: Bool = hit && !address(16) && bits.fold(!before)(_.needsUpper(before))
}

/** The bits of a run may lie anywhere in the local bytes, so those of one logical byte lie in two
  * neighbouring local bytes: the upper one, and the one before it, which the logical byte before led to.
  */
class MappedBits extends Bundle {

  /** The logical byte is the first, the last of the FMMU. */
  val first = Bool()
  val last  = Bool()

  /** It is the one before the first: nothing of it is mapped, but the first local byte is needed already. */
  val early = Bool()

  /** First mapped bit of the first, last one of the last logical byte. */
  val startBit = UInt(3.W)
  val stopBit  = UInt(3.W)

  /** Bits from a logical bit to its local bit, modulo 8. */
  val turn = UInt(3.W)

  /** The upper byte is needed: it has mapped bits, if it is not the end of a run that ends in the byte
    * before. The byte before a datagram is needed for the bits of the first one that lie in it.
    */
  def needsUpper(before: Bool): Bool =
    Mux(before, turn.orR && (early || !last), early || !last || !turn.orR || (stopBit +& turn)(3))
}

object MappedBits {

  /** All bits of a byte, in their places. */
  def whole: MappedBits = 0.U.asTypeOf(new MappedBits)
}

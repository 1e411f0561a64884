package flyframe.model

/** The bits of one logical byte that lie in one local byte.
  *
  * @param address
  *   local address; above 0xFFFF there is nothing
  * @param shift
  *   bit `i` of the logical byte is bit `i + shift` of the local one
  * @param mask
  *   the mapped bits, as bits of the logical byte
  */
final case class MappedByte(address: Int, shift: Int, mask: Int) {

  /** Of the two local bytes of a logical one, the one that it shares with the logical byte before. */
  def isLower: Boolean = shift > 0

  /** The local byte, seen as bits of the logical one. */
  def toLogical(local: Int): Int = FmmuModel.shifted(local, -shift) & mask

  /** The logical byte, seen as bits of the local one; unmapped bits are 0. */
  def toLocal(logical: Int): Int = FmmuModel.shifted(logical & mask, shift) & 0xff
}

/** One FMMU as it is configured: translation of a logical byte (FMMU-01 to FMMU-04, B-45 to B-47). */
final case class FmmuModel(
    active: Boolean,
    forReads: Boolean,
    forWrites: Boolean,
    logicalStart: Long,
    length: Int,
    startBit: Int,
    stopBit: Int,
    physicalStart: Int,
    physicalBit: Int
) {

  /** It acts on this logical byte (FMMU-05), whether or not a bit of it is mapped. */
  def covers(logical: Long): Boolean =
    active && logical <= 0xffffffffL && logical >= logicalStart && logical < logicalStart + length

  /** Local bits are at other places of their bytes than the logical ones. */
  def isShifted: Boolean             = physicalBit != startBit
  def isLast(logical: Long): Boolean = logical == logicalStart + length - 1

  /** The lower local byte of this logical one is asked for a byte time early: it is that of the logical byte
    * before too, or the bits move up.
    */
  def needsEarly(logical: Long): Boolean =
    isShifted && (logical > logicalStart || physicalBit > startBit)

  /** Where the bits of a byte it covers are: none, one or two local bytes, in ascending order. */
  def map(logical: Long): Seq[MappedByte] = {
    val first = 8 * (logical - logicalStart).toInt // number of the byte's bit 0 within the range
    val mapped = (0 until 8).filter { i =>
      first + i >= startBit && first + i <= 8 * (length - 1) + stopBit
    }
    val local = mapped.map(i => i -> (8 * physicalStart + physicalBit + first + i - startBit))
    local.groupBy(_._2 / 8).toSeq.sortBy(_._1).map { case (address, bits) =>
      MappedByte(address, bits.head._2 % 8 - bits.head._1, bits.map(1 << _._1).sum)
    }
  }
}

object FmmuModel {
  private[model] def shifted(byte: Int, by: Int): Int = if (by >= 0) byte << by else byte >> -by

  /** Number `n` as the registers configure it; not `bitwise`: the bit registers have no effect (B-46). */
  def of(registers: ModelRegisters, n: Int, bitwise: Boolean): FmmuModel = {
    def value(name: String) = registers.value(s"fmmu${n}_$name")
    FmmuModel(
      active = value("activate") == 1,
      forReads = (value("type") & 1) != 0,
      forWrites = (value("type") & 2) != 0,
      logicalStart = registers.wide(s"fmmu${n}_logical_start"),
      length = value("length"),
      startBit = if (bitwise) value("start_bit") else 0,
      stopBit = if (bitwise) value("stop_bit") else 7,
      physicalStart = value("physical_start"),
      physicalBit = if (bitwise) value("physical_bit") else 0
    )
  }
}

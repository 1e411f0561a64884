package flyframe.relay

/** The two CRCs of link frames (FR-41), bit by bit; true is recessive, 1. Most significant bit first. */
object LinkCrc {

  /** What both begin with; both are sent inverted. */
  val Start8: Int  = 0xff
  val Start32: Int = -1

  /** CRC-8 of the header, polynomial 0x2F. */
  def next8(crc: Int, bit: Boolean): Int = {
    val shifted = crc << 1 & 0xff
    if (((crc & 0x80) != 0) != bit) shifted ^ 0x2f else shifted
  }

  /** CRC-32 of the frame, polynomial 0x04C11DB7, not reflected. */
  def next32(crc: Int, bit: Boolean): Int = {
    val shifted = crc << 1
    if ((crc < 0) != bit) shifted ^ 0x04c11db7 else shifted
  }

  /** The CRC field. */
  def of(bits: Iterable[Boolean]): Int = ~bits.foldLeft(Start32)(next32)
}

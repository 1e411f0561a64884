package flyframe.can

/** The CRC of CAN frames (CAN-09): 15 bits, from 0. */
object Crc15 {

  /** The CRC after one more bit; true is recessive, 1. */
  def next(crc: Int, bit: Boolean): Int = {
    val shifted = crc << 1 & 0x7fff
    if (((crc & 0x4000) != 0) != bit) shifted ^ 0x4599 else shifted
  }

  /** Of bits in the order on the wire. */
  def of(bits: Iterable[Boolean]): Int = bits.foldLeft(0)(next)
}

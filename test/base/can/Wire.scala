package flyframe.can

/** A bit on the wire, and what it is. The names are those of the frame format, so that a test says which bit
  * it means: sof, id, rtr, srr, ide, ext, fdf (r0 of a base frame, r1 of an extended one), r0, dlc, data,
  * crc.
  *
  * @param index
  *   in its part, from 0
  * @param isStuff
  *   a stuff bit; part and index are those of the bit in front of it
  */
final case class WireBit(level: Char, part: String, index: Int, isStuff: Boolean)

/** A frame as its transmitter sends it, from SOF to the end of the CRC, written from the standard and not
  * from the model. A level is '0', dominant, or '1'.
  *
  * @param srr
  *   level of SRR
  * @param fdf
  *   level of the bit behind IDE or the RTR of an extended frame
  * @param r0
  *   level of r0 of an extended frame
  * @param crcError
  *   bits in which the CRC is wrong
  */
final case class Wire(
    frame: CanFrame,
    srr: Char = '1',
    fdf: Char = '0',
    r0: Char = '0',
    crcError: Int = 0
) {
  private def number(part: String, value: Long, bits: Int): Seq[(Char, String, Int)] =
    Wire.binary(value, bits).zipWithIndex.map { case (level, i) => (level, part, i) }

  private val unstuffed: Seq[(Char, String, Int)] = {
    val rtr = if (frame.remote) 1L else 0L
    val identifier =
      if (frame.extended)
        number("id", frame.id >> 18, 11) ++ Seq((srr, "srr", 0), ('1', "ide", 0)) ++
          number("ext", frame.id & 0x3ffff, 18) ++ number("rtr", rtr, 1) ++ Seq(
            (fdf, "fdf", 0),
            (r0, "r0", 0)
          )
      else number("id", frame.id, 11) ++ number("rtr", rtr, 1) ++ Seq(('0', "ide", 0), (fdf, "fdf", 0))
    val data = frame.data.zipWithIndex.flatMap { case (byte, i) =>
      number("data", byte, 8).map(b => b.copy(_3 = b._3 + 8 * i))
    }
    Seq(('0', "sof", 0)) ++ identifier ++ number("dlc", frame.dlc, 4) ++ data
  }

  /** The CRC that is sent. */
  val crc: Int = Wire.remainder(unstuffed.map(_._1).mkString) ^ crcError

  val bits: Seq[WireBit] = {
    val all = unstuffed ++ number("crc", crc, 15)
    all.foldLeft(Vector.empty[WireBit]) { case (sent, (level, part, index)) =>
      val next = sent :+ WireBit(level, part, index, isStuff = false)
      val five = next.takeRight(5).map(_.level)
      if (five.size == 5 && five.distinct.size == 1)
        next :+ WireBit(Wire.not(level), part, index, isStuff = true)
      else next
    }
  }

  /** The levels, SOF to the end of the CRC. */
  val levels: String = bits.map(_.level).mkString

  /** Where bit `index` of `part` stands in them. */
  def at(part: String, index: Int = 0): Int =
    bits.indexWhere(b => b.part == part && b.index == index && !b.isStuff)

  /** Where stuff bits stand. */
  def stuffBits: Seq[Int] = bits.indices.filter(bits(_).isStuff)
}

object Wire {

  /** CRC delimiter, ACK slot with nobody who acknowledges, ACK delimiter. */
  val Ack = "111"
  val Eof = "1111111"

  /** The end of a frame that is acknowledged, and the intermission. */
  val Acked        = "101"
  val Intermission = "111"

  def not(level: Char): Char = if (level == '0') '1' else '0'

  def binary(value: Long, bits: Int): String =
    (bits - 1 to 0 by -1).map(i => if ((value >> i & 1) == 1) '1' else '0').mkString

  /** The remainder of a division by the polynomial of CAN, by hand. */
  def remainder(bits: String): Int = {
    val polynomial = "1100010110011001" // x^15 and 0x4599
    val digits     = (bits + "0" * 15).toCharArray
    for (i <- bits.indices if digits(i) == '1'; j <- polynomial.indices)
      digits(i + j) = if (digits(i + j) == polynomial(j)) '0' else '1'
    Integer.parseInt(digits.takeRight(15).mkString, 2)
  }
}

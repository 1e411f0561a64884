package flyframe.model

/** The Ethernet frame check sequence, by the CRC-32 of the Java library. */
object Fcs {

  /** The four FCS bytes in the order they are sent. */
  def of(bytes: Seq[Int]): Seq[Int] = {
    val crc = new java.util.zip.CRC32
    crc.update(bytes.map(_.toByte).toArray)
    (0 until 4).map(i => (crc.getValue >> (8 * i) & 0xff).toInt)
  }

  /** `bytes` end with the FCS of what stands before. */
  def good(bytes: Seq[Int]): Boolean = bytes.size >= 4 && of(bytes.dropRight(4)) == bytes.takeRight(4)

  /** What must be added (XOR) to the FCS of `before` to get that of `after`; both have the same length.
    *
    * The CRC is linear, so this is right whatever else the FCS field held.
    */
  def change(before: Seq[Int], after: Seq[Int]): Seq[Int] =
    of(before).zip(of(after)).map { case (a, b) => a ^ b }
}

package flyframe

/** Builds frames by hand, for tests that must not depend on the golden model. */
object Frames {

  /** A datagram: 10 bytes of header, data, working counter. */
  def datagram(
      command: Int,
      adp: Int,
      ado: Int,
      data: Seq[Int],
      workingCounter: Int = 0,
      more: Boolean = false,
      circulating: Boolean = false,
      index: Int = 0x80,
      irq: Int = 0
  ): Seq[Int] = {
    val length = data.size | (if (circulating) 1 << 14 else 0) | (if (more) 1 << 15 else 0)
    Seq(command, index) ++ Seq(adp, ado, length, irq).flatMap(word) ++ data ++ word(workingCounter)
  }

  /** Little-endian bytes of a 16-bit value. */
  def word(value: Int): Seq[Int] = Seq(value & 0xff, value >> 8 & 0xff)

  val addresses: Seq[Int] = Seq(1, 1, 5, 4, 0, 0) ++ Seq(0x10, 0x20, 0x30, 0x40, 0x50, 0x60)

  /** EtherCAT header and datagrams in an Ethernet II frame, padded to 60 bytes, without FCS. */
  def ethercat(datagrams: Seq[Int]*): Seq[Int] = padded(addresses ++ Seq(0x88, 0xa4) ++ area(datagrams: _*))

  def vlan(datagrams: Seq[Int]*): Seq[Int] =
    padded(addresses ++ Seq(0x81, 0x00, 0xe0, 0x05, 0x88, 0xa4) ++ area(datagrams: _*))

  def udp(datagrams: Seq[Int]*): Seq[Int] = {
    val content = area(datagrams: _*)
    val ip      = Seq(0x45, 0, 0, 28 + content.size, 0, 0, 0, 0, 64, 0x11, 0, 0, 10, 0, 0, 1, 10, 0, 0, 2)
    val header  = Seq(0x88, 0xa4, 0x88, 0xa4, 0, 8 + content.size, 0xbe, 0xef)
    padded(addresses ++ Seq(0x08, 0x00) ++ ip ++ header ++ content)
  }

  private def area(datagrams: Seq[Int]*): Seq[Int] = {
    val content = datagrams.flatten
    word(content.size | 0x1000) ++ content
  }

  def padded(bytes: Seq[Int]): Seq[Int] = bytes.padTo(60, 0)

  /** The FCS, least significant byte first, by the JDK's own CRC-32. */
  def fcs(bytes: Seq[Int]): Seq[Int] = {
    val crc = new java.util.zip.CRC32
    crc.update(bytes.map(_.toByte).toArray)
    (0 until 4).map(i => (crc.getValue >> (8 * i) & 0xff).toInt)
  }

  def withFcs(bytes: Seq[Int]): Seq[Int] = bytes ++ fcs(bytes)

  /** Whether the last four bytes are the FCS of those before. */
  def fcsGood(bytes: Seq[Int]): Boolean = bytes.size >= 4 && fcs(bytes.dropRight(4)) == bytes.takeRight(4)

  def nibbles(bytes: Seq[Int]): Seq[Int] = bytes.flatMap(b => Seq(b & 0xf, b >> 4))

  /** With preamble and SFD. */
  def symbols(bytes: Seq[Int], preamble: Int = 15): Seq[Int] = Seq.fill(preamble)(5) ++ Seq(0xd) ++ nibbles(bytes)
}

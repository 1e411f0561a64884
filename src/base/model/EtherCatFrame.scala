package flyframe.model

import flyframe.protocol.EtherType

/** A datagram to be built (FP-12). `address` is ADP in the low and ADO in the high half, or one logical
  * address.
  */
final case class Datagram(
    command: Int,
    address: Long,
    data: Seq[Int],
    index: Int = 0,
    circulating: Boolean = false,
    irq: Int = 0,
    workingCounter: Int = 0,
    reserved: Int = 0
) {
  def bytes(more: Boolean): Seq[Int] = {
    val length = data.size | reserved << 11 | (if (circulating) 1 << 14 else 0) | (if (more) 1 << 15 else 0)
    Seq(command, index) ++ (0 until 4).map(i => (address >> (8 * i) & 0xff).toInt) ++
      EtherCatFrame.little(length) ++ EtherCatFrame.little(irq) ++ data ++ EtherCatFrame.little(
        workingCounter
      )
  }
}

object Datagram {

  /** A datagram with position or station address `adp` and local address `ado`. */
  def apply(command: Int, adp: Int, ado: Int, data: Seq[Int]): Datagram =
    Datagram(command, (adp & 0xffff) | (ado & 0xffff).toLong << 16, data)
}

/** The four forms of FP-02. */
sealed abstract class Encapsulation(val vlan: Boolean, val udp: Boolean)
object Encapsulation {
  case object Basic   extends Encapsulation(false, false)
  case object Vlan    extends Encapsulation(true, false)
  case object Udp     extends Encapsulation(false, true)
  case object VlanUdp extends Encapsulation(true, true)
  val all: Seq[Encapsulation] = Seq(Basic, Vlan, Udp, VlanUdp)
}

/** Builds EtherCAT frames, without FCS. */
object EtherCatFrame {
  private val addresses = Seq(0x01, 0x01, 0x05, 0x04, 0x00, 0x00) ++ Seq(0x10, 0x22, 0x33, 0x44, 0x55, 0x66)

  def little(word: Int): Seq[Int]      = Seq(word & 0xff, word >> 8 & 0xff)
  private def big(word: Int): Seq[Int] = little(word).reverse

  /** Padded to 60 bytes. */
  def apply(
      datagrams: Seq[Datagram],
      form: Encapsulation = Encapsulation.Basic,
      headerType: Int = 1
  ): Seq[Int] = {
    val area    = datagrams.zipWithIndex.flatMap { case (d, i) => d.bytes(more = i < datagrams.size - 1) }
    val content = little((area.size & 0x7ff) | headerType << 12) ++ area
    val tag     = if (form.vlan) Seq(0x81, 0x00, 0xa0, 0x05) else Nil
    val inner   = if (form.udp) Seq(0x08, 0x00) ++ ipUdp(content.size) else Seq(0x88, 0xa4)
    (addresses ++ tag ++ inner ++ content).padTo(60, 0)
  }

  private def ipUdp(content: Int): Seq[Int] =
    Seq(0x45, 0) ++ big(28 + content) ++ Seq(0x12, 0x34, 0x40, 0, 64, 0x11, 0xab, 0xcd, 10, 0, 0, 1, 10, 0, 0,
      2) ++
      big(EtherType.EtherCat) ++ big(EtherType.EtherCat) ++ big(8 + content) ++ Seq(0xbe, 0xef)
}

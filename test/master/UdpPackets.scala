package flyframe.master

import java.net.{Inet4Address, InetAddress}
import chiseltest._
import org.pcap4j.packet._
import org.pcap4j.packet.namednumber._
import org.pcap4j.util.MacAddress

/** UDP datagrams by pcap4j, which knows nothing of our RTL. */
object UdpPackets {

  /** One end of a connection. */
  case class End(mac: Long, ip: Long, port: Int) {
    private def bytes(value: Long, count: Int) =
      (count - 1 to 0 by -1).map(i => (value >> (8 * i)).toByte).toArray
    def address: Inet4Address = InetAddress.getByAddress(bytes(ip, 4)).asInstanceOf[Inet4Address]
    def station: MacAddress   = MacAddress.getByAddress(bytes(mac, 6))
    def poke(e: UdpEnd): Unit = {
      e.mac.poke(mac)
      e.ip.poke(ip)
      e.port.poke(port)
    }
  }

  /** A frame with a UDP datagram, as pcap4j makes it. */
  def packet(
      from: End,
      to: End,
      payload: Seq[Int],
      udpChecksum: Boolean = true,
      fragment: Boolean = false,
      protocol: IpNumber = IpNumber.UDP
  ): Vector[Int] = {
    val data = new UnknownPacket.Builder().rawData(payload.map(_.toByte).toArray)
    val udp = new UdpPacket.Builder()
      .srcPort(UdpPort.getInstance(from.port.toShort))
      .dstPort(UdpPort.getInstance(to.port.toShort))
      .srcAddr(from.address)
      .dstAddr(to.address)
      .payloadBuilder(data)
      .correctLengthAtBuild(true)
      .correctChecksumAtBuild(udpChecksum)
    val ip = new IpV4Packet.Builder()
      .version(IpVersion.IPV4)
      .tos(IpV4Rfc791Tos.newInstance(0.toByte))
      .ttl(64.toByte)
      .identification(0x1234.toShort)
      .moreFragmentFlag(fragment)
      .protocol(protocol)
      .srcAddr(from.address)
      .dstAddr(to.address)
      .payloadBuilder(udp)
      .correctChecksumAtBuild(true)
      .correctLengthAtBuild(true)
    val bytes = new EthernetPacket.Builder()
      .dstAddr(to.station)
      .srcAddr(from.station)
      .`type`(EtherType.IPV4)
      .payloadBuilder(ip)
      .paddingAtBuild(true)
      .build()
      .getRawData
    bytes.map(_ & 0xff).toVector
  }
}

package flyframe.ethernet

import java.net.{Inet4Address, InetAddress}
import chisel3._
import chisel3.util._
import chiseltest._
import flyframe.ram.DualPortRam
import flyframe.registers.NetworkAddresses
import org.pcap4j.packet._
import org.pcap4j.packet.namednumber._
import org.pcap4j.util.MacAddress

/** Where a test writes settings. */
class SettingsPort extends Bundle {
  val write   = Bool()
  val address = UInt(NetworkSettings.AddressBits.W)
  val data    = UInt(8.W)
}

/** A unit of the plant network with its settings. */
abstract class SettingsBench(readers: Int) extends Module {
  val port               = IO(Input(new SettingsPort))
  protected val settings = Module(new NetworkSettings(readers))
  settings.write        := port.write
  settings.writeAddress := port.address
  settings.writeData    := port.data

  /** Writes the addresses of both ends. */
  def load(master: UdpPackets.End, server: UdpPackets.End): Unit = {
    val bytes =
      UdpPackets.big(server.mac, 6) ++ UdpPackets.big(master.mac, 6) ++ UdpPackets.big(master.ip, 4) ++
        UdpPackets.big(server.ip, 4) ++ UdpPackets.big(master.port, 2) ++ UdpPackets.big(server.port, 2)
    port.write.poke(true)
    for ((b, i) <- bytes.zipWithIndex) {
      port.address.poke(NetworkAddresses.First + i)
      port.data.poke(b)
      clock.step()
    }
    port.write.poke(false)
  }
}

/** Both units that look at what comes from the plant network. */
class PlantBench extends SettingsBench(2) {
  val byte             = IO(Flipped(Valid(UInt(8.W))))
  val first            = IO(Input(Bool()))
  val end              = IO(Flipped(Valid(Bool())))
  private val expected = Module(new ExpectedByte)
  private val receiver = Module(new UdpReceiver)
  private val arp      = Module(new ArpResponder)
  val data             = IO(chiselTypeOf(receiver.data))
  val offset           = IO(chiselTypeOf(receiver.offset))
  val received         = IO(chiselTypeOf(receiver.received))
  val answer           = IO(Decoupled(new FrameByte))
  expected.byte    := byte
  expected.end     := end
  expected.setting := settings.readData(0)
  receiver.byte    := byte
  receiver.first   := first
  receiver.end     := end
  receiver.at      := expected.at
  receiver.same    := expected.same
  receiver.mine    := expected.mine
  arp.byte         := byte
  arp.first        := first
  arp.end          := end
  arp.at           := expected.at
  arp.same         := expected.same
  arp.mine         := expected.mine
  arp.granted      := true.B
  private val askers = DualPortRam(32, 8)(clock)
  askers.io.write        := arp.note.valid
  askers.io.writeAddress := arp.noteAddress
  askers.io.writeData    := arp.note.bits
  askers.io.readAddress  := arp.readAddress
  arp.asker              := askers.io.readData
  settings.readAddress   := VecInit(Seq(expected.address, arp.settingAddress).map(NetworkSettings.ofNetwork))
  arp.setting            := settings.readData(1)
  data                   := receiver.data
  offset                 := receiver.offset
  received               := receiver.received
  answer <> arp.bytes
}

/** UDP datagrams by pcap4j, which knows nothing of our RTL. */
object UdpPackets {

  /** Bytes of a number, highest first. */
  def big(value: Long, bytes: Int): Seq[Int] =
    (bytes - 1 to 0 by -1).map(i => (value >> (8 * i) & 0xff).toInt)

  /** One end of a connection. */
  case class End(mac: Long, ip: Long, port: Int) {
    private def bytes(value: Long, count: Int) =
      (count - 1 to 0 by -1).map(i => (value >> (8 * i)).toByte).toArray
    def address: Inet4Address = InetAddress.getByAddress(bytes(ip, 4)).asInstanceOf[Inet4Address]
    def station: MacAddress   = MacAddress.getByAddress(bytes(mac, 6))
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

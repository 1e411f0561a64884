package flyframe.ethernet

import java.net.InetAddress
import chisel3._
import chiseltest._
import flyframe.SharedSimulation
import org.pcap4j.packet._
import org.pcap4j.packet.namednumber._
import org.pcap4j.util.MacAddress
import org.scalatest.flatspec.AnyFlatSpec

/** Against packets that pcap4j builds and takes apart. */
class ArpResponderSpec extends AnyFlatSpec with SharedSimulation {
  private def is(b: Bool) = b.peekBoolean()
  private val own         = MacAddress.getByName("10:22:33:44:55:66")
  private val asker       = MacAddress.getByName("0a:0b:0c:0d:0e:0f")
  private val ownIp       = InetAddress.getByName("192.168.1.5")
  private val askerIp     = InetAddress.getByName("192.168.1.254")

  private def packet(
      to: MacAddress = MacAddress.ETHER_BROADCAST_ADDRESS,
      target: InetAddress = ownIp,
      operation: ArpOperation = ArpOperation.REQUEST
  ): Vector[Int] = {
    val arp = new ArpPacket.Builder()
      .hardwareType(ArpHardwareType.ETHERNET)
      .protocolType(EtherType.IPV4)
      .hardwareAddrLength(6.toByte)
      .protocolAddrLength(4.toByte)
      .operation(operation)
      .srcHardwareAddr(asker)
      .srcProtocolAddr(askerIp)
      .dstHardwareAddr(MacAddress.getByName("00:00:00:00:00:00"))
      .dstProtocolAddr(target)
    new EthernetPacket.Builder()
      .dstAddr(to)
      .srcAddr(asker)
      .`type`(EtherType.ARP)
      .payloadBuilder(arp)
      .paddingAtBuild(true)
      .build()
      .getRawData
      .map(_ & 0xff)
      .toVector
  }

  private def ask(
      dut: PlantBench,
      bytes: Seq[Int],
      good: Boolean = true,
      fcs: Seq[Int] = Seq(1, 2, 3, 4)
  ): Option[EthernetPacket] = {
    dut.load(UdpPackets.End(0x102233445566L, 0xc0a80105L, 1), UdpPackets.End(2, 3, 4))
    dut.end.valid.poke(false)
    dut.answer.ready.poke(false)
    for ((b, i) <- (bytes ++ fcs).zipWithIndex) {
      dut.byte.valid.poke(true)
      dut.byte.bits.poke(b)
      dut.first.poke(i == 0)
      dut.clock.step()
      dut.byte.valid.poke(false)
      dut.clock.step()
    }
    dut.byte.valid.poke(false)
    dut.end.valid.poke(true)
    dut.end.bits.poke(good)
    dut.clock.step()
    dut.end.valid.poke(false)
    dut.clock.step(4)
    Option.when(is(dut.answer.valid)) {
      var answer = Vector.empty[Byte]
      var ended  = false
      while (!ended) {
        val ready = answer.size % 3 == 0 || dut.answer.bits.last.peekBoolean()
        dut.answer.ready.poke(ready)
        if (ready && is(dut.answer.valid)) {
          answer :+= dut.answer.bits.data.peekInt().toByte
          ended = is(dut.answer.bits.last)
        }
        dut.clock.step()
        if (!ready) {
          dut.answer.ready.poke(true)
          if (is(dut.answer.valid)) {
            answer :+= dut.answer.bits.data.peekInt().toByte
            ended = is(dut.answer.bits.last)
          }
          dut.clock.step()
        }
      }
      dut.answer.ready.poke(false)
      EthernetPacket.newPacket(answer.toArray, 0, answer.size)
    }
  }

  together("requests", new PlantBench)(
    "MST-12: requests for the own address, to all or to this station, are answered" -> { dut =>
      for (to <- Seq(MacAddress.ETHER_BROADCAST_ADDRESS, own)) {
        val answer = ask(dut, packet(to)).get
        assert(answer.getHeader.getDstAddr == asker && answer.getHeader.getSrcAddr == own)
        val arp = answer.get(classOf[ArpPacket]).getHeader
        assert(arp.getOperation == ArpOperation.REPLY)
        assert(arp.getSrcHardwareAddr == own && arp.getSrcProtocolAddr == ownIp)
        assert(arp.getDstHardwareAddr == asker && arp.getDstProtocolAddr == askerIp)
        assert(arp.getHardwareType == ArpHardwareType.ETHERNET && arp.getProtocolType == EtherType.IPV4)
      }
    },
    "MST-12: a frame that begins while an answer is being sent is not taken for a request" -> { dut =>
      def feed(bytes: Seq[Int], from: Int, until: Int): Unit = for (i <- from until until) {
        dut.byte.valid.poke(true)
        dut.byte.bits.poke(bytes(i))
        dut.first.poke(i == 0)
        dut.clock.step()
        dut.byte.valid.poke(false)
        dut.clock.step()
      }
      def end(): Unit = {
        dut.end.bits.poke(true)
        dut.end.valid.poke(true)
        dut.clock.step()
        dut.end.valid.poke(false)
        dut.clock.step(4)
      }
      assert(ask(dut, packet()).isDefined) // settings are loaded
      val (request, other) = (packet() ++ Seq(1, 2, 3, 4), Seq.fill(64)(0x55))
      feed(request, 0, 64)
      end()
      assert(is(dut.answer.valid))
      feed(other, 0, 30)
      dut.answer.ready.poke(true)
      feed(other, 30, 45)
      dut.clock.step(300)
      dut.answer.ready.poke(false)
      feed(other, 45, 64)
      end()
      assert(!is(dut.answer.valid))
      assert(ask(dut, packet()).isDefined)
    },
    "MST-13: a request that reaches into the FCS is not answered" -> { dut =>
      val whole = packet().take(42)
      assert(ask(dut, whole).isDefined)
      for (missing <- 1 to 4)
        assert(ask(dut, whole.dropRight(missing), fcs = whole.takeRight(missing).padTo(4, 0)).isEmpty)
    },
    "MST-12: other requests, answers, other frames and bad ones are not" -> { dut =>
      assert(ask(dut, packet(target = InetAddress.getByName("192.168.1.6"))).isEmpty)
      assert(ask(dut, packet(target = InetAddress.getByName("193.168.1.5"))).isEmpty)
      assert(ask(dut, packet(to = asker)).isEmpty && ask(dut, packet(operation = ArpOperation.REPLY)).isEmpty)
      assert(ask(dut, packet(), good = false).isEmpty && ask(dut, packet().take(41)).isEmpty)
      for (i <- 12 until 22; bit <- 0 until 8)
        assert(ask(dut, packet().updated(i, packet()(i) ^ 1 << bit)).isEmpty, s"byte $i, bit $bit")
      assert(ask(dut, packet()).isDefined)
    }
  )
}

package flyframe.plant

import scala.util.Random
import chisel3._
import chisel3.util._
import chiseltest._
import flyframe.SharedSimulation
import flyframe.ethernet._
import flyframe.memory.HostPort
import flyframe.registers.PlantRegisters._
import flyframe.registers.NetworkAddresses
import org.pcap4j.packet._
import org.scalatest.flatspec.AnyFlatSpec

/** The plant port of a ring node between two ends of the wire, which take and give whole bytes, at 50 MHz. */
class PlantNetworkBench extends Module {
  private val plant    = Module(new PlantNetwork)
  private val sender   = Module(new EthernetSender)
  private val receiver = Module(new EthernetReceiver)
  val host             = IO(new HostPort(4))
  val events           = IO(Output(new PlantEvents))
  val link             = IO(Input(Bool()))
  val badFrame         = IO(Input(Bool()))

  /** A frame to the node, without FCS; one from it, with FCS. */
  val in           = IO(Flipped(Decoupled(new FrameByte)))
  val out          = IO(Output(Valid(UInt(8.W))))
  val end          = IO(Output(Valid(Bool())))
  val isOf         = IO(Output(Bool()))
  private val step = Counter(true.B, 2)._2
  sender.bytes <> in
  sender.step    := step
  plant.step     := step
  plant.in       := sender.out
  plant.link     := link
  plant.badFrame := badFrame
  receiver.step  := step
  receiver.in    := plant.out
  out            := receiver.byte
  end            := receiver.end
  isOf           := out.valid || end.valid || events.asUInt.orR
  plant.host <> host
  events := plant.events
}

/** Against packets that pcap4j builds and takes apart. */
class PlantNetworkSpec extends AnyFlatSpec with SharedSimulation {
  import UdpPackets._
  private val node        = End(0x021022334455L, 0xc0a80105L, 5005)
  private val server      = End(0x0a0b0c0d0e0fL, 0xc0a801feL, 0x88a5)
  private def is(b: Bool) = b.peekBoolean()

  private class Driver(dut: PlantNetworkBench) {
    var frames                = Vector.empty[Vector[Int]]
    private var frame         = Vector.empty[Int]
    var received, sent, links = 0
    dut.clock.setTimeout(0)
    dut.in.valid.poke(false)
    dut.host.req.poke(false)
    dut.link.poke(false)
    dut.badFrame.poke(false)
    dut.reset.poke(true.B)
    dut.clock.step()
    dut.reset.poke(false.B)

    def step(): Unit = {
      if (is(dut.isOf)) {
        if (is(dut.out.valid)) frame :+= dut.out.bits.peekInt().toInt
        if (is(dut.end.valid)) {
          assert(is(dut.end.bits), "a bad frame has left")
          frames :+= frame.dropRight(4)
          frame = Vector.empty
        }
        received += dut.events.received.peekInt().toInt
        sent += dut.events.sent.peekInt().toInt
        links += dut.events.link.peekInt().toInt
      }
      dut.clock.step()
    }
    def steps(n: Int): Unit = for (_ <- 0 until n) step()

    private def access(address: Int, bytes: Int, write: Option[Long]): Long = {
      val shift = address % 4
      dut.host.req.poke(true)
      dut.host.write.poke(write.nonEmpty)
      dut.host.addr.poke(address)
      dut.host.be.poke(((1 << bytes) - 1) << shift)
      dut.host.wdata.poke((BigInt(write.getOrElse(0L)) << (8 * shift)) & 0xffffffffL)
      var waited = 0
      while (!is(dut.host.ack)) {
        step()
        waited += 1
        assert(waited < 10, "no answer")
      }
      val data = dut.host.rdata.peekInt() >> (8 * shift)
      step()
      dut.host.req.poke(false)
      step()
      (data & ((BigInt(1) << (8 * bytes)) - 1)).toLong
    }
    def read(address: Int, bytes: Int): Long = access(address, bytes, None)
    def write(address: Int, bytes: Int, value: Long): Unit = {
      access(address, bytes, Some(value))
      ()
    }
    def writeAll(address: Int, data: Seq[Int]): Unit = {
      var at = 0
      while (at < data.size) {
        val count = Seq(4 - (address + at) % 4, data.size - at).min
        val value = data.slice(at, at + count).reverse.foldLeft(0L)(_ << 8 | _)
        write(address + at, count, value)
        at += count
      }
    }
    def readAll(address: Int, count: Int): Seq[Int] =
      (0 until count by 4)
        .flatMap(i => big(read(address + i, 4), 4).reverse)
        .take(count)
        .toVector

    val addresses: Seq[Int] =
      big(server.mac, 6) ++ big(node.mac, 6) ++ big(node.ip, 4) ++ big(server.ip, 4) ++ big(node.port, 2) ++
        big(server.port, 2)
    def start(): Unit = {
      writeAll(Settings + NetworkAddresses.First, addresses)
      write(Control, 1, 1)
    }
    def send(payload: Seq[Int]): Unit = {
      writeAll(SendData, payload)
      write(SendLength, 2, payload.size)
      write(Command, 1, 1 << Send)
    }

    /** A frame to the node. */
    def comes(bytes: Seq[Int]): Unit = {
      for ((b, i) <- bytes.zipWithIndex) {
        dut.in.valid.poke(true)
        dut.in.bits.data.poke(b)
        dut.in.bits.last.poke(i == bytes.size - 1)
        while (!is(dut.in.ready)) step()
        step()
      }
      dut.in.valid.poke(false)
    }
    def arp(target: End): Seq[Int] = Seq.fill(6)(0xff) ++ big(server.mac, 6) ++
      Seq(0x08, 0x06, 0x00, 0x01, 0x08, 0x00, 0x06, 0x04, 0x00, 0x01) ++ big(server.mac, 6) ++
      big(server.ip, 4) ++ Seq.fill(6)(0) ++ big(target.ip, 4) ++ Seq.fill(18)(0)
  }

  /** The payload of a frame that must be a datagram of the node to the server. */
  private def payloadOf(frame: Seq[Int], size: Int): Seq[Int] = {
    val raw    = frame.map(_.toByte).toArray
    val packet = EthernetPacket.newPacket(raw, 0, raw.length)
    assert(packet.getHeader.getSrcAddr == node.station && packet.getHeader.getDstAddr == server.station)
    val ip  = packet.get(classOf[IpV4Packet])
    val udp = packet.get(classOf[UdpPacket])
    assert(ip.getHeader.hasValidChecksum(false) && ip.getHeader.getTotalLengthAsInt == size + 28)
    assert(ip.getHeader.getSrcAddr == node.address && ip.getHeader.getDstAddr == server.address)
    assert(ip.getHeader.getDontFragmentFlag && ip.getHeader.getTtlAsInt == 64)
    assert(udp.getHeader.getChecksum != 0 && udp.hasValidChecksum(node.address, server.address, false))
    assert(udp.getHeader.getLengthAsInt == size + 8)
    assert(udp.getHeader.getSrcPort.valueAsInt == node.port)
    assert(udp.getHeader.getDstPort.valueAsInt == server.port)
    Option(udp.getPayload).fold(Seq.empty[Int])(_.getRawData.map(_ & 0xff).toSeq.take(size))
  }

  together("a ring node in the plant network", new PlantNetworkBench)(
    "GW-04: what the host has made leaves as a datagram with right checksums, whatever its length" -> { dut =>
      val driver = new Driver(dut)
      import driver._
      start()
      val random = new Random(3)
      val sizes  = Seq(0, 1, 2, 17, 18, 19, 255, 1471, MostPayload) ++ Seq.fill(12)(random.nextInt(300))
      for ((size, i) <- sizes.zipWithIndex) {
        val payload = Seq.fill(size)(if (i % 4 == 3) 0xff else random.nextInt(256))
        send(payload)
        while (frames.size == i) step()
        assert(payloadOf(frames.last, size) == payload, s"$size bytes")
        steps(50)
        assert(frames.last.size == Seq(size + 42, 60).max && sent == i + 1)
      }
    },
    "GW-04: a checksum of 0 is sent as 0xFFFF" -> { dut =>
      val driver = new Driver(dut)
      import driver._
      start()
      send(Seq(0, 0))
      while (frames.isEmpty) step()
      send(frames.head.slice(40, 42)) // makes its sum 0xFFFF
      while (frames.size < 2) step()
      assert(frames(1).slice(40, 42) == Seq(0xff, 0xff) && payloadOf(frames(1), 2).size == 2)
    },
    "GW-04: more than a datagram holds is not sent, nor a second one over the first" -> { dut =>
      val driver = new Driver(dut)
      import driver._
      start()
      write(SendLength, 2, MostPayload + 1)
      write(Command, 1, 1 << Send)
      steps(20000)
      assert(frames.isEmpty && sent == 0 && read(Status, 1) == 0)
      val first = Seq.tabulate(100)(_ * 3 & 0xff)
      send(first)
      assert(read(Status, 1) == 2)
      write(SendLength, 2, 4)
      write(Command, 1, 1 << Send)
      steps(8000)
      assert(frames.size == 1 && payloadOf(frames.head, 100) == first && sent == 1 && read(Status, 1) == 0)
    },
    "GW-04: two datagrams of the server wait, in order; a third is dropped and counted" -> { dut =>
      val driver = new Driver(dut)
      import driver._
      start()
      val random   = new Random(4)
      val payloads = Seq(1, MostPayload, 64, 7, 5).map(Seq.fill(_)(random.nextInt(256)))
      for (p <- payloads.take(3)) comes(packet(server, node, p))
      steps(200)
      assert(received == 2 && read(Dropped, 1) == 1)
      for (p <- payloads.take(2)) {
        assert((read(Status, 1) & 4) != 0 && read(ReceivedLength, 2) == p.size)
        assert(readAll(ReceivedData, p.size) == p)
        write(Command, 1, 1 << Release)
      }
      assert(read(Status, 1) == 0 && read(ReceivedLength, 2) == 0 && read(ReceivedData, 4) == 0)
      write(Command, 1, 1 << Release) // of nothing
      for (p <- payloads.drop(3)) {
        comes(packet(server, node, p))
        steps(200)
        assert(readAll(ReceivedData, p.size) == p && read(ReceivedLength, 2) == p.size)
        write(Command, 1, 1 << Release)
      }
      assert(received == 4 && read(Dropped, 1) == 1 && read(Refused, 1) == 0)
      write(Command, 1, 1 << Clear)
      assert(read(Dropped, 1) == 0)
    },
    "GW-04: what is no datagram of the server is refused and counted, what is for others is nothing" -> {
      dut =>
        val driver = new Driver(dut)
        import driver._
        start()
        val payload = Seq.fill(20)(0x5a)
        val wrong = Seq(
          packet(server.copy(ip = server.ip + 1), node, payload),
          packet(server, node.copy(port = node.port + 1), payload),
          packet(server, node, payload, fragment = true),
          packet(server, node, payload).updated(17, 10)
        )
        for (w <- wrong) comes(w)
        comes(packet(server, node.copy(mac = node.mac + 1), payload))
        comes(arp(node.copy(ip = node.ip + 1)))
        steps(400)
        assert(received == 0 && read(Refused, 1) == wrong.size && frames.isEmpty)
        comes(packet(server, node, payload))
        steps(200)
        assert(received == 1 && readAll(ReceivedData, 20) == payload)
        dut.badFrame.poke(true)
        step()
        dut.badFrame.poke(false)
        assert(read(BadFrames, 1) == 1)
    },
    "GW-04: ARP requests are answered, also while datagrams leave; without `plant_run` nothing is heard" -> {
      dut =>
        val driver = new Driver(dut)
        import driver._
        comes(arp(node))
        comes(packet(server, node, Seq(1, 2, 3)))
        steps(400)
        assert(frames.isEmpty && received == 0 && read(Refused, 1) == 0)
        start()
        val payload = Seq.fill(300)(0x11)
        send(payload)
        comes(arp(node))
        while (frames.size < 2) step()
        assert(payloadOf(frames.head, 300) == payload)
        val raw    = frames(1).map(_.toByte).toArray
        val answer = EthernetPacket.newPacket(raw, 0, raw.length).get(classOf[ArpPacket]).getHeader
        assert(answer.getSrcHardwareAddr == node.station && answer.getSrcProtocolAddr == node.address)
        assert(answer.getDstHardwareAddr == server.station && answer.getDstProtocolAddr == server.address)
        comes(arp(node))
        steps(20)
        send(payload)
        while (frames.size < 4) step()
        assert(payloadOf(frames(3), 300) == payload && frames(2) == frames(1))
    },
    "GW-04: addresses are kept byte by byte, and the link is told" -> { dut =>
      val driver = new Driver(dut)
      import driver._
      start()
      assert(readAll(Settings + NetworkAddresses.First, 24) == addresses)
      write(Settings + NetworkAddresses.First + 3, 1, 0x77)
      assert(readAll(Settings + NetworkAddresses.First, 24) == addresses.updated(3, 0x77))
      assert(read(Control, 1) == 1 && read(Status, 1) == 0)
      dut.link.poke(true)
      steps(3)
      assert(read(Status, 1) == 1 && links == 1)
      write(SendLength, 1, 0x34)
      write(SendLength + 1, 1, 0x05)
      assert(read(SendLength, 2) == 0x534)
      write(Control, 1, 0)
      assert(read(Control, 1) == 0)
    }
  )
}

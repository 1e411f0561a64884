package flyframe.master

import scala.util.Random
import org.pcap4j.packet._
import org.scalatest.flatspec.AnyFlatSpec
import flyframe.SharedSimulation
import flyframe.model._
import flyframe.params.{EscParams, Presets}
import flyframe.protocol.Command.{Bwr, Fprd}
import flyframe.protocol.EventKind

/** The whole master at its pins: modelled slaves on its line, a modelled server behind its plant network, the
  * test as its host.
  */
class MasterControllerSpec extends AnyFlatSpec with SharedSimulation {
  import UdpPackets._
  import EventKind._
  private val slaveParams = Presets.named("alarm-slave").get.params
  private val Own         = End(0x021022334455L, 0xc0a80105L, 0x4660)
  private val Server      = End(0x0a0b0c0d0e0fL, 0xc0a801feL, 0x4661)
  private val Id          = 0x1234
  private val Boot        = 0x0102
  private val CycleSlots  = 1000

  private case class Event(kind: Int, position: Int, node: Int, sequence: Int, state: Int)
  private case class Report(first: Long, selfTest: Int, present: Int, known: Int, events: Seq[Event])

  private class System(dut: MasterUnderTest, p: EscParams, nodes: Int*) {
    val slaves = nodes.map { node =>
      val s = new EscModel(slaveParams)
      s.hostWrite(0x12, node)
      for (a      <- Seq(0x0ea0, 0x0ea1)) s.hostWrite(a, 0)
      for ((b, i) <- Seq(1, 0x70, 3).zipWithIndex) s.hostWrite(0x0ea4 + i, b)
      s
    }
    val line         = new LineModel(slaves)
    var serverIsUp   = true
    var reports      = Vector.empty[Report]
    var arp          = 0
    private var log  = Vector.empty[Event]
    private var read = 0
    val bench = new MasterBench(
      dut,
      p,
      frame => line.send(WireFrame.ofNibbles(frame.payload)).map(_ -> 20),
      frame => plant(frame),
      slot => if (slot % CycleSlots == 0) slaves.foreach(_.advanceUs(CycleSlots / 25))
    )

    private def plant(frame: Seq[Int]): Unit = {
      assert(Fcs.good(frame) && frame.size >= 64)
      val raw    = frame.dropRight(4).map(_.toByte).toArray
      val packet = EthernetPacket.newPacket(raw, 0, raw.length)
      assert(packet.getHeader.getSrcAddr == Own.station)
      if (packet.contains(classOf[ArpPacket])) arp += 1
      else {
        val ip  = packet.get(classOf[IpV4Packet])
        val udp = packet.get(classOf[UdpPacket])
        assert(packet.getHeader.getDstAddr == Server.station && ip.getHeader.getDstAddr == Server.address)
        assert(
          ip.getHeader.hasValidChecksum(false) && udp.hasValidChecksum(Own.address, Server.address, false)
        )
        assert(
          udp.getHeader.getSrcPort.valueAsInt == Own.port &&
            udp.getHeader.getDstPort.valueAsInt == Server.port
        )
        report(udp.getPayload.getRawData.toSeq.map(_ & 0xff))
      }
    }
    private def number(b: Seq[Int]) = b.foldLeft(0L)(_ << 8 | _)
    private def report(b: Seq[Int]): Unit = {
      assert(b.take(8) == Seq(0x46, 0x41, 1, 1, Id >> 8, Id & 0xff, Boot >> 8, Boot & 0xff))
      assert(b.size == 24 + 16 * b(12))
      val events = b.drop(24).grouped(16).toSeq.map { e =>
        Event(e.head, e(1), number(e.slice(2, 4)).toInt, number(e.slice(4, 6)).toInt, e(6))
      }
      val first = number(b.slice(8, 12))
      reports :+= Report(first, b(13), b(14), b(15), events)
      if (serverIsUp) {
        assert(first <= log.size)
        log ++= events.drop(log.size - first.toInt)
        if (events.nonEmpty) fromServer(2, log.size)
      }
    }
    def fromServer(kind: Int, number: Int, rest: Seq[Int] = Nil): Unit =
      bench.fromPlant(withFcs(packet(Server, Own, header(kind, number) ++ rest)))
    def header(kind: Int, number: Int): Seq[Int] =
      Seq(0x46, 0x41, 1, kind, Id >> 8, Id & 0xff, Boot >> 8, Boot & 0xff) ++
        (3 to 0 by -1).map(i => number >> (8 * i) & 0xff)
    def withFcs(frame: Seq[Int]): Seq[Int] = frame ++ Fcs.of(frame)

    private def little(value: Int) = Seq(value & 0xff, value >> 8)
    def setUp(): Unit = {
      import bench.write
      write(0x10, big(Server.mac, 6) ++ big(Own.mac, 6) ++ big(Own.ip, 4) ++ big(Server.ip, 4): _*)
      write(0x24, big(Own.port, 2) ++ big(Server.port, 2) ++ little(Id) ++ little(Boot): _*)
      write(0x30, little(CycleSlots): _*)
      write(0x38, 2, 0, 5, 0)
      write(0x3d, 1)
    }
    def start(): Unit = {
      setUp()
      bench.write(0x3c, 3)
    }
    def cycles(n: Int): Unit = bench.run(n * CycleSlots)

    /** What the server has heard of since this was asked last. */
    def heard(): Seq[Event] = {
      val now = log.drop(read)
      read = log.size
      now
    }
  }

  private def check(clock: Int, width: Int, max: Int, room: Int): Unit = {
    val p =
      Presets.master.copy(coreClockMhz = clock, dataBusWidth = width, maxSubTelegrams = max, maxSlaves = room)
    together(
      s"$clock MHz, dataBusWidth $width, maxSubTelegrams $max, maxSlaves $room",
      new MasterUnderTest(p)
    )(
      "HOST-01, HOST-02: who it is, and what it is told" -> { dut =>
        val s = new System(dut, p, 1)
        import s.bench._
        assert(read(0, 5) == (BigInt(room) << 32 | 0x000100f2))
        assert(
          read(0x30, 4) == 25000 && read(0x34, 2) == 2500 && read(0x36) == 2 && read(0x38, 4) == 0x3e800c8
        )
        s.setUp()
        assert(read(0x28, 4) == BigInt("01021234", 16) && read(0x16, 6) == BigInt("554433221002", 16))
        assert(read(0x20, 4) == BigInt("fe01a8c0", 16) && read(0x24, 2) == 0x6046)
        write(0, 0xff, 0xff)
        write(0x1000, 7)
        assert(read(0, 2) == 0xf2 && read(0x1000) == 0 && read(0x06) == 0)
      },
      "HOST-03: without leave of the host nothing leaves" -> { dut =>
        val s = new System(dut, p, 1)
        s.setUp()
        s.cycles(6)
        assert(s.reports.isEmpty && s.slaves.head.hostRead(0x0103) == 0)
      },
      "HOST-04, HOST-08: from a detector to the server, lamp on and off" -> { dut =>
        val s      = new System(dut, p, 1, 2, 3)
        val listed = 3 min room
        s.start()
        s.cycles(30)
        val scan = s.heard()
        assert(
          scan.filter(_.kind == Present).map(e => (e.position, e.node, e.state)) ==
            Seq.tabulate(listed)(i => (i, i + 1, 1))
        )
        assert(
          scan.filter(_.kind == Detector).map(e => (e.node, e.sequence, e.state)).toSet ==
            Set.tabulate(listed)(i => (i + 1, 1, 1))
        )
        val last = s.reports.last
        assert((last.selfTest, last.present, last.known) == (1, listed, listed) && !s.bench.buzzer)
        s.slaves(1).alarm.get.setLine(2)
        s.cycles(4)
        assert(s.heard() == Seq(Event(Detector, 1, 2, 2, 2)) && s.bench.buzzer)
        assert(s.bench.read(0x40, 2) == 0x0101 * listed && s.bench.read(0x42) == 0x23)
        s.bench.write(0x3c, 7)
        assert(!s.bench.buzzer && s.bench.read(0x3c) == 3)
        val time = s.bench.read(0x48, 4)
        s.cycles(5)
        assert((s.bench.read(0x48, 4) - time - 5 * CycleSlots / 25).abs <= 2)
        s.cycles(3)
        assert(!s.bench.buzzer && s.heard().isEmpty && s.slaves(1).hostRead(0x0e88) == 0)
        assert(s.bench.read(0x44, 4) == 0)
      },
      "REP-03, LM-10: a server that is away gets everything, once" -> { dut =>
        val s = new System(dut, p, 1, 2)
        s.start()
        s.cycles(24)
        s.heard()
        s.serverIsUp = false
        for (state <- Seq(2, 1, 2)) {
          s.slaves(0).alarm.get.setLine(state)
          s.cycles(5)
        }
        assert(s.slaves(0).hostRead(0x0e88) == 3 && s.bench.buzzer)
        s.serverIsUp = true
        s.cycles(80)
        assert(s.heard() == Seq(2, 1, 2).zipWithIndex.map { case (state, i) =>
          Event(Detector, 0, 1, i + 2, state)
        })
        assert(s.slaves(0).hostRead(0x0e88) == 0)
      },
      "HOST-05: a datagram of the host comes back with its working counter" -> { dut =>
        val s = new System(dut, p, 1, 2)
        s.start()
        s.cycles(16)
        import s.bench._
        def request(command: Int, adp: Int, ado: Int, length: Int): Unit = {
          write(0x50, command, length)
          write(0x54, adp & 0xff, adp >> 8, ado & 0xff, ado >> 8)
          write(0x58, 1, 2, 3, 4, 5, 6, 7, 8)
          write(0x60, 1)
          assert((read(0x42) & 0x18) == 0x10 && read(0x60) == 0)
          s.cycles(3)
          assert((read(0x42) & 0x18) == 8 && irq)
        }
        request(Bwr, 0, 0x0e90, 8)
        assert(read(0x62) == 1 && !irq && read(0x64, 2) == 2)
        assert(s.slaves.forall(_.hostRead(0x0e97) == 8))
        request(Fprd, 2, 0x0012, 2)
        assert(read(0x64, 2) == 1 && read(0x68, 2) == 2)
        request(Fprd, 9, 0x0012, 15)
        assert(read(0x64, 2) == 0 && irq && read(0x62) == 1)
        s.line.setCable(0, intact = false)
        write(0x60, 1)
        s.cycles(20)
        assert(read(0x62) == 0 && read(0x44, 4) > 0)
      },
      "HOST-06: an event of the host" -> { dut =>
        val s = new System(dut, p, 1)
        s.start()
        s.cycles(14)
        s.heard()
        s.bench.write(0x70, 1, 3, 0x34, 0x12, 0x78, 0x56)
        s.bench.write(0x78, 1)
        s.cycles(3)
        assert(s.heard() == Seq(Event(Command, 1, 0x1234, 0x5678, 3)) && (s.bench.read(0x42) & 0x40) == 0)
      },
      "SRV-02, SRV-03, HOST-07, MST-12: the mailbox, what is refused, and ARP in between" -> { dut =>
        val s = new System(dut, p, 1)
        s.start()
        s.cycles(14)
        s.heard()
        import s.bench._
        assert(read(0x80, 2) == 0 && !irq)
        s.fromServer(3, 9, 100 until 120)
        s.fromServer(3, 10, Seq(1))
        s.cycles(1)
        assert(irq && read(0x80, 2) == 32)
        assert(Seq.fill(32)(read(0x88)) == s.header(3, 9) ++ (100 until 120))
        write(0x82, 12)
        assert(read(0x88) == 100 && read(0x82) == 13)
        write(0x84, 1)
        assert(!irq && read(0x80, 2) == 0 && read(0x82) == 0)
        fromPlant(s.withFcs(packet(Server, Own.copy(port = 9), Seq(1, 2, 3))))
        fromPlant(s.withFcs(packet(Server.copy(ip = 1), Own, s.header(3, 9))))
        fromPlant(s.withFcs(packet(Server, Own.copy(mac = 5), s.header(3, 9))))
        fromPlant(s.withFcs(packet(Server, Own, s.header(3, 9))).map(_ ^ 1))
        s.cycles(1)
        assert(!irq && (0x90 to 0x93).map(read) == Seq(2, 1, 0, 1))
        write(0x91, 0)
        assert((0x90 to 0x93).map(read) == Seq(0, 0, 0, 0))
        val arp = Seq.fill(6)(0xff) ++ Seq(10, 11, 12, 13, 14, 15, 8, 6, 0, 1, 8, 0, 6, 4, 0, 1, 10, 11, 12,
          13, 14, 15, 192, 168, 1, 254, 0, 0, 0, 0, 0, 0, 192, 168, 1, 5) ++ Seq.fill(18)(0)
        for (_ <- 1 to 3) {
          fromPlant(s.withFcs(arp))
          s.slaves.head.alarm.get.setLine(2)
          s.cycles(1)
        }
        s.cycles(3)
        assert(s.arp == 3 && s.heard().size == 1)
      },
      "PHY-03: within a frame the receive clock may slip by what 100 ppm are, from any phase on" -> { dut =>
        val s = new System(dut, p, 1)
        s.start()
        s.cycles(14)
        import s.bench._
        // Over the longest frame 12.2 ns, which are up to two core cycles; here they come within a short one.
        val most = if (clock < 100) 1 else 2
        for (round <- 1 to 2 * p.cyclesPerNibble) {
          fromPlant(s.withFcs(packet(Server, Own, s.header(3, 9) ++ Seq.fill(40)(round))))
          for (_ <- 1 to most) {
            s.bench.run(50)
            slip()
          }
          s.bench.run(200)
          assert(irq && read(0x80, 2) == 52 && read(0x93) == 0, s"round $round")
          write(0x84, 1)
          if (round % 2 == 0) slip() // all phases
        }
        s.cycles(4)
        assert(read(0x44, 4) == 0 && read(0x92) == 0)
      },
      "SRV-03: thousands of malformed, foreign and oversized datagrams are counted and do no harm" -> { dut =>
        val s      = new System(dut, p, 1, 2)
        val random = new Random(5)
        s.start()
        s.cycles(20)
        s.heard()
        val many = if (clock == 50) 300 else 20
        for (i <- 1 to many) {
          val right = packet(
            Server,
            Own,
            s.header(2 + random.nextInt(5), random.nextInt()) ++ Seq.fill(random.nextInt(20))(
              random.nextInt(256)
            )
          )
          def spoiled = right.updated(12 + random.nextInt(right.size - 12), random.nextInt(256))
          val frame = random.nextInt(4) match {
            case 0 => packet(Server, Own, Seq.fill(1 + random.nextInt(300))(random.nextInt(256)))
            case 1 => packet(Server, Own, s.header(3, i) ++ Seq.fill(245 + random.nextInt(1200))(i & 0xff))
            case 2 => packet(Server.copy(ip = random.nextInt() & 0xffffffffL), Own, s.header(3, i))
            case _ => spoiled.take(14 + random.nextInt(right.size - 14))
          }
          s.bench.fromPlant(s.withFcs(frame.padTo(60, 0)))
          if (i % 10 == 0) s.cycles(8)
          if (i % 50 == 0) {
            s.slaves(1).alarm.get.setLine(1 + i / 50 % 2)
            s.cycles(6)
            assert(s.heard().map(e => (e.kind, e.node)) == Seq((Detector, 2)))
          }
        }
        s.cycles(40)
        s.slaves(0).alarm.get.setLine(2)
        s.cycles(6)
        assert(
          s.heard().map(e => (e.kind, e.node)) == Seq((Detector, 1)) && s.bench.read(
            0x90
          ) >= (many / 4 min 255)
        )
      }
    )
  }
  check(50, 8, 15, room = 8)
  check(125, 32, 1, room = 2)
  check(100, 16, 4, room = 128)
}

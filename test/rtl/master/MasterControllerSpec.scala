package flyframe.master

import scala.util.Random
import chiseltest._
import flyframe.ethernet.UdpPackets
import org.pcap4j.packet._
import org.scalatest.flatspec.AnyFlatSpec
import flyframe.{SharedSimulation, Tier}
import flyframe.model._
import flyframe.params.{EscParams, Presets}
import flyframe.protocol.Command.{Aprd, Bwr}
import flyframe.protocol.{AnswerLayout, EventKind, MasterStatus, Order, SlaveStatus}
import flyframe.registers.MasterRegisters._

/** The whole master at its pins: modelled slaves on its line, a modelled server behind its plant network, the
  * test as its host.
  */
class MasterControllerSpec extends AnyFlatSpec with SharedSimulation {
  import UdpPackets._
  import EventKind._
  private val Own        = End(0x021022334455L, 0xc0a80105L, 0x4660)
  private val Server     = End(0x0a0b0c0d0e0fL, 0xc0a801feL, 0x4661)
  private val Id         = 0x1234
  private val Life       = 0x0102030405060708L
  private val CycleSlots = 1500

  private class System(dut: MasterUnderTest, p: EscParams, nodes: Int*) {
    val line         = new TimedLine(nodes.map(TimedLine.started(_)))
    val slaves       = line.slaves
    val server       = new ServerModel(Id)
    var arp          = 0
    private var read = 0
    val bench = new MasterBench(
      dut,
      p,
      frame => line.send(0, 0, frame.payload).map { case (_, _, back) => back -> 20 },
      frame => plant(frame),
      slot => if (slot % CycleSlots == 0) line.pass(slot.toDouble)
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
        server.receive(udp.getPayload.getRawData).foreach(d => fromServer(d.toSeq.map(_ & 0xff)))
      }
    }
    def fromServer(datagram: Seq[Int]): Unit =
      bench.fromPlant(withFcs(packet(Server, Own, datagram).padTo(60, 0)))
    def withFcs(frame: Seq[Int]): Seq[Int] = frame ++ Fcs.of(frame)

    private def little(value: Int) = Seq(value & 0xff, value >> 8)
    private def bigEndian(v: Long) = (7 to 0 by -1).map(i => (v >> (8 * i) & 0xff).toInt)
    def setUp(): Unit = {
      import bench.write
      write(0x10, big(Server.mac, 6) ++ big(Own.mac, 6) ++ big(Own.ip, 4) ++ big(Server.ip, 4): _*)
      write(0x24, big(Own.port, 2) ++ big(Server.port, 2) ++ little(Id) ++ little(0x0102): _*)
      write(0x2c, 1)
      write(0x30, little(CycleSlots): _*)
      write(0x38, 2, 0, 5, 0)
      write(0x3d, 1)
      write(0x94, 0xff, 0xff)
      write(MasterKey, ServerModel.Key: _*)
      write(MasterLife, bigEndian(Life): _*)
      expect(nodes.take(p.maxSlaves): _*)
    }
    def expect(list: Int*): Unit = for ((node, i) <- list.zipWithIndex) {
      bench.write(SlaveIndex, i)
      bench.write(ExpectedNode, little(node): _*)
    }
    def control(bits: Int): Unit = bench.write(0x3c, bits)
    def start(): Unit = {
      setUp()
      control(7)
    }
    def cycles(n: Int): Unit   = bench.run(n * CycleSlots)
    def status: Int            = bench.read(0x48, 4).toInt
    def has(bit: Int): Boolean = (status & bit) != 0

    /** The state of a slave, as the host sees it: status, node ID. */
    def seen(position: Int): (Int, Int) = {
      bench.write(SlaveIndex, position)
      (bench.read(SlaveState, 2).toInt, bench.read(SlaveState + 2, 2).toInt)
    }

    /** What the server has heard of since this was asked last. */
    def heard(kind: Int = Detector): Seq[ReportedEvent] = {
      val now = server.log.drop(read)
      read = server.log.size
      now.filter(_.kind == kind)
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
        assert(read(MasterLife, 8) == BigInt("0807060504030201", 16))
        write(0, 0xff, 0xff)
        write(0x1000, 7)
        assert(read(0, 2) == 0xf2 && read(0x1000) == 0 && read(0x06) == 0)
      },
      "HOST-13: nobody can read the key" -> { dut =>
        val s = new System(dut, p, 1)
        s.setUp()
        assert(s.bench.read(MasterKey, 16) == 0)
      },
      "HOST-03: the line runs without a host; without its leave nothing is reported" -> { dut =>
        val s = new System(dut, p, 1)
        s.cycles(30)
        assert(s.server.reports.isEmpty && s.bench.read(0x40) == 1 && s.bench.fault)
        s.slaves.head.alarm.get.setLine(2)
        s.cycles(20)
        assert(s.bench.fire && s.bench.sounder)
      },
      "HOST-04, HOST-08, HOST-11, REP-01: from a detector to the server, silence and reset" -> { dut =>
        val s      = new System(dut, p, 1, 2, 3)
        val listed = 3 min room
        s.start()
        s.cycles(100)
        assert(
          s.heard().map(e => (e.position, e.node, e.sequence, e.state)).toSet ==
            Set.tabulate(listed)(i => (i, i + 1, 1, 1))
        )
        val last = s.server.last
        assert((last.selfTest, last.present, last.life) == (1, 3, Life))
        assert(last.slaves.map(_._2) == (1 to listed))
        assert(!s.bench.fire && !s.bench.sounder && s.bench.fault == listed < 3)
        s.slaves(1).alarm.get.setLine(2)
        s.cycles(45)
        val Seq(e) = s.heard()
        assert((e.position, e.node, e.sequence, e.state) == ((1, 2, 2, 2)))
        assert(e.masterTime > 0 && e.slaveTime > 0 && s.bench.fire && s.bench.sounder)
        assert((s.server.last.status & MasterStatus.Fire) != 0 && s.has(MasterStatus.Alarm))
        assert((s.server.last.slaves(1)._1 & 7) == 7)
        s.control(0x17)
        assert(!s.bench.sounder && s.bench.fire && s.bench.read(0x3c) == 7)
        s.cycles(12)
        assert(!s.bench.sounder && s.bench.fire)
        assert(s.seen(1) == ((SlaveStatus.Alarm | SlaveStatus.Latched, 2)))
        s.slaves(1).alarm.get.setLine(1)
        s.cycles(4)
        s.control(0x27)
        assert(s.bench.read(0x3c) == 7)
        s.cycles(60)
        assert(!s.bench.fire && !s.bench.sounder && !s.has(MasterStatus.Alarm))
        val time = s.bench.read(MasterTime, 8)
        s.cycles(5)
        assert((s.bench.read(MasterTime, 8) - time - 5 * CycleSlots / 25).abs <= 20)
        assert(s.bench.read(0x44, 4) == 0)
      },
      "REP-03, LM-10: a server that is away gets everything, once, and is missed meanwhile" -> { dut =>
        val s = new System(dut, p, 1, 2)
        s.start()
        s.cycles(100)
        s.heard()
        s.server.down = true
        for (state <- Seq(2, 1, 2)) {
          s.slaves(0).alarm.get.setLine(state)
          s.cycles(10)
        }
        assert(s.slaves(0).alarm.get.kept == 3 && s.bench.sounder)
        s.server.down = false
        s.cycles(80)
        assert(
          s.heard().map(e => (e.node, e.sequence, e.state)).sorted == Seq((1, 2, 2), (1, 3, 1), (1, 4, 2))
        )
        assert(s.slaves(0).alarm.get.kept == 0)
      },
      "HOST-05: a datagram of the host comes back with its working counter" -> { dut =>
        val s = new System(dut, p, 1, 2)
        s.start()
        s.cycles(100)
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
        request(Aprd, 0xffff, 0x0012, 2)
        assert(read(0x64, 2) == 1 && read(0x68, 2) == 2)
        request(Aprd, 0xfff0, 0x0012, 15)
        assert(read(0x64, 2) == 0 && irq && read(0x62) == 1)
        s.line.setCable(0, intact = false)
        write(0x60, 1)
        s.cycles(60)
        assert(read(0x62) == 0 && read(0x44, 4) > 0 && fault && s.has(MasterStatus.LineDead))
      },
      "HOST-06: an event of the host" -> { dut =>
        val s = new System(dut, p, 1)
        s.start()
        s.cycles(100)
        s.heard()
        s.bench.write(0x70, 1, 3, 0x34, 0x12, 0x78, 0x56)
        s.bench.write(0x78, 1)
        s.cycles(45)
        val Seq(e) = s.heard(Command)
        assert((e.position, e.node, e.sequence, e.state) == ((1, 0x1234, 0x5678, 3)))
        assert((s.bench.read(0x42) & 0x40) == 0)
      },
      "HOST-08, HOST-11, HOST-12: the signals tell faults, lamps are tested" -> { dut =>
        val s = new System(dut, p, 1)
        import s.bench._
        assert(fault, "nobody has set it up")
        s.start()
        s.cycles(100)
        assert(!fault && s.status == 0, s"status ${s.status.toHexString}")
        for (
          (bit, status) <- Seq(
            1 -> MasterStatus.Mains,
            2 -> MasterStatus.Battery,
            4 -> MasterStatus.Earth,
            8 -> MasterStatus.Storage
          )
        ) {
          write(0x96, bit)
          assert(fault && s.status == status)
        }
        write(0x96, 0)
        write(0x94, 2, 0)
        s.cycles(20)
        assert(!fault)
        s.cycles(40)
        assert(fault && s.status == MasterStatus.HostDead && read(0x94, 2) == 0)
        write(0x94, 0xff, 0xff)
        assert(!fault)
        dut.alarm.config_fault.poke(true)
        s.cycles(1)
        assert(fault && s.status == MasterStatus.Configuration)
        dut.alarm.config_fault.poke(false)
        s.expect(2)
        s.cycles(4)
        assert(fault && s.has(MasterStatus.WrongLine))
        s.expect(1)
        s.cycles(4)
        assert(!fault && !fire && !sounder && !disabled)
        s.control(0x0f)
        assert(fault && fire && sounder && disabled)
        s.control(3)
        assert(fault && !fire && s.status == MasterStatus.Unlisted)
        s.control(7)
        s.cycles(2)
        assert(!fault)
      },
      "SRV-01, SRV-02: an order comes to the mailbox; a proven report follows another life of the server" -> {
        dut =>
          val s = new System(dut, p, 1)
          s.start()
          s.cycles(100)
          import s.bench._
          assert(read(0x80, 2) == 0 && !irq && s.server.last.server == s.server.life)
          s.server.command(Order.Test, node = 1, seconds = 300)
          s.cycles(110)
          assert(irq && read(0x80, 2) == AnswerLayout.bytes)
          val order = Seq.fill(AnswerLayout.bytes)(read(0x88))
          assert(order(AnswerLayout.Order.offset) == Order.Test && order(AnswerLayout.Node.last) == 1)
          write(0x84, 1)
          assert(!irq && read(0x80, 2) == 0 && read(0x82) == 0)
          s.cycles(110)
          assert(!irq, "once for each ticket")
          s.server.life += 1
          s.server.noCommand()
          s.cycles(150)
          assert(s.server.last.server == s.server.life && !s.has(MasterStatus.ServerSilent))
      },
      "SRV-03, HOST-07, MST-12: what is refused, and ARP in between" -> { dut =>
        val s = new System(dut, p, 1)
        s.start()
        s.cycles(100)
        s.heard()
        import s.bench._
        write(0x91, 0)
        fromPlant(s.withFcs(packet(Server, Own.copy(port = 9), Seq(1, 2, 3))))
        fromPlant(s.withFcs(packet(Server.copy(ip = 1), Own, Seq.fill(64)(0))))
        fromPlant(s.withFcs(packet(Server, Own.copy(mac = 5), Seq.fill(64)(0))))
        fromPlant(s.withFcs(packet(Server, Own, Seq.fill(64)(0))).map(_ ^ 1))
        s.cycles(2)
        assert(!irq && (0x90 to 0x93).map(read) == Seq(2, 0, 0, 1))
        s.fromServer(Seq.fill(64)(0))
        s.cycles(2)
        assert(read(0x90) == 3)
        write(0x91, 0)
        assert((0x90 to 0x93).map(read) == Seq(0, 0, 0, 0))
        val arp = Seq.fill(6)(0xff) ++ Seq(10, 11, 12, 13, 14, 15, 8, 6, 0, 1, 8, 0, 6, 4, 0, 1, 10, 11, 12,
          13, 14, 15, 192, 168, 1, 254, 0, 0, 0, 0, 0, 0, 192, 168, 1, 5) ++ Seq.fill(18)(0)
        for (i <- 1 to 3) {
          fromPlant(s.withFcs(arp))
          s.slaves.head.alarm.get.setLine(1 + i % 2)
          s.cycles(2)
        }
        s.cycles(60)
        assert(s.arp == 3 && s.heard().size == 3)
      },
      "PHY-03: within a frame the receive clock may slip by what 100 ppm are, from any phase on" -> { dut =>
        val s = new System(dut, p, 1)
        s.start()
        s.cycles(100)
        import s.bench._
        // Over the longest frame 12.2 ns, which are up to two core cycles; here they come within a short one.
        val most = if (clock < 100) 1 else 2
        for (round <- 1 to 2 * p.cyclesPerNibble) {
          write(0x91, 0)
          s.fromServer(Seq.fill(64)(round))
          for (_ <- 1 to most) {
            s.bench.run(50)
            slip()
          }
          s.bench.run(900)
          assert(read(0x90) == 1 && read(0x93) == 0, s"round $round")
          if (round % 2 == 0) slip() // all phases
        }
        s.cycles(4)
        assert(read(0x44, 4) == 0 && read(0x92) == 0)
      },
      "SRV-03: hundreds of malformed, foreign and oversized datagrams are counted and do no harm" -> { dut =>
        val s      = new System(dut, p, 1, 2)
        val random = new Random(5)
        s.start()
        s.cycles(100)
        s.heard()
        val many = if (clock == 50) 300 else 20
        for (i <- 1 to many) {
          val right   = packet(Server, Own, Seq.fill(64)(random.nextInt(256)))
          def spoiled = right.updated(12 + random.nextInt(right.size - 12), random.nextInt(256))
          val frame = random.nextInt(4) match {
            case 0 => packet(Server, Own, Seq.fill(1 + random.nextInt(300))(random.nextInt(256)))
            case 1 => packet(Server, Own, Seq.fill(245 + random.nextInt(1200))(i & 0xff))
            case 2 => packet(Server.copy(ip = random.nextInt() & 0xffffffffL), Own, Seq.fill(64)(i & 0xff))
            case _ => spoiled.take(14 + random.nextInt(right.size - 14))
          }
          s.bench.fromPlant(s.withFcs(frame.padTo(60, 0)))
          if (i % 10 == 0) s.cycles(8)
          if (i % 50 == 0) {
            s.slaves(1).alarm.get.setLine(1 + i / 50 % 2)
            s.cycles(60)
            assert(s.heard().map(_.node) == Seq(2))
          }
        }
        s.cycles(40)
        s.slaves(0).alarm.get.setLine(2)
        s.cycles(60)
        assert(s.heard().map(_.node) == Seq(1) && s.bench.read(0x90) >= (many / 4 min 255))
      }
    )
  }
  check(50, 8, 15, room = 8)
  if (Tier.isSoak) { // the preset's parts with other parameters are tested alone
    check(125, 32, 10, room = 2)
    check(100, 16, 12, room = 128)
  }
}

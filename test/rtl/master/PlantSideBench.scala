package flyframe.master

import chisel3._
import chisel3.util._
import chiseltest._
import flyframe.ethernet.{EthernetReceiver, EthernetSender, FrameByte, SettingsBench, UdpPackets}
import flyframe.protocol.{EventLayout, MasterStatus}
import flyframe.registers.MasterRegisters
import org.pcap4j.packet._

/** The plant side between two ends of the wire, which take and give whole bytes.
  *
  * @param cycles
  *   of a nibble slot
  */
class PlantSideBench(cycles: Int) extends SettingsBench(2) {
  private val plant    = Module(new PlantSide)
  private val sender   = Module(new EthernetSender)
  private val receiver = Module(new EthernetReceiver)
  private val clockUs  = Module(new HeldCounter(64))
  val run              = IO(Input(Bool()))
  val status           = IO(Input(UInt(MasterStatus.Width.W)))
  val known            = IO(Input(UInt(8.W)))
  val others           = IO(Input(UInt(56.W))) // lost, present, cut, refused
  val event            = IO(Vec(2, Flipped(Decoupled(UInt(16.W)))))
  val mailbox          = IO(chiselTypeOf(plant.mailbox))
  val rooms            = IO(Output(UInt(3.W)))
  val firstEvent       = IO(Output(UInt(16.W)))
  val nextEvent        = IO(Output(UInt(16.W)))
  val silent           = IO(Output(Bool()))
  val refused          = IO(Output(Bool()))
  val dropped          = IO(Output(Bool()))

  /** A frame to the master, without FCS; one from it, with FCS. */
  val in           = IO(Flipped(Decoupled(new FrameByte)))
  val out          = IO(Output(Valid(UInt(8.W))))
  val end          = IO(Output(Valid(Bool())))
  val isOf         = IO(Output(Bool())) // something is to be seen at out, end, refused or dropped
  private val ms   = Counter(PlantSideBench.MsCycles)
  private val us   = Counter(25 * cycles)
  private val step = if (cycles == 1) true.B else Counter(true.B, cycles)._2
  sender.bytes <> in
  sender.step          := step
  plant.step           := step
  plant.in             := sender.out
  receiver.step        := step
  receiver.in          := plant.out
  out                  := receiver.byte
  end.valid            := receiver.end.valid
  end.bits             := receiver.end.bits
  settings.readAddress := plant.settingAddress
  plant.setting        := settings.readData
  plant.run            := run
  plant.repeatMs       := 12.U
  plant.heartbeatMs    := 40.U
  plant.serverTimeout  := 1.U
  plant.millisecond    := ms.inc()
  clockUs.count        := us.inc()
  clockUs.holds        := plant.holds
  plant.master.status  := status
  plant.master.lost    := others(55, 24)
  plant.master.present := others(23, 16)
  plant.master.cut     := others(15, 8)
  plant.master.refused := others(7, 0)
  plant.master.time    := clockUs.value
  plant.known          := known
  plant.lookData       := RegNext(plant.look(9, 2) * 7.U + plant.look(1, 0) * 90.U + known)
  plant.event <> event
  plant.mailbox <> mailbox
  rooms      := Cat(plant.full, plant.roomForStates, plant.roomForRecords)
  firstEvent := plant.firstEvent
  nextEvent  := plant.nextEvent
  silent     := plant.serverSilent
  refused    := plant.refused
  dropped    := plant.dropped
  isOf       := out.valid || end.valid || refused || dropped
}

object PlantSideBench {

  /** Cycles of what the plant side takes for a millisecond. */
  val MsCycles = 1500

  /** The state of a slave, as the bench tells it. */
  def state(position: Int, known: Int): Seq[Int] =
    (0 until 4).map(byte => position * 7 + byte * 90 + known & 0xff)
}

/** Drives a [[PlantSideBench]]; checks every frame that leaves. */
class PlantDriver(dut: PlantSideBench) {
  import PlantSideBench._
  val master: UdpPackets.End = UdpPackets.End(0x021022334455L, 0xc0a80105L, 5005)
  val server: UdpPackets.End = UdpPackets.End(0x0a0b0c0d0e0fL, 0xc0a801feL, 0x88a5)
  private def is(b: Bool)    = b.peekBoolean()

  /** Reports with the cycle in which their last byte came, and answers to ARP requests. */
  var reports: Vector[(Long, Report)] = Vector.empty
  var arps                            = 0
  var cycle                           = 0L
  var refused                         = 0
  var dropped                         = 0

  /** Events that the memory has, all fields but the time of the master. */
  var events: Vector[Seq[Int]] = Vector.empty
  private var frame            = Vector.empty[Byte]
  private var last             = Option.empty[Report]
  private var known            = 0
  private var since            = 0L              // the report before this one has left
  private var knowns           = Vector(0L -> 0) // how many slaves were known from which cycle on
  private val toSend           = scala.collection.mutable.Queue.empty[FrameByteToSend]
  private case class FrameByteToSend(data: Int, last: Boolean)
  private var offered = false
  private val words   = Array.fill(2)(scala.collection.mutable.Queue.empty[Int])
  private val parts   = Array.fill(2)(Vector.empty[Int])

  dut.clock.setTimeout(0)
  dut.run.poke(true)
  dut.in.valid.poke(false)
  dut.mailbox.take.poke(false)
  dut.mailbox.looks.poke(false)
  for (e <- dut.event) e.valid.poke(false)
  dut.status.poke(0)
  dut.known.poke(0)
  dut.others.poke(0)
  private def set(address: Int, bytes: Seq[Int]): Unit = for ((b, i) <- bytes.zipWithIndex) {
    dut.port.write.poke(true)
    dut.port.address.poke(address + i)
    dut.port.data.poke(b)
    dut.clock.step()
  }
  dut.reset.poke(true.B)
  dut.load(master, server)
  set(MasterRegisters.MasterKey, PlantServer.Key)
  set(MasterRegisters.MasterLife, UdpPackets.big(PlantServer.MasterLife, 8))
  set(MasterRegisters.MasterId, UdpPackets.big(PlantServer.MasterId, 2).reverse)
  set(MasterRegisters.SelfTest, Seq(PlantServer.SelfTest))
  dut.port.write.poke(false)
  dut.reset.poke(false.B)
  dut.run.poke(false)
  dut.clock.step(80) // the key is read
  dut.run.poke(true)

  def knows(slaves: Int): Unit = {
    known = slaves
    knowns :+= cycle -> slaves
    dut.known.poke(slaves)
  }

  /** An event with a kind, and 14 more bytes, to one of the two sources. */
  def offer(source: Int, bytes: Seq[Int]): Unit =
    words(source) ++= bytes.grouped(2).map(b => b.head << 8 | b.last)
  def waitsToBeTaken(source: Int): Boolean = words(source).nonEmpty

  /** A frame to the master. */
  def send(bytes: Seq[Int]): Unit =
    toSend ++= bytes.zipWithIndex.map { case (b, i) => FrameByteToSend(b, i == bytes.size - 1) }
  def sends: Boolean = toSend.nonEmpty
  def datagram(payload: Seq[Int], from: UdpPackets.End = server): Unit =
    send(UdpPackets.packet(from, master, payload))
  def askArp(): Unit = send(
    Seq.fill(6)(0xff) ++ UdpPackets.big(server.mac, 6) ++
      Seq(0x08, 0x06, 0x00, 0x01, 0x08, 0x00, 0x06, 0x04, 0x00, 0x01) ++
      UdpPackets.big(server.mac, 6) ++ UdpPackets.big(server.ip, 4) ++ Seq.fill(6)(0) ++
      UdpPackets.big(master.ip, 4) ++ Seq.fill(18)(0)
  )

  private def left(raw: Array[Byte]): Unit = {
    val packet = EthernetPacket.newPacket(raw, 0, raw.length - 4)
    assert(packet.getHeader.getSrcAddr == master.station && packet.getHeader.getDstAddr == server.station)
    if (packet.contains(classOf[ArpPacket])) arps += 1
    else {
      val ip  = packet.get(classOf[IpV4Packet])
      val udp = packet.get(classOf[UdpPacket])
      assert(ip.getHeader.hasValidChecksum(false) && ip.length == raw.length - 18)
      assert(ip.getHeader.getSrcAddr == master.address && ip.getHeader.getDstAddr == server.address)
      assert(ip.getHeader.getDontFragmentFlag && ip.getHeader.getTtlAsInt == 64)
      assert(udp.getHeader.getChecksum != 0 && udp.hasValidChecksum(master.address, server.address, false))
      assert(udp.getHeader.getLengthAsInt == raw.length - 38)
      assert(udp.getHeader.getSrcPort.valueAsInt == master.port)
      assert(udp.getHeader.getDstPort.valueAsInt == server.port)
      val report = PlantServer.read(udp.getPayload.getRawData.map(_ & 0xff).toSeq)
      // It may have begun while the one before was still leaving. States that are read while the number of
      // slaves changes may be of either number.
      val (before, later) = knowns.partition(_._1 < since - 400)
      val possible        = (before.lastOption ++ later).map(_._2).toSet
      assert(possible(report.slaves.size))
      if (possible.size == 1) assert(report.slaves == (0 until known).map(state(_, known)))
      since = cycle
      for ((e, i) <- report.events.zipWithIndex) {
        assert(e.take(16) == events((report.first + i).toInt), s"event ${report.first + i}")
        val stamp = e.drop(16).foldLeft(0L)(_ << 8 | _)
        assert(stamp <= report.time, "stamped later than reported")
      }
      assert(last.forall(r => r.time < report.time) && last.fold(0L)(_.counter) + 1 == report.counter)
      last = Some(report)
      reports :+= cycle -> report
    }
  }

  /** The host reads the mailbox all the time, as fast as it can. */
  var looks = false

  def step(): Unit = {
    if (looks) dut.mailbox.looks.poke(cycle % 4 == 0)
    if (is(dut.isOf)) {
      if (is(dut.out.valid)) frame :+= dut.out.bits.peekInt().toByte
      if (is(dut.end.valid)) {
        assert(is(dut.end.bits), "a bad frame has left")
        left(frame.toArray)
        frame = Vector.empty
      }
      if (is(dut.refused)) refused += 1
      if (is(dut.dropped)) dropped += 1
    }
    if (toSend.nonEmpty) {
      if (!offered) {
        dut.in.bits.data.poke(toSend.head.data)
        dut.in.bits.last.poke(toSend.head.last)
        dut.in.valid.poke(true)
        offered = true
      }
      if (is(dut.in.ready)) {
        toSend.dequeue()
        offered = false
      }
    } else if (offered || cycle == 0) dut.in.valid.poke(false)
    for (source <- 0 to 1 if words(source).nonEmpty) {
      val port = dut.event(source)
      port.valid.poke(true)
      port.bits.poke(words(source).head)
      if (is(port.ready)) {
        val word = words(source).dequeue()
        parts(source) ++= Seq(word >> 8, word & 0xff)
        if (parts(source).size == EventLayout.MasterTime.offset) {
          events :+= parts(source)
          parts(source) = Vector.empty
        }
      }
    }
    dut.clock.step()
    cycle += 1
    if (toSend.isEmpty && !offered) dut.in.valid.poke(false)
    for (source <- 0 to 1 if words(source).isEmpty) dut.event(source).valid.poke(false)
  }
  def steps(count: Int): Unit = for (_ <- 1 to count) step()
  def ms(count: Int): Unit    = steps(count * MsCycles)

  /** Reports since the last call. */
  def seen(): Seq[Report] = {
    val now = reports.map(_._2)
    reports = Vector.empty
    now
  }
}

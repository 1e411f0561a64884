package flyframe.alarm

import scala.util.Random
import chisel3._
import chiseltest._
import org.scalatest.flatspec.AnyFlatSpec
import flyframe.host.HostOf
import flyframe.memory.HostPort
import flyframe.mii.MiiPins
import flyframe.model._
import flyframe.params.{EscParams, Presets}
import flyframe.protocol.Command.{Aprd, Apwr, Brd, Bwr, Nop}
import flyframe.protocol.DetectorState.Normal
import flyframe.registers.AlarmRegisters
import flyframe.rules.{Line, Reply}
import flyframe.{AlarmSlave, Controller, SharedSimulation, SlaveController}

/** Controllers in a line, port 1 of each wired to port 0 of the next. Core clock and nibble clock are one;
  * receivers sample in the middle of a nibble.
  */
class LineUnderTest(sets: Seq[EscParams]) extends Module {
  require(sets.forall(p => p.coreClockMhz == 25 && p.dataBusWidth == 8))
  val rxDv    = IO(Input(Bool()))
  val rxd     = IO(Input(UInt(4.W)))
  val txEn    = IO(Output(Bool()))
  val txd     = IO(Output(UInt(4.W)))
  val host    = IO(Vec(sets.size, new HostPort(1)))
  val current = IO(Vec(sets.size, Input(UInt(3.W))))

  private def mii(slave: SlaveController): Seq[MiiPins] = slave.phys.collect { case m: MiiPins => m }
  private val slaves = sets.map(p => withReset(reset.asAsyncReset)(Module(Controller.slave(p))))
  for ((slave, i) <- slaves.zipWithIndex) {
    slave.phy_clk_ref := false.B
    slave.pdi_operational.foreach(_ := true.B)
    slave match {
      case s: AlarmSlave =>
        s.alarm.current      := current(i)
        s.alarm.config_fault := false.B
      case _ =>
    }
    HostOf(sets(i), slave.hostPins, host(i))
    for (port <- mii(slave)) {
      port.rx_clk := (!clock.asBool).asClock
      port.rx_er  := false.B
      port.rx_dv  := false.B
      port.rxd    := 0.U
      port.link   := true.B
    }
  }
  mii(slaves.last)(1).link  := false.B
  mii(slaves.head)(0).rx_dv := rxDv
  mii(slaves.head)(0).rxd   := rxd
  txEn                      := mii(slaves.head)(0).tx_en
  txd                       := mii(slaves.head)(0).txd
  for ((near, far) <- slaves.zip(slaves.tail)) {
    mii(far)(0).rx_dv  := mii(near)(1).tx_en
    mii(far)(0).rxd    := mii(near)(1).txd
    mii(near)(1).rx_dv := mii(far)(0).tx_en
    mii(near)(1).rxd   := mii(far)(0).txd
  }
}

/** Alarm slaves and ordinary ones in one line, RTL against the model. */
class AlarmLineSpec extends AnyFlatSpec with SharedSimulation {
  private val ordinary = Presets.default.params.copy(coreClockMhz = 25)
  private val alarm    = Presets.named("alarm-slave").get.params.copy(coreClockMhz = 25)
  private val sets     = Seq(ordinary, alarm, ordinary, alarm, ordinary)
  private val alarms   = Seq(1, 3)

  // Error counters; not of lost links, as the last slave never had one.
  private val Counters = 0x0300 to 0x030c

  private class Driver(dut: LineUnderTest) {
    val slaves        = sets.map(new EscModel(_))
    private val model = new LineModel(slaves)
    private var back  = Vector.empty[Int]
    dut.host.foreach(_.req.poke(false))
    dut.current.foreach(_.poke(Line.current(Normal)))
    dut.rxDv.poke(false)
    idle(200)
    for (i <- alarms) {
      hostWrite(i, 0x0012, 0x40 + i)
      (0x0ea0 to 0x0ea3).foreach(hostWrite(i, _, 0))
    }
    idle(500)
    slaves.foreach(_.advanceUs(20))
    // From now on records are expected.
    send(
      WireFrame.withFcs(EtherCatFrame(Seq(Datagram(Bwr, 0, AlarmRegisters.Confirm, Seq.fill(4)(0)))))
    )

    private def slot(): Unit = {
      dut.clock.step()
      if (dut.txEn.peekBoolean()) back :+= dut.txd.peekInt().toInt
    }
    def idle(slots: Int): Unit = (1 to slots).foreach(_ => slot())
    private def access(slave: Int, address: Int, write: Boolean, byte: Int): Int = {
      val host = dut.host(slave)
      host.addr.poke(address)
      host.write.poke(write)
      host.wdata.poke(byte)
      host.be.poke(1)
      host.req.poke(true)
      while (!host.ack.peekBoolean()) slot()
      val result = host.rdata.peekInt().toInt
      host.req.poke(false)
      slot()
      result
    }
    def hostWrite(slave: Int, address: Int, byte: Int): Unit = {
      access(slave, address, write = true, byte)
      slaves(slave).hostWrite(address, byte)
    }

    /** The byte the host reads, which must be that of the model. */
    def hostRead(slave: Int, address: Int): Int = {
      val byte = access(slave, address, write = false, 0)
      assert(byte == slaves(slave).hostRead(address), f"slave $slave, 0x$address%04x")
      byte
    }
    def detector(slave: Int, state: Int): Unit = {
      dut.current(slave).poke(Line.current(state))
      slaves(slave).alarm.foreach(_.setLine(state))
      idle(500)
      slaves.foreach(_.advanceUs(20))
    }

    /** What comes back for a frame, which must be what comes back from the model for the same one with the
      * model's times, but for slave times.
      */
    def send(frame: WireFrame): SentFrame = send(frame, frame)
    def send(frame: WireFrame, forModel: WireFrame): SentFrame = {
      back = Vector.empty
      dut.rxDv.poke(true)
      for (s <- frame.symbols) {
        dut.rxd.poke(s.nibble)
        slot()
      }
      dut.rxDv.poke(false)
      do idle(100) while (dut.txEn.peekBoolean())
      idle(100)
      val came     = SentFrame(back.indexOf(0xd), back.drop(back.indexOf(0xd) + 1))
      val expected = model.send(forModel).get
      assert(came.good == expected.good && came.payload.size == expected.payload.size, frame)
      if (came.good) assert(timeless(came) == timeless(expected), frame)
      came
    }

    /** Without the times of alarm records, and the FCS. */
    private def timeless(frame: SentFrame): Seq[Int] = {
      val bytes = frame.bytes.toArray
      @annotation.tailrec
      def clear(at: Int): Unit = {
        val d = Reply(bytes.drop(at).toSeq)
        if (d.command == Nop && d.ado == 0x0ea8) (at + 14 until at + 22).foreach(bytes(_) = 0)
        if (d.command == Apwr && d.ado == AlarmRegisters.Acknowledge)
          (at + 12 until at + 14).foreach(bytes(_) = 0)
        if (d.more) clear(at + 12 + d.length)
      }
      if (bytes(14) != 0) clear(16)
      bytes.toSeq.dropRight(4)
    }
  }
  private def number(record: Seq[Int]) = record(0) | record(1) << 8
  private def datagrams(frame: SentFrame): Seq[Reply] = {
    def from(at: Int): Seq[Reply] = {
      val d = Reply(frame.bytes.drop(at))
      d +: (if (d.more) from(at + 12 + d.length) else Nil)
    }
    if (frame.bytes(14) == 0) Nil else from(16)
  }

  together("ordinary, alarm, ordinary, alarm, ordinary", new LineUnderTest(sets))(
    "AP-05, AP-04: appended datagrams pass ordinary slaves untouched, which work as ever" -> { dut =>
      val random   = new Random(1)
      val driver   = new Driver(dut)
      var appended = 0
      var tag      = 0
      var last     = Map.empty[Int, Seq[Int]] // by slave: the data of the record that came last
      for (round <- 1 to 120) {
        if (random.nextInt(3) == 0) driver.detector(alarms(random.nextInt(2)), 1 + random.nextInt(4))
        val slave = random.nextInt(5)
        val place = 0x0f80 + random.nextInt(0x40)
        val data  = Seq.fill(1 + random.nextInt(20))(random.nextInt(256))
        val plain = Seq(
          Datagram(Brd, 0, 0x0000, Seq(0)),
          Datagram(Apwr, -slave, place, data),
          Datagram(Aprd, -slave, place, data.map(_ => 0))
        ).take(random.nextInt(4))
        // To the slave, then to the model, whose time is another one.
        val i = alarms(random.nextInt(2))
        val orders = random.nextInt(4) match {
          case 0 | 1 =>
            tag += 1
            for {
              mine <- last.get(i)
              r    <- driver.slaves(i).alarm.flatMap(_.onOffer) if number(mine) == r.sequence
            } yield Seq(mine.slice(4, 6), EtherCatFrame.little((r.time & 0xffff).toInt)).map { guard =>
              val record = mine.take(2) ++ guard ++ EtherCatFrame.little(tag)
              Datagram(Apwr, -i, AlarmRegisters.Acknowledge, record)
            }
          case 2 =>
            val life  = Seq(random.nextInt(20) / 19, 0)
            val order = Datagram(Apwr, -i, AlarmRegisters.Confirm, EtherCatFrame.little(tag) ++ life)
            Some(Seq(order, order))
          case _ => None
        }
        val frames  = (0 to 1).map(n => plain ++ orders.map(_(n)))
        val mine    = frames(0)
        val wires   = frames.map(f => WireFrame.withFcs(EtherCatFrame(f)))
        val came    = datagrams(driver.send(wires(0), wires(1)))
        val records = came.drop(mine.size)
        driver.idle(500)
        driver.slaves.foreach(_.advanceUs(20))
        appended += records.size
        for ((d, sent) <- came.zip(mine))
          assert(d.workingCounter == (if (sent.command == Brd) 5 else 1), s"round $round")
        if (plain.size == 3) assert(came(2).data == data, s"round $round")
        for (d <- records) {
          assert((d.command, d.ado, d.length, d.workingCounter) == ((0, 0x0ea8, 12, 1)) && d.irq == 0)
          val from = d.adp - 0x40
          assert(alarms.contains(from) && d.data(2) >= 1 && d.data(2) <= 4)
          if (plain.nonEmpty) assert(d.index == from + 1, "the position")
          last += from -> d.data
        }
      }
      assert(appended > 60)
      for (i <- sets.indices; address <- Counters) assert(driver.hostRead(i, address) == 0)
    },
    "AP-07, ERR: bad frames are counted once, where they came from, with datagrams pending or not" -> { dut =>
      val random = new Random(2)
      val driver = new Driver(dut)
      for (round <- 1 to 60) {
        if (round % 5 == 0) driver.detector(alarms(random.nextInt(2)), 1 + random.nextInt(4))
        val bytes = EtherCatFrame(Seq.fill(random.nextInt(4))(Datagram(Brd, 0, 0x0000, Seq(0))))
        val whole = bytes ++ Fcs.of(bytes)
        val at    = random.nextInt(whole.size)
        if (round % 2 == 0) driver.send(WireFrame.ofBytes(whole))
        else driver.send(WireFrame.ofBytes(whole.updated(at, whole(at) ^ 1 << random.nextInt(8))))
      }
      assert(driver.hostRead(0, 0x0300) > 20)
      for (i <- sets.indices; address <- Counters) driver.hostRead(i, address)
    }
  )
}

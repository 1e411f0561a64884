package flyframe.master

import chisel3._
import chisel3.util._
import chiseltest._
import flyframe.SharedSimulation
import flyframe.mii.NibbleStream
import flyframe.model._
import flyframe.params.{EscParams, Presets}
import org.scalatest.flatspec.AnyFlatSpec
import flyframe.protocol.{EventKind, MasterEvent}

/** A line master that has two slaves, node IDs 1 and 2, for thousands of cycles: they only answer its first
  * questions. A cycle is as short as it can be.
  */
class PlayedLine extends Module {
  private val master = Module(new LineMaster(2, 1))

  /** The slaves whose hosts have told the result of their self-tests. */
  val started = IO(Input(Vec(2, Bool())))

  /** How often each slave has been asked for it. */
  val asked = IO(Output(Vec(2, UInt(16.W))))
  val event = IO(chiselTypeOf(master.event))
  master.step          := true.B
  master.run           := true.B
  master.source        := 0.U
  master.cycle         := 1.U
  master.timeout       := 1500.U
  master.retries       := 2.U
  master.request.valid := false.B
  master.requestData   := 0.U
  master.resultAddress := 0.U
  master.room          := true.B
  master.nextEvent     := 0.U
  master.firstEvent    := 0.U
  event <> master.event

  // A frame comes back 40 slots later. It has one datagram: a BWR of one byte, or an APRD of two.
  private val sent     = ShiftRegister(master.out, 40, NibbleStream.idle, true.B)
  private val nibble   = RegInit(0.U(8.W))                      // reset: between frames
  private val reads    = Reg(Bool())
  private val position = Reg(UInt(1.W))
  private val ado      = Reg(UInt(4.W))
  private val value    = Mux(ado === 2.U, position +& 1.U, Mux(ado === 4.U, started(position), 0.U))
  private val counts   = RegInit(VecInit(0.U(16.W), 0.U(16.W))) // reset: never
  asked     := counts
  master.in := sent
  when(sent.valid) { nibble := Mux(sent.payload && !sent.last, nibble + 1.U, 0.U) }
  when(sent.valid && sent.payload) {
    switch(nibble) {
      is(12.U) { master.in.data := sent.data | 2.U } // it has passed a slave
      is(32.U) { reads := sent.data === 1.U }
      is(36.U) { position := sent.data }
      is(40.U) { ado := sent.data }
      is(52.U) { when(reads) { master.in.data := value } }
      is(54.U) { when(!reads) { master.in.data := 2.U } } // working counter
      is(56.U) {
        when(reads) {
          master.in.data := 1.U
          when(ado === 4.U) { counts(position) := counts(position) + 1.U }
        }
      }
    }
  }
}

/** The line master with modelled slaves. */
class LineMasterSpec extends AnyFlatSpec with SharedSimulation {
  private val slave       = Presets.named("alarm-slave").get.params
  private val ordinary    = Presets.named("cyclone4-min").get.params
  private def is(b: Bool) = b.peek().litToBoolean
  private val CycleSlots  = 1000
  private val CycleUs     = CycleSlots * 40 / 1000

  private case class Event(
      kind: Int,
      position: Int,
      node: Int,
      sequence: Int,
      state: Int,
      epoch: Int,
      time: Long
  ) {
    def brief: (Int, Int, Int) = (kind, position, node)
  }

  /** @param disturb
    *   what becomes of the frame with this number on its way back; None: it is lost
    */
  private class Line(
      dut: LineMaster,
      val slaves: Seq[EscModel],
      var disturb: (Int, SentFrame) => Option[SentFrame] = (_, f) => Some(f)
  ) {
    val line            = new LineModel(slaves)
    var events          = Vector.empty[Event]
    private var words   = Vector.empty[Int]                  // of the event that is on its way
    private var request = Seq.empty[Int]                     // bytes of the host's datagram
    var results         = Vector.empty[Boolean]
    var frames          = 0
    var alarms          = 0
    var total           = 0                                  // events since the start
    var serverHears     = true                               // and has every event at once
    var taking          = true
    var sent            = Vector.empty[Seq[(Int, Int, Int)]] // of each frame the datagrams: command, ADP, ADO
    private var sending = Vector.empty[Int]
    private var back    = Vector.empty[Option[(Int, Boolean, Boolean)]]
    private var good    = false
    private var before  = Option((-1, false, false))
    private var slots   = 0
    dut.source.poke(BigInt("665544332210", 16))
    dut.cycle.poke(CycleSlots)
    dut.timeout.poke(1500)
    dut.retries.poke(2)
    dut.request.valid.poke(false)
    dut.room.poke(true)
    dut.nextEvent.poke(0)
    dut.firstEvent.poke(0)
    dut.run.poke(true)
    dut.step.poke(true)
    dut.event.ready.poke(true)
    dut.in.odd.poke(false)
    dut.in.crcGood.poke(true)

    private def cycle(): Unit = {
      if (is(dut.event.valid)) words :+= dut.event.bits.peek().litValue.toInt
      val happens = words.size == MasterEvent.Words
      if (happens) {
        val Seq(kind, node, sequence, state, high, low) = words
        words = Vector.empty
        events :+= Event(
          kind >> 8,
          kind & 0xff,
          node,
          sequence,
          state >> 8,
          state & 0xff,
          high.toLong << 16 | low
        )
      }
      if (is(dut.alarm)) alarms += 1
      if (is(dut.result.valid)) results :+= is(dut.result.bits)
      val asked = dut.requestAddress.peek().litValue.toInt
      dut.clock.step()
      if (request.nonEmpty) dut.requestData.poke(request(asked))
      if (happens) {
        total += 1
        dut.nextEvent.poke(total)
        if (serverHears) dut.firstEvent.poke(total)
      }
    }

    /** The server has all there is from now on. */
    def serverIsBack(): Unit = {
      serverHears = true
      dut.firstEvent.poke(total)
    }
    private def slot(): Unit = {
      val now = back.headOption.flatten
      back = back.drop(1)
      if (now != before) {
        dut.in.valid.poke(now.isDefined)
        dut.in.data.poke(now.fold(0)(_._1))
        dut.in.payload.poke(now.exists(_._2))
        dut.in.last.poke(now.exists(_._3))
        dut.in.bad.poke(now.exists(_._3) && !good)
        before = now
      }
      cycle()
      slots += 1
      if (slots % CycleSlots == 0) slaves.foreach(_.advanceUs(CycleUs))
      if (is(dut.out.valid)) {
        if (is(dut.out.payload)) sending :+= dut.out.data.peek().litValue.toInt
        if (is(dut.out.last)) {
          sent :+= datagrams(bytes(sending))
          for (sent <- line.send(WireFrame.ofNibbles(sending)); frame <- disturb(frames, sent)) {
            good = frame.good
            val start = Vector.fill(15)(5) :+ 13
            back = Vector.fill(40)(None) ++ start.map(n => Some((n, false, false))) ++
              frame.payload.zipWithIndex.map { case (n, i) => Some((n, true, i == frame.payload.size - 1)) }
          }
          frames += 1
          sending = Vector.empty
        }
      }
    }
    def bytes(nibbles: Seq[Int]): Seq[Int] = nibbles.grouped(2).map(n => n.head | n.last << 4).toSeq

    /** Command, ADP and ADO of those in a frame. */
    def datagrams(bytes: Seq[Int]): Seq[(Int, Int, Int)] = {
      def word(at: Int) = bytes(at) | bytes(at + 1) << 8
      val end           = 16 + (word(14) & 0x7ff)
      Iterator
        .iterate(16)(at => at + 12 + (word(at + 6) & 0x7ff))
        .takeWhile(_ < end)
        .map(at => (bytes(at), word(at + 2), word(at + 4)))
        .toSeq
    }
    def cycles(n: Int): Unit = (1 to n * CycleSlots).foreach(_ => slot())

    /** What has happened since this was asked last. */
    def seen(): Seq[Event] = {
      val now = events
      events = Vector.empty
      now
    }
    def present: Int = dut.present.peek().litValue.toInt

    /** The host wants to send this, and would never stop. */
    def asks(command: Int, address: Long, data: Seq[Int]): Unit = {
      val header = Seq(command, data.size, 0, 0) ++ (0 until 4).map(i => (address >> 8 * i & 0xff).toInt)
      request = (header ++ data).padTo(16, 0)
      dut.request.valid.poke(true)
    }
    def host(command: Int, address: Long, data: Seq[Int]): Option[(Int, BigInt)] = {
      results = Vector.empty
      asks(command, address, data)
      while (!is(dut.request.ready)) slot()
      slot()
      dut.request.valid.poke(false)
      for (_ <- 1 to 10 if results.isEmpty) cycles(1)
      cycles(1)
      assert(results.size == 1)
      def kept(at: Int): Int = {
        dut.resultAddress.poke(at)
        slot()
        dut.resultData.peek().litValue.toInt
      }
      Option.when(results.head)(
        (kept(4) | kept(5) << 8, (0 until 8).map(i => BigInt(kept(8 + i)) << (8 * i)).sum)
      )
    }
  }

  /** A slave whose host has started it. */
  private def started(node: Int, params: EscParams = slave): EscModel = {
    val s = new EscModel(params)
    s.hostWrite(0x12, node & 0xff)
    s.hostWrite(0x13, node >> 8)
    Seq(0, 0).zipWithIndex.foreach { case (b, i) => s.hostWrite(0x0ea0 + i, b) }
    Seq(1, 0x70 + node, 3).zipWithIndex.foreach { case (b, i) => s.hostWrite(0x0ea4 + i, b) }
    s
  }
  private def detector(node: Int, position: Int, sequence: Int, state: Int)(e: Event) =
    e.copy(time = 0) == Event(EventKind.Detector, position, node, sequence, state, 0x70 + node, 0)
  import EventKind._

  for (max <- Seq(1, 4, 15))
    together(s"maxSubTelegrams $max", new LineMaster(8, max))(
      "LM-01, LM-02: slaves are counted and listed, their first states reported" -> { dut =>
        val line = new Line(dut, Seq.tabulate(3)(i => started(i + 1)))
        line.slaves.foreach(_.alarm.get.setLine(1))
        line.cycles(24)
        val (scan, records) = line.seen().partition(_.kind != Detector)
        assert(scan.map(_.brief) == Seq((Present, 0, 1), (Present, 1, 2), (Present, 2, 3), (Scanned, 3, 3)))
        assert(
          scan.take(3).map(_.state) == Seq(1, 1, 1) && scan.take(3).map(_.epoch) == Seq(0x71, 0x72, 0x73)
        )
        assert(records.sortBy(_.node).zipWithIndex.forall { case (e, i) =>
          detector(i + 1, i, 1, 1)(e)
        } && records.size == 3)
        assert(line.present == 3)
      },
      "LM-05, LM-06: an alarm is reported once, and acknowledged" -> { dut =>
        val line = new Line(dut, Seq.tabulate(3)(i => started(i + 1)))
        line.cycles(24)
        line.seen()
        line.alarms = 0
        for (round <- 2 to 4) {
          line.slaves(1).alarm.get.setLine(if (round % 2 == 0) 2 else 1)
          line.cycles(8)
          val Seq(e) = line.seen()
          assert(detector(2, 1, round, if (round % 2 == 0) 2 else 1)(e))
          assert(line.slaves(1).hostRead(0x0e88) == 0, "acknowledged")
        }
        assert(line.alarms == 2)
      },
      "ALARM-02, LM-05: behind event 65,535 comes event 1, which is new" -> { dut =>
        val line  = new Line(dut, Seq.tabulate(2)(i => started(i + 1)))
        val alarm = line.slaves(1).alarm.get
        alarm.countFrom(0xfffd)
        line.cycles(24)
        assert(line.seen().exists(detector(2, 1, 0xfffd, 1)))
        line.alarms = 0
        for ((number, i) <- Seq(0xfffe, 0xffff, 1, 2, 3).zipWithIndex) {
          alarm.setLine(2 - i % 2)
          line.cycles(8)
          val events = line.seen()
          assert(events.size == 1 && events.forall(detector(2, 1, number, 2 - i % 2)), s"event $number")
          assert(line.slaves(1).hostRead(0x0e88) == 0, "acknowledged and confirmed")
        }
        assert(line.alarms == 3)
      },
      "LM-05: a record is newer by 1 to 32,767" -> { dut =>
        val line  = new Line(dut, Seq(started(1)))
        val alarm = line.slaves.head.alarm.get
        line.cycles(16)
        line.seen()
        for ((number, state) <- Seq(0x8000 -> 2, 0xffff -> 1)) {
          alarm.countFrom(number)
          alarm.setLine(state)
          line.cycles(8)
          assert(line.seen().map(_.sequence) == Seq(number))
        }
        line.alarms = 0
        alarm.countFrom(0x7fff)
        alarm.setLine(2)
        line.cycles(8)
        assert(line.seen().isEmpty && line.alarms == 0 && line.slaves.head.hostRead(0x0e80) == 0)
      },
      "LM-01, LM-07: a host that always has something to send does not keep slaves from being counted" -> {
        dut =>
          val line = new Line(dut, Seq.tabulate(2)(i => started(i + 1)))
          line.cycles(24)
          line.sent = Vector.empty
          line.asks(8, 0x0e90L << 16, Seq(1))
          line.cycles(48)
          assert(line.sent.count(_.headOption.contains((8, 0, 0x0103))) >= 2)
          assert(line.sent.count(_.headOption.contains((8, 0, 0x0e90))) >= 30)
      },
      "LM-06: each record is acknowledged once, however often it has come meanwhile" -> { dut =>
        val line = new Line(dut, Seq.tabulate(5)(i => started(i + 1)))
        line.cycles(40)
        line.seen()
        line.sent = Vector.empty
        for (round <- 1 to 3) {
          line.slaves.foreach(_.alarm.get.setLine(1 + round % 2))
          line.cycles(if (max == 1) 16 else 8)
        }
        assert(line.seen().count(_.kind == Detector) == 15)
        val told = line.sent.flatten.collect { case (5, node, ado) => (node, ado) }
        for (node <- 1 to 5; ado <- Seq(0x0e8a, 0x0e8e))
          assert(told.count(_ == (node, ado)) == 3, f"slave $node, 0x$ado%04x")
      },
      "LM-06: records behind the frames that count slaves or ask new ones are taken too" -> { dut =>
        val line = new Line(dut, Seq.tabulate(2)(i => started(i + 1)))
        line.cycles(24)
        line.seen()
        // In each of 32 cycles a record, two of them with a count: none waits for the cycle after the next.
        for (round <- 1 to 32) {
          line.slaves.head.alarm.get.setLine(1 + round % 2)
          line.slaves.head.advanceUs(CycleUs)
          val before = line.frames
          while (line.events.isEmpty) line.cycles(1)
          assert(line.frames - before <= 2, s"round $round")
          assert(line.seen().map(_.kind) == Seq(Detector))
          line.cycles(2)
        }
        assert(line.sent.count(_.headOption.contains((8, 0, 0x0103))) >= 2)
      },
      "LM-03: a cut cable: slaves are lost; mended: found, and nothing is missed" -> { dut =>
        val line = new Line(dut, Seq.tabulate(4)(i => started(i + 1)))
        line.cycles(40)
        line.seen()
        line.line.setCable(2, intact = false)
        line.slaves(3).alarm.get.setLine(2)
        line.cycles(24)
        assert(line.seen().map(_.brief) == Seq((Lost, 2, 3), (Lost, 3, 4)) && line.present == 2)
        line.line.setCable(2, intact = true)
        line.cycles(40)
        val (scan, records) = line.seen().partition(_.kind != Detector)
        assert(scan.map(_.brief) == Seq((Found, 2, 3), (Found, 3, 4), (Scanned, 4, 4)))
        assert(records.size == 1 && detector(4, 3, 2, 2)(records.head))
      },
      "LM-04: doubled node IDs and gaps are told, ordinary slaves are listed too" -> { dut =>
        val other = new EscModel(ordinary)
        other.hostWrite(0x12, 3)
        val line = new Line(dut, Seq(started(1), started(2), other, started(6), started(2)))
        line.cycles(40)
        val scan = line.seen().filter(_.kind != Detector)
        assert(
          scan.map(e => (e.kind, e.position, e.node, if (e.kind == Present) 0 else e.sequence)) == Seq(
            (Present, 0, 1, 0),
            (Present, 1, 2, 0),
            (Present, 2, 3, 0),
            (Present, 3, 6, 0),
            (Gap, 3, 6, 3),
            (Present, 4, 2, 0),
            (Duplicate, 4, 2, 1),
            (Gap, 4, 2, 6),
            (Scanned, 5, 5, 0)
          )
        )
      },
      "LM-07: the host's datagrams are sent, with an answer for each" -> { dut =>
        val line = new Line(dut, Seq.tabulate(3)(i => started(i + 1)))
        line.cycles(24)
        assert(line.host(8, 0x0e90L << 16, 1 to 8).map(_._1).contains(3))
        assert(line.slaves.forall(s => s.interrupt && s.hostRead(0x0e97) == 8))
        assert(line.host(5, 2L | 0x0e98L << 16, Seq(9, 8, 7)).map(_._1).contains(1))
        assert(line.slaves.map(_.hostRead(0x0e98)) == Seq(0, 9, 0))
        assert(
          line.host(4, 3L | 0x0012L << 16, Seq(0, 0)).map(r => (r._1, r._2 & 0xffff)).contains((1, BigInt(3)))
        )
        line.disturb = (_, _) => None
        assert(line.host(8, 0x0e90L << 16, Seq(1)).isEmpty)
      },
      "LM-06: bad and lost frames delay events, and double none" -> { dut =>
        val random = new scala.util.Random(max)
        val line   = new Line(dut, Seq.tabulate(3)(i => started(i + 1)))
        line.disturb = (_, f) =>
          random.nextInt(4) match {
            case 0 => None
            case 1 => Some(f.copy(payload = f.payload.updated(50, f.payload(50) ^ 4)))
            case _ => Some(f)
          }
        line.cycles(60)
        for (round <- 1 to 10) {
          line.slaves(random.nextInt(3)).alarm.get.setLine(1 + random.nextInt(4))
          line.cycles(2)
        }
        line.disturb = (_, f) => Some(f)
        line.cycles(60)
        val records = line.seen().filter(_.kind == Detector)
        for ((node, mine) <- records.groupBy(_.node))
          assert(mine.map(_.sequence) == (1 to mine.size), s"node $node")
        assert(line.slaves.forall(_.hostRead(0x0e88) == 0) && records.size >= 5)
      },
      "LM-10: what the server does not have stays at the slaves, " +
        "and a master that starts anew gets it again" -> { dut =>
          val line = new Line(dut, Seq.tabulate(3)(i => started(i + 1)))
          line.cycles(24)
          line.seen()
          assert(line.slaves.map(_.hostRead(0x0e88)) == Seq(0, 0, 0))
          line.serverHears = false
          for (state <- Seq(2, 1, 3)) {
            line.slaves(1).alarm.get.setLine(state)
            line.cycles(6)
          }
          line.slaves(2).alarm.get.setLine(2)
          line.cycles(8)
          assert(line.seen().map(e => (e.node, e.sequence)) == Seq(2 -> 2, 2 -> 3, 2 -> 4, 3 -> 2))
          assert(line.slaves.map(_.hostRead(0x0e88)) == Seq(0, 3, 1))
          assert(line.slaves.forall(_.alarm.get.datagram.isEmpty), "acknowledged all the same")
          dut.run.poke(false)
          line.cycles(4)
          dut.run.poke(true)
          line.cycles(40)
          val again = line.seen().filter(_.kind == Detector)
          assert(again.filter(_.node == 2).map(e => (e.sequence, e.state)) == Seq(2 -> 2, 3 -> 1, 4 -> 3))
          assert(again.filter(_.node == 3).map(_.sequence) == Seq(2) && again.size == 4)
          line.serverIsBack()
          line.cycles(8)
          assert(line.slaves.map(_.hostRead(0x0e88)) == Seq(0, 0, 0) && line.seen().isEmpty)
        },
      "LM-10: a confirmation that was lost is made again" -> { dut =>
        val line = new Line(dut, Seq.tabulate(2)(i => started(i + 1)))
        line.cycles(24)
        line.serverHears = false
        line.slaves(0).alarm.get.setLine(2)
        line.slaves(1).alarm.get.setLine(2)
        line.cycles(8)
        line.disturb = (_, _) => None
        line.serverIsBack()
        line.cycles(12)
        line.disturb = (_, f) => Some(f)
        line.cycles(40)
        assert(line.slaves.forall(_.hostRead(0x0e88) == 0))
      },
      "LM-09: without room for events, records wait at the slaves; a line without slaves is asked again" -> {
        dut =>
          val line = new Line(dut, Seq.tabulate(2)(i => started(i + 1)))
          line.line.setCable(0, intact = false)
          line.cycles(8)
          assert(line.seen().isEmpty && line.present == 0)
          line.line.setCable(0, intact = true)
          dut.room.poke(false)
          line.cycles(30)
          assert(line.present == 2 && line.seen().map(_.kind).toSet == Set(Present, Scanned))
          line.cycles(8)
          assert(line.seen().isEmpty && line.slaves.forall(_.hostRead(0x0e88) == 1))
          dut.room.poke(true)
          line.cycles(10)
          assert(line.seen().map(_.kind) == Seq(Detector, Detector))
      }
    )

  private val room = 4
  together(s"maxSlaves $room", new LineMaster(room, 16))(
    Seq(room, room + 1, 2 * room + 1).map { count =>
      s"LM-01, LM-03: of $count slaves no more are listed than there is room for" -> { (dut: LineMaster) =>
        val line = new Line(dut, Seq.tabulate(count)(i => started(i + 1)))
        line.cycles(40)
        val (scan, records) = line.seen().partition(_.kind != Detector)
        val listed          = Seq.tabulate(room)(i => (i, i + 1))
        assert(
          scan.map(_.brief) == listed.map { case (i, n) => (Present, i, n) } :+ ((Scanned, room, count))
        )
        assert(line.present == room && dut.known.peek().litValue == room)
        assert(records.map(e => (e.position, e.node)).sorted == listed)
        assert(line.slaves.map(_.hostRead(0x0e88)) == Seq.tabulate(count)(i => if (i < room) 0 else 1))
        // What the table says of the first and the last one.
        for (i <- Seq(0, room - 1)) {
          line.slaves(i).alarm.get.setLine(2)
          line.cycles(8)
          val Seq(e) = line.seen()
          assert(detector(i + 1, i, 2, 2)(e))
        }
        line.line.setCable(0, intact = false)
        line.cycles(24)
        assert(line.seen().map(_.brief) == listed.map { case (i, n) => (Lost, i, n) } && line.present == 0)
      }
    }: _*
  )

  together("maxSlaves 128, maxSubTelegrams 20", new LineMaster(128, 20))(
    "LM-06, LM-07: of more than 32 answers, the rest comes again" -> { dut =>
      val count = 20
      val line  = new Line(dut, Seq.tabulate(count)(i => started(i + 1, slave.copy(maxSubTelegrams = 128))))
      dut.timeout.poke(4000)
      while (line.events.count(_.kind == Detector) < count) line.cycles(4)
      line.cycles(8)
      line.seen()
      line.sent = Vector.empty
      var answers = Vector.empty[Int]
      line.disturb = (_, f) => {
        answers :+= line.datagrams(line.bytes(f.payload)).size
        Some(f)
      }
      for (round <- 2 to 3) {
        line.slaves.foreach(_.alarm.get.setLine(2 - round % 2))
        line.cycles(2)
        assert(line.host(8, 0x0e90L << 16, 1 to 8).map(_._1).contains(count))
        line.cycles(12)
        val records = line.seen()
        assert(
          records.map(e => (e.kind, e.node, e.sequence)).sorted == (1 to count).map((Detector, _, round))
        )
        assert(line.slaves.forall(_.hostRead(0x0e88) == 0))
      }
      assert(answers.max > 32 && line.sent.map(_.size).max == 16)
      val told = line.sent.flatten.collect { case (5, node, ado) => (node, ado) }
      for (node <- 1 to count; ado <- Seq(0x0e8a, 0x0e8e))
        assert(told.count(_ == (node, ado)) == 2, f"slave $node, 0x$ado%04x")
    },
    "LM-02, LM-03: 128 slaves are listed, and the last one is heard" -> { dut =>
      val line = new Line(dut, Seq.tabulate(128)(i => started(i + 1)))
      line.slaves.foreach(_.hostWrite(0x0ea6, 0))
      while (line.present < 128) line.cycles(10)
      val scan = Seq.tabulate(128)(i => (Present, i, i + 1)) :+ ((Scanned, 128, 128))
      assert(line.seen().map(_.brief) == scan)
      for (i <- Seq(127, 63)) {
        line.slaves(i).hostWrite(0x0ea6, 3)
        line.cycles(8)
        val Seq(e) = line.seen()
        assert(detector(i + 1, i, 1, 1)(e) && line.slaves(i).hostRead(0x0e88) == 0)
      }
      line.line.setCable(126, intact = false)
      line.cycles(24)
      assert(line.seen().map(_.brief) == Seq((Lost, 126, 127), (Lost, 127, 128)) && line.present == 126)
    }
  )

  together("for thousands of cycles", new PlayedLine)(
    "LM-02: a slave that does not start is waited for, for 1,023 cycles, and then hides no other one" -> {
      dut =>
        def number(u: UInt) = u.peek().litValue.toInt
        def start(slaves: Boolean*): Unit = slaves.zipWithIndex.foreach { case (s, i) =>
          dut.started(i).poke(s)
        }
        def await(): Boolean = (1 to 10000).exists { _ =>
          dut.clock.step(200)
          is(dut.event.valid)
        }
        def next(): (Int, Int, Int, Int) = {
          val words = Seq.fill(MasterEvent.Words) {
            while (!is(dut.event.valid)) dut.clock.step()
            val word = number(dut.event.bits)
            dut.event.ready.poke(true)
            dut.clock.step()
            dut.event.ready.poke(false)
            word
          }
          (words.head >> 8, words.head & 0xff, words(1), words(3) >> 8)
        }
        dut.clock.setTimeout(0)
        dut.event.ready.poke(false)
        start(false, false)
        assert(await() && number(dut.asked(0)) == 1024 && number(dut.asked(1)) == 0)
        assert(next() == (Present, 0, 1, 0))
        // The one behind it is waited for too.
        dut.clock.step(10000)
        assert(!is(dut.event.valid) && number(dut.asked(1)) > 3 && number(dut.asked(0)) == 1024)
        start(false, true)
        assert(await() && next() == (Present, 1, 2, 1))
        assert(await() && next() == (Scanned, 2, 2, 0))
    }
  )
}

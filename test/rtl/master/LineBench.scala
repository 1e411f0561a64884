package flyframe.master

import chisel3._
import chiseltest._
import flyframe.model._
import flyframe.protocol.{EventKind, MasterEvent, SlaveStatus}

/** An event as the reporter gets it. */
final case class SeenEvent(
    kind: Int,
    position: Int,
    node: Int,
    sequence: Int,
    state: Int,
    epoch: Int,
    time: Long
)

/** A datagram of a frame of the master. */
final case class SeenDatagram(command: Int, index: Int, adp: Int, ado: Int, data: Seq[Int])

/** Drives a [[LineMaster]] that has a line of modelled slaves: what a reporter, a host and people do.
  *
  * @param ports
  *   those of the master
  * @param cycle
  *   of the bus, in slots
  * @param clocks
  *   core cycles of a slot
  */
class LineBench(dut: LineMaster, val line: TimedLine, ports: Int = 1, cycle: Int = 1000, clocks: Int = 1) {
  private def is(b: Bool)     = b.peekBoolean()
  private def number(u: UInt) = u.peekInt().toInt

  /** What becomes of the frame with this number on its way back; None: it is lost. */
  var disturb: (Int, SentFrame) => Option[SentFrame] = (_, f) => Some(f)

  /** A port at which bad frames come without end. */
  var noise = Option.empty[Int]

  /** The server stores every event at once; the reporter takes words. */
  var serverHears = true
  var takes       = true

  var events  = Vector.empty[SeenEvent]
  var total   = 0                                      // events since the start
  var results = Vector.empty[Boolean]
  var lost    = 0
  var slots   = 0L
  var frames  = Vector.empty[(Int, Seq[SeenDatagram])] // that left: at which port, and what
  var begins  = Vector.empty[Long]                     // slot in which each of them began
  var reached = Vector.empty[Int]                      // slaves from which the answer of each came back well

  private var breaks   = Option.empty[(Int, Boolean)] // a cable, while a frame leaves
  private var words    = Vector.empty[Int]            // of the event that is on its way
  private var request  = Seq.empty[Int]               // bytes of the host's datagram
  private val leaving  = Array.fill(ports)(Vector.empty[Int])
  private val rested   = Array.fill(ports)(false)     // no frame of another bench is leaving
  private val back     = Array.fill(ports)(Vector.empty[Option[(Int, Boolean, Boolean)]])
  private val good     = Array.fill(ports)(false)
  private val before   = Array.fill(ports)(Option((-1, false, false)))
  private var confirms = -1
  private var ready    = true

  dut.clock.setTimeout(0)
  dut.source.poke(BigInt("665544332210", 16))
  dut.cycle.poke(cycle)
  dut.timeout.poke(600)
  dut.retries.poke(2)
  dut.life.poke(0x1234)
  dut.listed.poke(false)
  dut.confirmed.poke(0)
  dut.request.valid.poke(false)
  dut.requestData.poke(0)
  dut.resultAddress.poke(0)
  dut.silence.poke(false)
  dut.resetAlarm.poke(false)
  dut.event.ready.poke(true)
  dut.nextEvent.poke(0)
  dut.roomForRecords.poke(true)
  dut.roomForStates.poke(true)
  dut.status.poke(0)
  dut.framesLost.poke(0)
  dut.look.poke(0)
  dut.window.poke(0)
  dut.windowByte.poke(0)
  dut.expect.valid.poke(false)
  dut.expect.bits.poke(0)
  dut.run.poke(true)
  dut.step.poke(true)
  for (in <- dut.in) {
    in.valid.poke(false)
    in.odd.poke(false)
    in.crcGood.poke(true)
  }

  private def clock(): Unit = {
    if (takes != ready) {
      ready = takes
      dut.event.ready.poke(takes)
    }
    if (takes && is(dut.event.valid)) words :+= number(dut.event.bits)
    val happens = words.size == MasterEvent.Words
    if (happens) {
      val Seq(kind, node, sequence, state, t3, t2, t1, t0) = words
      words = Vector.empty
      events :+= SeenEvent(
        kind >> 8,
        kind & 0xff,
        node,
        sequence,
        state >> 8,
        state & 0xff,
        Seq(t3, t2, t1, t0).foldLeft(0L)(_ << 16 | _)
      )
    }
    if (is(dut.result.valid)) results :+= is(dut.result.bits)
    if (is(dut.lost)) lost += 1
    val asked = Option.when(request.nonEmpty)(number(dut.requestAddress))
    dut.clock.step()
    asked.foreach(at => dut.requestData.poke(request(at)))
    if (happens) {
      total += 1
      dut.nextEvent.poke(total & 0xffff)
    }
    val has = if (serverHears) total else confirms
    if (has != confirms) {
      confirms = has
      dut.confirmed.poke(has & 0xffff)
    }
  }

  private def datagrams(nibbles: Seq[Int]): Seq[SeenDatagram] = {
    val bytes         = nibbles.grouped(2).map(n => n.head | n.last << 4).toIndexedSeq
    def word(at: Int) = bytes(at) | bytes(at + 1) << 8
    val end           = 16 + (word(14) & 0x7ff)
    Iterator
      .iterate(16)(at => at + 12 + (word(at + 6) & 0x7ff))
      .takeWhile(_ < end)
      .map(at =>
        SeenDatagram(
          bytes(at),
          bytes(at + 1),
          word(at + 2),
          word(at + 4),
          bytes.slice(at + 10, at + 10 + (word(at + 6) & 0x7ff))
        )
      )
      .toSeq
  }

  /** A frame is leaving. */
  def leaves: Boolean = leaving.exists(_.nonEmpty)

  /** A nibble slot. */
  def slot(): Unit = {
    for (y <- noise if back(y).isEmpty) {
      good(y) = false
      back(y) = Vector.tabulate(200)(i => Option.when(i > 24)((5, false, i == 199)))
    }
    for (y <- 0 until ports) {
      val now = back(y).headOption.flatten
      back(y) = back(y).drop(1)
      if (now != before(y)) {
        val in = dut.in(y)
        in.valid.poke(now.exists(!_._3))
        in.data.poke(now.fold(0)(_._1))
        in.payload.poke(now.exists(_._2))
        in.end.poke(now.exists(_._3))
        in.bad.poke(now.exists(_._3) && !good(y))
        before(y) = now
      }
    }
    if (clocks > 1) {
      dut.step.poke(true)
      clock()
      dut.step.poke(false)
      for (_ <- 1 until clocks) clock()
    } else clock()
    slots += 1
    for (y <- 0 until ports)
      if (is(dut.out(y).end)) {
        if (rested(y)) left(y)
      } else if (!is(dut.out(y).valid)) rested(y) = true
      else if (rested(y) && is(dut.out(y).payload)) leaving(y) :+= number(dut.out(y).data)
  }

  /** Cuts a cable, or mends it, now: a frame that is in flight gets lost, or comes back bad. */
  def setCable(cable: Int, intact: Boolean): Unit =
    if (leaves) breaks = Some((cable, intact))
    else {
      line.setCable(cable, intact)
      for (y <- 0 until ports) loseFlying(y)
    }

  /** It comes back bad if its beginning is there already. */
  private def loseFlying(y: Int): Unit = if (back(y).nonEmpty) {
    if (back(y).head.isDefined) good(y) = false else back(y) = Vector.empty
    reached = reached.init :+ 0
  }

  private def left(y: Int): Unit = {
    val payload = leaving(y)
    val start   = slots - payload.size - 17 // its end took a slot, too
    leaving(y) = Vector.empty
    frames :+= (y -> datagrams(payload))
    begins :+= start
    reached :+= 0
    for ((time, at, sent) <- line.send(y, start.toDouble, payload) if at < ports)
      for (frame <- disturb(frames.size - 1, sent)) {
        good(at) = frame.good
        if (good(at)) reached = reached.init :+ (frame.bytes(18) | frame.bytes(19) << 8)
        val delay = (time - slots).toInt max 1
        back(at) = Vector.fill(delay)(None) ++
          (Vector.fill(15)(5) :+ 13).map(n => Some((n, false, false))) ++
          frame.payload.map(n => Some((n, true, false))) :+ Some((0, true, true))
      }
    for ((cable, intact) <- breaks) {
      breaks = None
      setCable(cable, intact)
    }
    line.pass(slots.toDouble)
  }

  /** Passes bus cycles. */
  def cycles(n: Int): Unit = for (_ <- 1 to n * cycle) slot()

  /** Until something is so, for so many bus cycles at most; the slots it took. */
  def until(most: Int)(so: => Boolean): Int = {
    val start = slots
    while (!so && slots - start < most.toLong * cycle) slot()
    assert(so, s"not within $most cycles")
    (slots - start).toInt
  }

  /** Enough cycles for all slaves to be read twice, and for what follows. */
  def settle(): Unit = cycles(line.slaves.size / 2 + 12)

  /** What has happened since this was asked last; alarm records of it. */
  def seen(): Seq[SeenEvent] = {
    val now = events
    events = Vector.empty
    now
  }
  def records(): Seq[SeenEvent] = seen().filter(_.kind == EventKind.Detector)

  def fire: Boolean            = is(dut.state.fire)
  def sounding: Boolean        = is(dut.state.sounding)
  def alarm: Boolean           = is(dut.state.alarm)
  def dead: Boolean            = is(dut.state.dead)
  def wrong: Boolean           = is(dut.state.wrong)
  def slaveFault: Boolean      = is(dut.state.slaveFault)
  def disabled: Boolean        = is(dut.state.disabled)
  def testing: Boolean         = is(dut.state.testing)
  def ringOpen: Boolean        = is(dut.state.ringOpen)
  def ringClosed: Boolean      = is(dut.state.ringClosed)
  def present: Int             = number(dut.state.present)
  def known: Int               = number(dut.state.known)
  def cut: Int                 = number(dut.state.cut)
  def loud: (Boolean, Boolean) = (fire, sounding)

  /** A slave in the table: status word, node ID, result and epoch of its host, records dropped. */
  def table(position: Int): (Int, Int, Int, Int, Int) = {
    dut.window.poke(position)
    val state = (0 until 8).map { i =>
      dut.windowByte.poke(i)
      slot()
      BigInt(number(dut.windowState)) << (8 * i)
    }.sum
    def bits(at: Int, n: Int) = (state >> at & ((1 << n) - 1)).toInt
    (bits(0, 16), bits(16, 16), bits(32, 8), bits(40, 8), bits(48, 8))
  }
  def status(position: Int): Int       = table(position)._1
  def node(position: Int): Int         = table(position)._2
  def isAbsent(position: Int): Boolean = (status(position) & SlaveStatus.Absent) != 0
  def isWrong(position: Int): Boolean  = (status(position) & SlaveStatus.Wrong) != 0

  /** The same for reports. */
  def reported(position: Int): (Int, Int) = {
    val bytes = (0 until 4).map { i =>
      dut.look.poke(position << 2 | i)
      slot()
      number(dut.lookData)
    }
    (bytes(0) << 8 | bytes(1), bytes(2) << 8 | bytes(3))
  }

  def silence(): Unit = pulse(dut.silence)
  def reset(): Unit   = pulse(dut.resetAlarm)
  private def pulse(b: Bool): Unit = {
    b.poke(true)
    slot()
    b.poke(false)
  }

  /** The host expects these slaves, and nobody behind them. */
  def expect(nodes: Int*): Unit = {
    while (slots < 130) slot() // as the registers make a host wait after reset (HOST-10)
    for ((node, i) <- nodes.zipWithIndex) {
      dut.window.poke(i)
      dut.expect.bits.poke(node)
      dut.expect.valid.poke(true)
      slot()
      dut.expect.valid.poke(false)
    }
    dut.listed.poke(true)
  }

  /** The host wants to send this, and would never stop. */
  def asks(command: Int, address: Long, data: Seq[Int]): Unit = {
    val header = Seq(command, data.size, 0, 0) ++ (0 until 4).map(i => (address >> 8 * i & 0xff).toInt)
    request = (header ++ data).padTo(16, 0)
    dut.request.valid.poke(true)
  }

  /** The host's datagram; working counter and data of its answer. */
  def host(command: Int, address: Long, data: Seq[Int]): Option[(Int, BigInt)] = {
    results = Vector.empty
    asks(command, address, data)
    while (!is(dut.request.ready)) slot()
    slot()
    dut.request.valid.poke(false)
    until(10)(results.nonEmpty)
    cycles(1)
    assert(results.size == 1)
    def kept(at: Int): Int = {
      dut.resultAddress.poke(at)
      slot()
      number(dut.resultData)
    }
    Option.when(results.head)(
      (kept(4) | kept(5) << 8, (0 until 8).map(i => BigInt(kept(8 + i)) << (8 * i)).sum)
    )
  }
}

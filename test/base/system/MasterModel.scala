package flyframe.system

import scala.collection.mutable
import flyframe.protocol._

/** How a master is set. Times in us.
  *
  * @param expected
  *   node IDs, by position
  */
final case class MasterSettings(
    expected: Seq[Int],
    ring: Boolean,
    cycle: Long = 5000,
    id: Int = 1,
    retries: Int = 2,
    maxSlaves: Int = 64,
    serverTimeout: Long = 30000000L,
    repeat: Long = 200000L,
    heartbeat: Long = 1000000L
)

/** The alarm master: what it does in each bus cycle, from the rules and not from the RTL. State travels
  * beside history: sounder and fire follow from status words, whatever waits for the server.
  *
  * @param life
  *   random, another one after each start
  * @param changed
  *   called when something is other than before
  */
class MasterModel(settings: MasterSettings, val life: Long, bus: Bus, started: Long, changed: () => Unit)
    extends MasterDecisions {
  import MasterModel._
  import settings.{expected, maxSlaves}

  /** What is known of a position. */
  protected final class Row(val position: Int) {
    var block       = SlaveBlock(SlaveStatus.Absent, expected.lift(position).getOrElse(0), 0, 0, 0, 0)
    var told        = Option.empty[SlaveBlock]
    var taken       = List.empty[Record]
    var heard       = Option.empty[Record]
    var silence     = false
    var reset       = false
    def present     = (block.status & SlaveStatus.Absent) == 0
    val expectation = expected.lift(position).getOrElse(0)
  }

  protected val rows: Array[Row] = Array.tabulate(maxSlaves)(new Row(_))
  private var now                = started

  // Cyclic state.
  protected var soundingNow   = false
  protected var fireNow       = false
  protected var resetAsked    = false
  protected var lastOr        = 0
  private var ordersUntil     = Long.MaxValue
  private var dead            = true
  private var ringOpen        = false
  private var cut             = 0
  private var present         = 0
  private var highest         = expected.size
  private var whenClosed      = 0                         // slaves when the ring was last closed
  private val misses          = Array(0, 0)
  private val counts          = Array(0, 0)
  private val steady          = Array(false, false)       // the last two answers had the same count
  private val rotation        = Array(0, 0)
  private val orderTurn       = Array(0, 0)
  private var acknowledgement = Vector.empty[Acknowledge] // by position of the line
  private var lost            = 0

  private val plant      = new MasterPlantModel(settings, life, started, changed)
  private var toldLine   = Option.empty[(Int, Int, Int)]
  private var toldStatus = -1

  /** Orders of the server for the host. */
  def mailbox: mutable.Queue[Answer] = plant.mailbox

  def sounding: Boolean                  = soundingNow
  def fire: Boolean                      = fireNow
  def waiting: Int                       = plant.waiting
  def nextEvent: Int                     = plant.nextEvent
  def isReset: Boolean                   = !resetAsked
  def isServerSilent                     = plant.isServerSilent
  def row(p: Int): (SlaveBlock, Boolean) = (rows(p).block, rows(p).present)

  // The panel.

  /** Sounders off, until the next alarm. */
  def silence(at: Long): Unit = {
    now = at
    soundingNow = false
    for (r <- rows if has(r, SlaveStatus.Sounding)) r.silence = true
    ordersUntil = now + OrderTime
    changed()
  }

  /** Alarms end, and detectors begin anew. */
  def reset(at: Long): Unit = {
    now = at
    soundingNow = false
    resetAsked = true
    for (r <- rows if has(r, SlaveStatus.Sounding | SlaveStatus.Latched | SlaveStatus.Alarm)) r.reset = true
    ordersUntil = now + OrderTime
    changed()
  }

  private def has(r: Row, bits: Int) = (r.present || !forgetsOrders) && (r.block.status & bits) != 0

  // A bus cycle.

  /** One cycle of the bus. */
  def cycle(at: Long): Unit = {
    now = at
    endOrders()
    val answered = if (settings.ring) cycleOfRing() else cycleOfLine()
    if (answered.isEmpty) noAnswer()
    writeEvents()
    plant.countFull()
    plant.watch(now)
    val word = status
    if (word != toldStatus) {
      toldStatus = word
      plant.reportSoon()
      changed()
    }
  }

  private def cycleOfLine(): Option[BusAnswer] = {
    val answer = send(0, 0)
    answer.foreach { a =>
      countedAt(0, a.count)
      hear(a.or, whole = true)
      take(a, 0)
      look(0 until a.count)
    }
    answer
  }

  private def cycleOfRing(): Option[BusAnswer] = {
    val n = ringSize
    send(0, 0) match {
      case Some(a) if a.end == 1 =>
        if (ringOpen) changed()
        ringOpen = false
        countedAt(0, a.count)
        countedAt(1, 0)
        whenClosed = a.count
        hear(a.or, whole = true)
        take(a, 0)
        look(0 until a.count)
        Some(a)
      case near =>
        if (near.nonEmpty) open()
        val far = send(1, n - counts(1)).filter(_.end == 1)
        if (far.nonEmpty) open()
        for ((a, end) <- Seq(near, far).zipWithIndex) a match {
          case Some(b) => countedAt(end, b.count)
          case None    => missed(end)
        }
        if (near.nonEmpty) cut = near.get.count
        else if (misses(0) >= Patience) cut = 0
        if (!hearsTogether) lastOr |= near.fold(0)(_.or)
        val or = near.fold(0)(_.or) | far.fold(0)(_.or)
        if (near.nonEmpty || far.nonEmpty) {
          // An end that has been silent for some time is not in use.
          hear(
            or,
            whole = (near.nonEmpty || misses(0) >= Patience) && (far.nonEmpty || misses(1) >= Patience)
          )
          near.foreach(take(_, 0))
          far.foreach(a => take(a, n - a.count))
          look((0 until counts(0)) ++ ((n - counts(1)) max counts(0) until n))
        }
        near.orElse(far)
    }
  }

  private def countedAt(end: Int, count: Int): Unit = {
    misses(end) = 0
    steady(end) = counts(end) == count
    counts(end) = count
    if (!steady(end)) positionsChanged()
  }

  /** What is ordered may now be for others. */
  private def positionsChanged(): Unit = {
    if (forgetsOrders) giveUp()
    changed()
  }

  private def open(): Unit = if (!ringOpen) {
    ringOpen = true
    changed()
  }

  private def missed(end: Int): Unit = if (misses(end) < Patience) {
    misses(end) += 1
    // After a while nobody is there.
    if (misses(end) == Patience && counts(end) > 0) {
      counts(end) = 0
      positionsChanged()
    }
    changed()
  }

  private def noAnswer(): Unit = {
    if (!settings.ring) missed(0)
    if (counts(0) + counts(1) == 0) {
      if (!dead) changed()
      dead = true
      look(Nil)
    }
  }

  /** Who answers now; the others are absent. */
  private def look(positions: Seq[Int]): Unit = {
    present = positions.size
    if (positions.nonEmpty) {
      if (dead) changed()
      dead = false
      highest = highest max (positions.last + 1)
    }
    if (rows.exists(r => r.present || r.heard.nonEmpty)) {
      val here = new Array[Boolean](maxSlaves)
      positions.foreach(p => if (p < maxSlaves) here(p) = true)
      for (r <- rows if !here(r.position)) {
        if (r.heard.nonEmpty) forget(r)
        if (r.present) leave(r)
      }
    }
  }

  /** What is known of the records of a slave that is not there: when it is back it may have started anew,
    * with the same numbers and another alarm. It may have gone before its state was read.
    */
  private def forget(r: Row): Unit = if (forgetsRecords) {
    r.taken = Nil
    r.heard = None
    acknowledgement = acknowledgement.filter(_.position != r.position)
  }

  /** A slave answers no more. If it is back and sounds, that is news. */
  private def leave(r: Row): Unit = {
    val gone = if (hearsReturned) SlaveStatus.Sounding else 0
    r.block = r.block.copy(status = r.block.status & ~gone | SlaveStatus.Absent)
    changed()
  }

  /** Composes the frame of an end and sends it, again if it is lost.
    *
    * @param base
    *   position of the first slave that reads it
    */
  private def send(end: Int, base: Int): Option[BusAnswer] = {
    val count = counts(end)
    val reads =
      if (count == 0) Nil else (0 until (Reads min count)).map(i => (rotation(end) + i) % count)
    val due = (0 until (if (steady(end)) count else 0)).filter { p =>
      base + p >= 0 && base + p < maxSlaves && { val r = rows(base + p); r.present && (r.silence || r.reset) }
    }
    val turned = due.dropWhile(_ < orderTurn(end)) ++ due.takeWhile(_ < orderTurn(end))
    val orders = turned.take(Orders).map { p =>
      val r = rows(base + p)
      LineOrder(p, (if (r.silence) LineOrder.Silence else 0) | (if (r.reset) LineOrder.Reset else 0))
    }
    val own =
      if (acknowledgement.isEmpty) Vector.empty
      else acknowledgement.filter(a => a.position >= base && a.position < base + count).take(Acknowledges)
    val frame =
      BusFrame(
        plant.first & 0xffff,
        (life & 0xffff).toInt,
        reads,
        orders,
        own.map(a => a.copy(position = a.position - base))
      )
    var tries  = 0
    var answer = Option.empty[BusAnswer]
    while (answer.isEmpty && tries <= settings.retries) {
      answer = bus.exchange(end, frame)
      if (answer.isEmpty) lost = (lost + 1) & 0xffff
      tries += 1
    }
    if (answer.nonEmpty) {
      if (count > 0) rotation(end) = (rotation(end) + reads.size) % count
      orderTurn(end) = orders.lastOption.fold(0)(_.position + 1)
      if (own.nonEmpty) {
        acknowledgement = acknowledgement.filterNot(own.contains)
        changed()
      }
      // With another number of slaves the positions may be those of others. What was read was read before the
      // orders of the same frame.
      if (answer.get.count == count) {
        for (i      <- reads.indices; b <- answer.get.blocks(i)) update(base + reads(i), b)
        for ((o, i) <- orders.zipWithIndex if answer.get.executed(i)) ordered(rows(base + o.position))
      }
    }
    answer
  }

  private def ringSize =
    if (whenClosed > 0) whenClosed else if (expected.nonEmpty) expected.size else counts.sum

  /** A slave has taken an order: what it says from now on is new. */
  private def ordered(r: Row): Unit = {
    if (endsOrder) {
      val gone = SlaveStatus.Sounding | (if (r.reset) Smoke else 0)
      r.silence = false
      r.reset = false
      r.block = r.block.copy(status = r.block.status & ~gone)
    }
    changed()
  }

  /** Orders that are on their way are none any more. Whoever still sounds is heard again: the safe side. */
  private def giveUp(): Unit = {
    val pending = rows.filter(r => r.silence || r.reset)
    for (r <- pending) {
      r.silence = false
      r.reset = false
    }
    if (pending.nonEmpty && soundsAgain) lastOr &= ~SlaveStatus.Sounding
  }

  /** Orders that nobody has taken in time are over, and so is a reset that has not ended the fire. */
  private def endOrders(): Unit = if (now > ordersUntil) {
    ordersUntil = Long.MaxValue
    if (forgetsOrders) giveUp()
    if (forgetsReset) resetAsked = false
    changed()
  }

  private def update(position: Int, block: SlaveBlock): Unit = if (position >= 0 && position < maxSlaves) {
    val r     = rows(position)
    val wrong = expected.nonEmpty && r.expectation != block.node
    val now   = if (wrong) block.copy(status = block.status | SlaveStatus.Wrong) else block
    if (now != r.block) {
      val rise = (now.status & SlaveStatus.Sounding) != 0 && (r.block.status & SlaveStatus.Sounding) == 0
      r.block = now
      if (rise) sound()
      if (!endsOrder) {
        if ((now.status & SlaveStatus.Sounding) == 0) r.silence = false
        if ((now.status & (SlaveStatus.Latched | SlaveStatus.Alarm)) == 0) r.reset = false
      }
      changed()
    }
  }

  // Cyclic state.

  private def sound(): Unit = {
    if (!soundingNow || resetAsked) changed()
    soundingNow = true
    // An alarm after the reset is none that it ends.
    if (forgetsReset) resetAsked = false
  }

  /** The status words of all that answer.
    *
    * @param whole
    *   from each end that is in use
    */
  private def hear(or: Int, whole: Boolean): Unit = {
    val rise = (or & SlaveStatus.Sounding & ~lastOr) != 0
    if (or != lastOr) changed()
    lastOr = if (whole) or else lastOr | or
    if (soundsByState && rise) sound()
    if (followsSlaves && (or & SlaveStatus.Sounding) == 0) soundingNow = false
    if (soundsByState && (or & Smoke) != 0) {
      if (!fireNow) changed()
      fireNow = true
    } else if (resetAsked && whole && (or & Smoke) == 0) {
      changed()
      fireNow = false
      resetAsked = false
    }
  }

  /** A record: `or` tells whether its alarm is one still. */
  private def hear(r: Row, record: Record, or: Int): Unit = {
    if (record.isAlarm && !r.heard.exists(isSame(_, record))) {
      if (recordSounds(or)) sound()
      if (recordFires(or)) {
        if (!fireNow) changed()
        fireNow = true
      }
    }
    r.heard = Some(record)
  }

  // Records.

  private def take(a: BusAnswer, base: Int): Unit = if (a.records.nonEmpty) for (x <- a.records) {
    val position = base + x.index - 1
    if (position >= 0 && position < maxSlaves) {
      val r = rows(position)
      hear(r, x.record, a.or)
      r.taken.find(isSame(_, x.record)) match {
        case Some(_) => acknowledge(position, x.record, (nextEvent - 1) & 0xffff)
        case None if plant.hasRoomForRecords =>
          val tag = nextEvent & 0xffff
          if (stores(x.record))
            plant.emit(
              Event(
                EventKind.Detector,
                position,
                x.node,
                x.record.sequence,
                x.record.state,
                x.record.epoch,
                x.record.time,
                now
              )
            )
          r.taken = (x.record :: r.taken).take(TakenKept)
          acknowledge(position, x.record, tag)
        case None =>
      }
    }
  }

  private def acknowledge(position: Int, record: Record, tag: Int): Unit = {
    val a = Acknowledge(position, record.sequence, record.guard, tag)
    if (
      !acknowledgement.exists(b => b.position == position && b.sequence == a.sequence && b.guard == a.guard)
    ) {
      acknowledgement :+= a
      changed()
    }
  }

  // Events.

  private def writeEvents(): Unit = {
    var i = 0
    while (i < highest && plant.hasRoomForStates) {
      val r = rows(i)
      if (!r.told.exists(isTold(_, r.block))) {
        val b = r.block
        r.told = Some(b)
        plant.emit(
          Event(
            EventKind.Slave,
            i,
            b.node,
            b.status & ~SlaveStatus.Waiting,
            b.selfTest,
            b.epoch,
            (b.dropped << 8 | b.links).toLong,
            now
          )
        )
      }
      i += 1
    }
    val line = (status, present, cut)
    if (!toldLine.contains(line) && plant.hasRoomForStates) {
      toldLine = Some(line)
      plant.emit(Event(EventKind.Line, present, cut, status & 0xffff, 0, status >> 16, lost.toLong, now))
    }
  }

  private def isTold(a: SlaveBlock, b: SlaveBlock) =
    (a eq b) || ((a.status ^ b.status) & ~SlaveStatus.Waiting) == 0 && a.node == b.node &&
      a.selfTest == b.selfTest && a.epoch == b.epoch && a.dropped == b.dropped

  /** The whole status word: bits of MasterStatus. */
  def status: Int = {
    import MasterStatus._
    def bit(condition: Boolean, code: Int) = if (condition) code else 0
    var all                                = 0
    var missing                            = false
    var i                                  = 0
    while (i < highest) {
      val r = rows(i)
      if (r.present) all |= r.block.status
      else if (r.expectation != 0) missing = true
      i += 1
    }
    val or = if (dead) 0 else lastOr
    bit(fireNow, Fire) | bit(soundingNow, Sounding) | bit((or & SlaveStatus.Alarm) != 0, Alarm) |
      bit(dead, LineDead) | bit(ringOpen, RingOpen) |
      bit(missing || (all & SlaveStatus.Wrong) != 0, WrongLine) |
      bit(((all | or) & SlaveStatus.Faults & ~SlaveStatus.Wrong) != 0, SlaveFault) |
      bit((or & SlaveStatus.Disabled) != 0, Disabled) | bit((or & SlaveStatus.Testing) != 0, Testing) |
      bit(plant.isServerSilent, ServerSilent) | bit(expected.isEmpty, Unlisted) | bit(plant.isFull, Full)
  }

  // Plant side.

  /** When something happens next without the line. */
  def due: Long = plant.due(now)

  /** A report, if one is due. */
  def report(at: Long): Option[Report] = {
    now = at
    plant.watch(now)
    plant.report(now)(
      status,
      lost,
      present,
      cut,
      Seq.tabulate(highest min maxSlaves)(i => ReportedSlave(statusOf(rows(i)), rows(i).block.node))
    )
  }

  private def statusOf(r: Row) =
    r.block.status | (if (!r.present && r.expectation != 0) SlaveStatus.Wrong else 0)

  /** An answer has come. */
  def answer(a: Answer, at: Long): Unit = {
    now = at
    plant.answer(a, now)
  }

  /** The host has carried out an order. */
  def commanded(order: Answer, result: Int): Unit = plant.commanded(order, result, now)

  /** Cycles have been left out in which nothing happened. */
  def skip(cycles: Long): Unit =
    for (end <- 0 to 1 if counts(end) > 0)
      rotation(end) = ((rotation(end) + cycles * (Reads min counts(end))) % counts(end)).toInt

}

object MasterModel {

  // Of a frame.
  val Reads        = 4
  val Orders       = 2
  val Acknowledges = 16

  /** Records kept per slave, so that none is taken twice. */
  val TakenKept = 4

  /** Cycles without an answer from an end after which nobody is there. */
  val Patience = 4

  /** How long an order is tried, in us. */
  val OrderTime = 1000000L

  private val Smoke = SlaveStatus.Alarm | SlaveStatus.Latched
}

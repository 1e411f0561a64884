package flyframe.relay

import scala.collection.mutable
import scala.collection.mutable.ArrayBuffer

/** A link of the [[RelayEngine]]: it knows the bits that its sender has decided to send, and works out when
  * its receiver finds what in them, by the rules of the bit timing unit ([[flyframe.can.BitTimingModel]]),
  * edge by edge instead of cycle by cycle. Bits that are decided otherwise later, by an abort or an error,
  * are worked out again.
  *
  * @param heardFrom
  *   the first cycle of the receiver in which a bit of the sender is heard
  */
class EventLink(timing: LinkTiming, heardFrom: Long => Long) {
  import EventLink._

  // What is sent from bit `from` on; behind the last one everything is recessive.
  private var from   = 0L
  private val raw    = new Levels
  private val levels = new Levels // as they arrive
  private val flips  = mutable.Set.empty[Long]
  private var isDark = false

  // What the receiver finds: `fired` events have happened, `certain` ones cannot change any more.
  private val events  = ArrayBuffer.empty[(Long, Event)]
  private var fired   = 0
  private var certain = 0

  private var cycle = 0L // of the sample that tells an event
  private val recorder = new LinkListener {
    private def add(e: Event): Unit                      = events += (cycle -> e)
    def starts(): Unit                                   = add(Starts)
    def header(header: LinkHeader, body: LinkBody): Unit = add(Header(header, body))
    def identified(): Unit                               = add(Identified)
    def ended(isGood: Boolean): Unit                     = add(Ended(isGood))
    def badHeader(): Unit                                = add(BadHeader)
    def badFrame(): Unit                                 = add(BadFrame)
  }

  /** The receiver in the beginning of a cycle. */
  private class State {
    val receiver     = new LinkReceiverModel(recorder)
    var next         = 0L    // cycle
    var start        = 0L    // cycle in which the present bit began
    var isSampled    = false // its sample is over
    var lastSample   = true
    var synchronised = false
    var level        = true

    /** As a port that comes up has it. */
    def restart(at: Long): Unit = {
      receiver.restart()
      next = at
      start = at
      isSampled = false
      lastSample = true
      synchronised = false
      level = true
    }

    def copyFrom(o: State): Unit = {
      receiver.copyFrom(o.receiver)
      next = o.next
      start = o.start
      isSampled = o.isSampled
      lastSample = o.lastSample
      synchronised = o.synchronised
      level = o.level
    }
  }

  private val base = new State // nothing can change in front of it
  private val work = new State // behind everything that is known
  private var isUp = false

  /** Of the events that have happened the last ones are of a frame that is not over. */
  private var isInFrame = false

  /** The level is heard up to cycle `end`, exclusive; or, without an end, until the receiver is idle. An idle
    * receiver synchronises hard with the next edge: its bits count for nothing.
    */
  private def hear(s: State, end: Long): Unit = {
    while (!(s.level && s.receiver.isIdle) && nextSample(s) < end) {
      cycle = nextSample(s)
      if (s.isSampled) s.start += timing.cycles
      s.isSampled = true
      s.lastSample = s.level
      s.synchronised = false
      s.receiver.take(s.level)
      s.next = cycle + 1
    }
    if (end != Never) s.next = end
  }

  private def nextSample(s: State) = s.start + timing.sample + (if (s.isSampled) timing.cycles else 0)

  /** A falling edge, in cycle `s.next`. */
  private def edge(s: State): Unit = if (s.lastSample && !s.synchronised) {
    s.synchronised = true
    if (s.isSampled && s.next - s.start >= timing.cycles) {
      s.start += timing.cycles
      s.isSampled = false
    }
    val k = s.next - s.start
    if (s.receiver.isIdle || s.isSampled && timing.cycles - k <= timing.jump) {
      s.start = s.next
      s.isSampled = false
    } else if (s.isSampled) s.start -= timing.jump
    else s.start += k min timing.jump
  }

  /** Works out everything from the base on, up to cycle `end`. */
  private def workOut(end: Long): Unit = {
    work.copyFrom(base)
    var i = 0
    // Neither the level nor the time of a bit that is over matters.
    while (i < levels.size && heardFrom(from + i + 1) <= work.next) i += 1
    while (i <= levels.size) {
      val level = i == levels.size || levels(i)
      if (level != work.level) {
        val at = heardFrom(from + i) max work.next
        if (at >= end) i = levels.size
        else {
          hear(work, at)
          work.level = level
          if (!level) edge(work)
        }
      }
      i += 1
    }
    hear(work, end)
  }

  /** A frame whose header has been told turns out otherwise than it was known till now. */
  var changes: LinkBody => Unit = _ => ()

  private def renew(): Unit = {
    val old = events.slice(certain, fired)
    events.dropRightInPlace(events.size - certain)
    if (isUp) workOut(Never)
    // What has happened was the same; a frame that is being received may have other bits to come.
    val changed = old.zip(events.slice(certain, fired)).collect {
      case ((_, Header(_, body)), (_, Header(_, now))) if !body.isLike(now) =>
        body.copyFrom(now)
        body
    }
    for ((e, i) <- old.zipWithIndex) events(certain + i) = e
    changed.foreach(changes)
  }

  /** What the sender does is about to change from bit `bit` on. */
  private def changeFrom(bit: Long): Unit = {
    val isOver = isUp && work.receiver.isIdle && work.next <= heardFrom(bit) && bit >= from + levels.size
    if (isOver) {
      base.copyFrom(work)
      if (fired == events.size) {
        events.clear()
        fired = 0
      }
      certain = events.size
    }
    if (isOver || !isUp && levels.size > MostBits) {
      from = bit
      raw.clear()
      levels.clear()
      flips.filterInPlace(_ >= bit)
    }
  }

  private def resize(buffer: Levels, bit: Long): Unit = buffer.resize((bit - from).toInt)

  private def arriving(i: Int) = isDark || raw(i) != (flips.nonEmpty && flips(from + i))

  /** From bit `bit` on `tail` is sent, and recessive bits behind it. */
  def send(bit: Long, tail: Array[Boolean]): Unit = {
    changeFrom(bit)
    resize(raw, bit)
    resize(levels, bit)
    for (level <- tail) raw.add(level)
    arrive()
    renew()
  }

  private def arrive(): Unit = while (levels.size < raw.size) levels.add(arriving(levels.size))

  /** From bit `bit` on nothing arrives, or everything again. */
  def setDark(bit: Long, isDark: Boolean): Unit = {
    changeFrom(bit)
    if (raw.size < (bit - from).toInt) resize(raw, bit)
    resize(levels, bit)
    this.isDark = isDark
    arrive()
    renew()
  }

  /** Bit `bit` arrives wrong. */
  def flip(bit: Long): Unit = {
    changeFrom(bit)
    flips += bit
    val i = (bit - from).toInt
    if (raw.size <= i) resize(raw, bit + 1)
    if (levels.size <= i) resize(levels, bit + 1)
    levels(i) = arriving(i)
    renew()
  }

  /** The receiver's port comes up or goes down in cycle `at`.
    *
    * @return
    *   a frame that was being received is over
    */
  def setUp(at: Long, up: Boolean): Boolean = {
    val wasInFrame = isInFrame
    isInFrame = false
    events.clear()
    fired = 0
    certain = 0
    isUp = up
    base.restart(at)
    renew()
    wasInFrame
  }

  /** The cycle of the next event. */
  def next: Option[Long] = if (fired < events.size) Some(events(fired)._1) else None

  /** Takes the next event. */
  def take(): Event = {
    val (_, e) = events(fired)
    fired += 1
    e match {
      case _: Header => isInFrame = true
      case _: Ended  => isInFrame = false
      case _         =>
    }
    e
  }
}

object EventLink {

  /** Levels of bits in a row. */
  private final class Levels {
    private var bits = new Array[Boolean](512)
    var size         = 0

    def apply(i: Int): Boolean               = bits(i)
    def update(i: Int, level: Boolean): Unit = bits(i) = level
    def clear(): Unit                        = size = 0

    def add(level: Boolean): Unit = {
      if (size == bits.length) bits = java.util.Arrays.copyOf(bits, 2 * size)
      bits(size) = level
      size += 1
    }

    /** Cuts off, or adds recessive bits. */
    def resize(count: Int): Unit = {
      size = size min count
      while (size < count) add(true)
    }
  }

  private val Never = Long.MaxValue

  /** Bits that are kept for a port that comes up: more than a link holds. */
  private val MostBits = 4096

  /** What a receiver tells. */
  sealed trait Event {

    /** Tells it to a node. */
    def tell(listener: LinkListener): Unit = this match {
      case Starts               => listener.starts()
      case Header(header, body) => listener.header(header, body)
      case Identified           => listener.identified()
      case Ended(isGood)        => listener.ended(isGood)
      case BadHeader            => listener.badHeader()
      case BadFrame             => listener.badFrame()
    }
  }
  case object Starts                                          extends Event
  final case class Header(header: LinkHeader, body: LinkBody) extends Event
  case object Identified                                      extends Event
  final case class Ended(isGood: Boolean)                     extends Event
  case object BadHeader                                       extends Event
  case object BadFrame                                        extends Event
}

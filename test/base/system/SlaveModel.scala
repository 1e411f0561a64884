package flyframe.system

import scala.collection.mutable.ArrayBuffer
import flyframe.protocol.DetectorState._
import flyframe.protocol.{DetectorMode, SelfTest, SlaveStatus}

/** Why a record left a queue without the server having it for certain. */
sealed trait Loss

object Loss {

  /** With the supply of its slave. */
  case object Power extends Loss

  /** The queue was full: it is counted. */
  case object Dropped extends Loss

  /** The queue was full, and the master had it: if it starts anew before the server has it, its number is
    * missing.
    */
  case object Given extends Loss
}

/** Who watches slaves: the harness that judges a master must know what really happens. */
trait SlaveWatcher {

  /** Something is other than before that a master, a host or a server could see. */
  def changed(): Unit

  /** An alarm begins that nobody has silenced yet. */
  def alarmed(slave: SlaveModel): Unit
  def recorded(slave: SlaveModel, record: Record): Unit

  /** A record left the queue and is not confirmed. */
  def lost(slave: SlaveModel, record: Record, why: Loss): Unit
  def silenced(slave: SlaveModel): Unit
  def restarted(slave: SlaveModel): Unit
}

/** A smoke-alarm slave with detector, queue and host, as the rules tell (ALARM, DET); without frames. Written
  * for itself, not from the RTL and not from [[flyframe.model.AlarmModel]].
  *
  * Times are in us. It has no power at first. Its host leaves the detector on, and its reports.
  *
  * @param number
  *   for messages
  * @param listedNode
  *   node ID that its host has in its memory
  */
class SlaveModel(val number: Int, listedNode: Int, watcher: SlaveWatcher) extends BusSlave {
  import SlaveModel._

  private final class Entry(val record: Record) {
    var told = false
    var tag  = 0
    var sent = 0
  }

  private var now       = 0L
  private var power     = false
  private var poweredAt = 0L

  // The host: what it remembers, and since when it runs.
  private var node     = listedNode
  private var starts   = 0
  private var broken   = false
  private var bootTime = BootTime
  private var runsAt   = Never // the host starts, or has started, then
  private var runs     = false
  private var testedAt = Never
  private var deadAt   = 0L
  private var alias    = 0
  private var epoch    = 0
  private var selfTest = SelfTest.NotRun

  // What the line is in, and what could be seen of it.
  private var smoke    = false
  private var other    = Normal
  private var half     = 0L // 0: no contact is loose
  private var toggleAt = Never
  private var away     = false
  private var level    = Normal
  private var since    = 0L
  private var busy     = 0L // the up/down counter: 40 is a tick
  private var busyAt   = 0L
  private var above    = false
  private var state    = Off
  private var reported = Off
  private var offUntil = 0L
  private var mode     = DetectorMode.Watch
  private var modeEnd  = Never
  private var latched  = false
  private var sounding = false
  private val queue    = ArrayBuffer.empty[Entry]
  private var sequence = 1
  private var dropped  = 0

  /** Since the queue was last empty. */
  private var hasDropped = false
  private var life       = 0
  private var confirmed  = false // the master expects records
  private var frames     = 0
  private var nextAt     = Never
  private var dueAt      = Never
  private var shown      = SlaveBlock(0, 0, 0, 0, 0, 0)

  /** The state to the master has been as it is since then. */
  var shownSince = 0L

  /** Its last alarm began then. */
  var alarmedAt = 0L

  def isPowered: Boolean  = power
  def isSounding: Boolean = power && sounding
  def isLatched: Boolean  = power && latched
  def isAlarm: Boolean    = power && state == Alarm && mode == DetectorMode.Watch

  /** Smoke is there, and the slave could know it. */
  def canSound: Boolean = power && smoke && now >= offUntil && mode == DetectorMode.Watch

  /** Nothing waits, neither for the master nor for the server. */
  def isEmpty: Boolean     = queue.isEmpty
  override def status      = shown.status
  override def block       = shown
  def records: Seq[Record] = queue.map(_.record).toSeq

  // What happens to it.

  def powered(on: Boolean): Unit = if (on != power) {
    power = on
    if (on) {
      poweredAt = now
      alias = 0
      epoch = 0
      selfTest = SelfTest.NotRun
      deadAt = now
      runs = false
      testedAt = Never
      runsAt = if (broken) Never else now + bootTime
      state = Off
      reported = Off
      offUntil = now
      since = now
      clearBusy()
      mode = DetectorMode.Watch
      modeEnd = Never
      sequence = 1
      dropped = 0
      hasDropped = false
      life = 0
      confirmed = false
      frames = 0
      toggleAt = if (half > 0) now + half else Never
    } else {
      queue.foreach(e => watcher.lost(this, e.record, Loss.Power))
      queue.clear()
      latched = false
      sounding = false
      runs = false
      runsAt = Never
      state = Off
    }
    settle()
  }

  def setSmoke(on: Boolean): Unit = {
    settle()
    smoke = on
    if (half > 0) toggleAt = now + half
    setLevel()
  }

  /** A contact is loose: the line is in this state every second half period; 0 us: no more. */
  def flap(level: Int, halfPeriod: Long): Unit = {
    settle()
    other = level
    half = halfPeriod
    away = false
    toggleAt = if (half > 0) now + half else Never
    setLevel()
  }

  /** The host stops, and starts after this time; `Never`: it is dead. */
  def stopHost(startsAfter: Long): Unit = {
    if (runs) deadAt = runsAt + (now - runsAt) / BeatTime * BeatTime + AliveTime
    runs = false
    testedAt = Never
    broken = startsAfter == Never
    runsAt = if (broken || !power) Never else now + startsAfter
    settle()
  }

  /** How long its host needs for a start from now on. */
  def setBoot(us: Long): Unit = bootTime = us

  /** The host gives it another node ID, now and at later starts. */
  def rename(id: Int): Unit = {
    node = id
    if (runs) alias = id
    settle()
  }

  /** Disable or test for a time, or watch (DET-06). */
  def setMode(now: Int, seconds: Int): Unit = {
    mode = now
    modeEnd = if (now == DetectorMode.Watch) Never else this.now + seconds * 1000000L
    anew()
  }

  // Time.

  private def threshold = 40L * Debounce

  private def supplied = power && now >= offUntil

  /** What the line is in while its contact holds. */
  private def whole = if (smoke) Alarm else Normal

  private def setLevel(): Unit = {
    val next = if (half > 0 && away) other else whole
    if (next != level) {
      settle()
      level = next
      since = now
      if (busy == 0) above = false
    }
    settle()
  }

  /** Brings the up/down counter up to now. */
  private def count(): Unit = {
    if (supplied) {
      val us = now - (busyAt max offUntil)
      busy = if (level == Normal) (busy - us) max 0 else (busy + 4 * us) min threshold
    } else busy = 0
    busyAt = now
  }

  private def clearBusy(): Unit = {
    busy = 0
    busyAt = now
    above = false
  }

  /** The present state counts as a new one. */
  private def anew(): Unit = {
    state = Off
    reported = Off
    settle()
  }

  private def steadyAt = (since max offUntil) + 10L * Debounce

  /** What follows from what is seen now. */
  private def settle(): Unit = {
    count()
    if (level == Alarm || level == Short) above = true
    if (!supplied) {
      state = Off
      reported = Off
    } else {
      val steady = now >= steadyAt
      // A level that stays is no chatter: the counter has nothing to say of it.
      if (steady) clearBusy()
      val next =
        if (steady) level
        else if (busy >= threshold) { if (above) Alarm else Open }
        else state
      if (next != state) enter(next)
    }
    show()
    nextAt = next
    dueAt = if (!power) Never else if (chatters) calm else nextAt
  }

  private def enter(next: Int): Unit = {
    state = next
    if (mode == DetectorMode.Watch && state == Alarm) {
      latched = true
      sounding = true
      alarmedAt = now
      watcher.alarmed(this)
    }
    if (state != reported && state != Off && mode != DetectorMode.Disable) {
      reported = state
      val test = if (mode == DetectorMode.Test) Test else 0
      add(Record(sequence, state | test, epoch, now - poweredAt))
      sequence = if (sequence == 0xffff) 1 else sequence + 1
    }
  }

  /** When something of its own happens next. */
  private def next: Long = {
    var at = modeEnd min testedAt
    if (half > 0 && other != whole) at = at min toggleAt
    if (!runs) at = at min runsAt
    if (deadAt > now && !runs) at = at min deadAt
    if (power) {
      if (offUntil > now) at = at min offUntil
      else {
        val steady = steadyAt
        if (steady > now) {
          at = at min steady
          // Three is less than four: the time is not before the counter is there.
          if (level != Normal && busy < threshold) at = at min (now + (threshold - busy + 3) / 4)
        }
      }
    }
    at
  }

  /** What the chatter leads to is there already. */
  private def chatters =
    half > 0 && half < 10L * Debounce && supplied && other != whole &&
      state == (if (above) Alarm else Open) && busy >= threshold - half

  /** The same without the chatter. */
  private def calm: Long = {
    var at = modeEnd min testedAt
    if (!runs) at = at min runsAt
    if (deadAt > now && !runs) at = at min deadAt
    at
  }

  /** When something happens next that others could see; chatter that counts already is nothing new. */
  def due: Long = dueAt

  /** Lets time pass up to then. */
  def advance(to: Long): Unit = {
    if (power)
      while (nextAt <= to) {
        now = nextAt
        step()
      }
    now = to
  }

  private def step(): Unit = {
    if (now >= toggleAt) {
      away = !away
      toggleAt = now + half
      setLevel()
    }
    if (now >= modeEnd) setMode(DetectorMode.Watch, 0)
    if (!runs && now >= runsAt) {
      runs = true
      starts += 1
      alias = node
      epoch = 1 + (starts - 1) % 255 // 0: no start
      selfTest = SelfTest.NotRun
      testedAt = now + TestTime
    }
    if (now >= testedAt) {
      testedAt = Never
      selfTest = SelfTest.Good
    }
    settle()
  }

  private def show(): Unit = {
    import SlaveStatus.{Alarm => StatusAlarm, Open => StatusOpen, Short => StatusShort, _}
    def bit(condition: Boolean, code: Int) = if (condition) code else 0
    val watched                            = mode != DetectorMode.Disable
    val now0 =
      if (!power) SlaveBlock(0, 0, 0, 0, 0, 0)
      else
        SlaveBlock(
          bit(state == Alarm && mode == DetectorMode.Watch, StatusAlarm) |
            bit(state == Alarm && mode == DetectorMode.Test, TestAlarm) |
            bit(latched, Latched) | bit(sounding, Sounding) | bit(state == Open && watched, StatusOpen) |
            bit(state == Short && watched, StatusShort) | bit(!supplied, Unwatched) |
            bit(!runs && now >= deadAt, HostDead) | bit(!watched, Disabled) |
            bit(mode == DetectorMode.Test, Testing) | bit(queue.exists(!_.told), Waiting) |
            bit(hasDropped, Dropped) | bit(selfTest != SelfTest.Good, Unwell),
          alias,
          selfTest,
          epoch,
          dropped,
          3
        )
    if (now0 != shown) {
      if ((now0.status & ~Waiting) != (shown.status & ~Waiting) || now0.node != shown.node) shownSince = now
      shown = now0
      watcher.changed()
    }
  }

  // The queue.

  /** A record that the server may not have is thrown away. */
  private def drop(entry: Entry): Unit = {
    queue -= entry
    dropped = (dropped + 1) min 255
    hasDropped = true
    watcher.lost(this, entry.record, Loss.Dropped)
  }

  /** A full queue keeps its alarms: with a defect it does not. */
  protected[system] def keepsAlarms: Boolean = true

  private def add(record: Record): Unit = {
    watcher.recorded(this, record)
    val entry          = new Entry(record)
    val (alarms, rest) = queue.toSeq.partition(_.record.isAlarm && keepsAlarms)
    if (queue.size == Depth)
      rest.find(_.told) match {
        case Some(old) =>
          queue -= old
          watcher.lost(this, old.record, Loss.Given)
        case None =>
          rest
            .find(!_.told)
            .orElse(Option.when(record.isAlarm)(alarms.find(_.told).getOrElse(alarms.last)))
            .foreach(drop)
      }
    queue += entry
    if (queue.size > Depth) drop(entry)
    watcher.changed()
  }

  private def offer: Option[Entry] = {
    var i      = 0
    var oldest = -1
    while (i < queue.size) {
      val e = queue(i)
      if (!e.told) {
        if (e.record.isAlarm) return Some(e)
        if (oldest < 0) oldest = i
      }
      i += 1
    }
    if (oldest < 0) None else Some(queue(oldest))
  }

  override def appended(): Option[Record] = {
    frames += 1
    if (queue.isEmpty || !confirmed) None
    else
      offer.filter(e => e.record.isAlarm || e.sent < 2 || frames % 16 == 0).map { e =>
        e.sent += 1
        e.record
      }
  }

  /** Frames have passed that have not been looked at one by one. */
  def skip(count: Long): Unit = frames = (frames + count).toInt

  override def acknowledge(sequence: Int, guard: Int, tag: Int): Unit =
    for (e <- queue.find(e => !e.told && e.record.sequence == sequence && e.record.guard == guard)) {
      e.told = true
      e.tag = tag
      watcher.changed()
      show()
    }

  override def confirm(number: Int, of: Int): Unit = {
    confirmed = true
    if (of != life) {
      life = of
      queue.foreach(_.told = false)
      watcher.changed()
      show()
    } else if (queue.nonEmpty) {
      // The master keeps no more than that: with another tag its event is none any more.
      def isStored(e: Entry) = e.told && ((e.tag - number) & 0xffff) >= Outstanding
      if (queue.exists(isStored)) {
        queue.filterInPlace(!isStored(_))
        if (queue.isEmpty) hasDropped = false
        watcher.changed()
        show()
      }
    }
  }

  override def command(bits: Int): Unit = {
    if ((bits & LineOrder.Silence) != 0) {
      watcher.silenced(this)
      sounding = false
    }
    if ((bits & LineOrder.Reset) != 0) {
      watcher.restarted(this)
      latched = false
      sounding = false
      offUntil = now + 1000L * OffTime
      state = Off
      reported = Off
      clearBusy()
    }
    settle()
  }
}

object SlaveModel {
  val Never: Long = Long.MaxValue / 4

  /** In 10 us, in ms: what the registers have after reset. */
  val Debounce = 1000
  val OffTime  = 2000

  /** Records that a queue holds. */
  val Depth = 16

  /** More events than a master keeps. */
  val Outstanding = 256

  // The host, in us: its heartbeat, how long that holds, its start, and the self-test after it.
  val BeatTime  = 1000000L
  val AliveTime = 3000000L
  val BootTime  = 500000L
  val TestTime  = 200000L
}

package flyframe.system

import scala.collection.mutable
import flyframe.protocol.{EventKind, MasterStatus, SlaveStatus}

/** Knows what really happens in a system, and judges all the time what master and server make of it. The
  * first thing that is wrong ends the run.
  */
class Monitor(system: => SystemModel, note: () => Unit) extends SlaveWatcher {
  import Monitor._

  /** A record, and what became of it. */
  final class Fate(val slave: Int, val record: Record, val at: Long) {
    var loss = Option.empty[Loss]
  }

  private lazy val size = system.size

  // Since when a slave could be heard without a break; Long.MaxValue: it cannot.
  private lazy val reachable   = Array.fill(size)(Long.MaxValue)
  private lazy val offAt       = Array.fill(size)(0L)
  private lazy val unreachable = Array.fill(size)(Long.MaxValue)

  // An alarm that the master has not sounded yet.
  private lazy val unheard       = Array.fill(size)(false)
  private lazy val soundingSince = Array.fill(size)(Long.MaxValue)
  private lazy val latchedSince  = Array.fill(size)(Long.MaxValue)
  private lazy val smokeSince    = Array.fill(size)(Long.MaxValue)
  private lazy val records       = Array.fill(size)(mutable.ArrayBuffer.empty[Fate])
  // By slave: somebody pressed silence or reset last while the master knew it.
  private lazy val hushedAt = Array.fill(size)(Long.MinValue / 2)
  private lazy val endedAt  = Array.fill(size)(Long.MinValue / 2)
  // It sounded when silence was pressed, and has not been silenced since.
  private lazy val isMeant = Array.fill(size)(false)
  private var silencedAt   = Long.MinValue / 2
  private var resetAt      = Long.MinValue / 2
  private var disturbedAt  = Long.MinValue / 2 // somebody came, or went
  private var undone       = false             // while silence was carried: it may have been given up
  private var resetUndone  = false             // the same for a reset
  private var owed         = Long.MaxValue     // an alarm was silenced by an order for others
  private var fresh        = false             // when silence was pressed there was an alarm not heard yet
  private var noisyAt      = Long.MinValue / 2 // frames were broken: slaves may have been taken for absent
  private var heardAt      = Long.MinValue / 2
  private var latchedAt    = 0L                // some slave was then, last
  private var soundingAt   = 0L
  private var masterAt     = 0L
  private var serverAt     = 0L
  private var serverUp     = true
  private var forged       = 0.0
  private var sounded      = false
  private var fired        = false
  private var lookedAt     = 0L

  /** Alarms of slaves, and the longest time from one that could be heard to the sounder, in us. */
  var alarms         = 0L
  var longestToSound = 0L

  /** Faults begin then, and are shown then first, in us. */
  var faultFrom    = Long.MaxValue
  var faultShownAt = Long.MaxValue

  private def wrong(what: String): Nothing = throw new Violation(f"${system.now / 1e6}%.3f s: $what")

  override def changed(): Unit = note()

  override def alarmed(s: SlaveModel): Unit = {
    alarms += 1
    unheard(s.number) = true
  }

  override def recorded(s: SlaveModel, r: Record): Unit =
    records(s.number) += new Fate(s.number, r, system.now)

  override def lost(s: SlaveModel, r: Record, why: Loss): Unit = {
    if (why == Loss.Dropped && r.isAlarm && s.records.exists(!_.isAlarm))
      wrong(s"slave ${s.number}: a full queue refuses $r")
    records(s.number).reverseIterator.find(_.record eq r).foreach(_.loss = Some(why))
  }

  override def silenced(s: SlaveModel): Unit = {
    if (s.isSounding && s.alarmedAt > hushedAt(s.number) + Carry) {
      if (!isShifted) wrong(s"slave ${s.number}: an order of before silenced its new alarm")
      if (unheard(s.number)) owed = system.now
    }
    if (s.isSounding && !isMeant(s.number) && !undone)
      wrong(s"slave ${s.number}: an order silenced an alarm that began later")
    isMeant(s.number) = false
    unheard(s.number) = false
  }

  /** Whoever comes back behind a cut of a ring has the position of another one in the frames on their way.
    * That one has not got the order then, so the master must sound.
    */
  private def isShifted = system.line.ring && disturbedAt > system.now - Notice

  override def restarted(s: SlaveModel): Unit =
    if (s.isLatched && s.alarmedAt > endedAt(s.number) + Carry && !isShifted)
      wrong(s"slave ${s.number}: a reset of before ended its new alarm")

  def silencePressed(): Unit = {
    silencedAt = system.now
    undone = isDisturbed
    fresh = (0 until size).exists(i => unheard(i) && reachable(i) != Long.MaxValue)
    for (s <- system.slaves) isMeant(s.number) = s.isSounding
    pressed(hushedAt)
  }
  def resetPressed(): Unit = {
    resetAt = system.now
    resetUndone = isDisturbed
    pressed(endedAt)
    silencePressed()
  }
  private def pressed(times: Array[Long]): Unit =
    for (i <- 0 until size if reachable(i) != Long.MaxValue || unreachable(i) > system.now - Notice)
      times(i) = system.now
  def masterStopped(): Unit = reachChanged()
  def masterStarted(): Unit = {
    masterAt = system.now
    sounded = false
    fired = false
    heardAt = Long.MinValue / 2
    owed = Long.MaxValue
    disturbed()
    reachChanged()
  }
  def serverChanged(state: ServerState): Unit = {
    serverUp = state != ServerState.Down && state != ServerState.Refuses
    serverAt = system.now
  }
  def forgedChanged(share: Double): Unit = {
    forged = share
    serverAt = system.now
  }

  /** A cable, a supply, a place on the line will be another one: positions may change, and orders be given
    * up.
    */
  def disturbed(): Unit = {
    disturbedAt = system.now
    if (silencedAt > system.now - Second) undone = true
    if (resetAt > system.now - Second) resetUndone = true
  }
  private def isDisturbed =
    disturbedAt > system.now - Second || system.line.isNoisy || reachable.forall(_ == Long.MaxValue)

  /** A cable, a supply, a place on the line is another one. */
  def reachChanged(): Unit = if (system.line != null)
    for ((s, p) <- system.line.slaves.zipWithIndex) {
      val now = system.master.nonEmpty && s.isPowered && system.line.reaches(p)
      if (!now) reachable(s.number) = Long.MaxValue
      else if (reachable(s.number) == Long.MaxValue) reachable(s.number) = system.now
      if (!s.isPowered) offAt(s.number) = system.now
      val gone = !(s.isPowered && system.line.reaches(p))
      unreachable(s.number) = since(gone, unreachable(s.number), system.now)
    }

  /** Slaves are in other places. */
  def moved(): Unit = {
    moves = true
    for (i <- 0 until size) {
      reachable(i) = Long.MaxValue
      unreachable(i) = Long.MaxValue
    }
  }

  private def since(condition: Boolean, before: Long, now: Long) =
    if (!condition) Long.MaxValue else if (before == Long.MaxValue) now else before

  /** After a cycle of the bus. */
  def cycled(): Unit = for (m <- system.master) {
    val now = system.now
    if (m.sounding) {
      owed = Long.MaxValue
      for (i <- 0 until size if unheard(i) && reachable(i) != Long.MaxValue && system.slaves(i).isSounding) {
        unheard(i) = false
        heardAt = now
        longestToSound = longestToSound max (now - (reachable(i) max system.slaves(i).alarmedAt))
      }
      if (!sounded && !system.slaves.exists(s => s.isSounding) && now > silencedAt + Carry)
        wrong("the master sounds, and no slave does")
    } else if (sounded && heardAt > silencedAt && heardAt > resetAt)
      wrong("the sounder ends, and nobody has silenced it")
    if (m.fire) {
      if (!fired && !system.slaves.exists(s => s.isLatched || s.isAlarm) && !isShifted)
        wrong("fire without an alarm")
    } else if (fired && heardAt > resetAt) wrong("fire ends without a reset")
    sounded = m.sounding
    fired = m.fire
  }

  /** Nothing has changed up to `now`: does anything last for too long? */
  def look(now: Long): Unit = {
    for (s <- system.slaves) {
      val i = s.number
      soundingSince(i) = since(s.isSounding, soundingSince(i), system.now)
      latchedSince(i) = since(s.isLatched, latchedSince(i), system.now)
      smokeSince(i) = since(s.canSound, smokeSince(i), system.now)
      if (smokeSince(i) < now - Second && !s.isLatched) wrong(s"slave $i is in smoke and does nothing")
      val reach = reachable(i)
      if (reach != Long.MaxValue) for (m <- system.master) {
        if (unheard(i) && s.isSounding && (reach max s.alarmedAt) < now - Second && !m.sounding)
          wrong(s"the alarm of slave $i is not heard")
        if ((soundingSince(i) max reach) < now - Second && silencedAt < now - Carry && !m.sounding)
          wrong(s"slave $i sounds, and the master does not")
        if ((latchedSince(i) max reach) < now - Second && resetAt < now - Carry && !m.fire)
          wrong(s"slave $i has an alarm, and the master no fire")
        if (
          s.isSounding && silencedAt < now - Carry && silencedAt > (reach max s.alarmedAt) + Second &&
          silencedAt >= masterAt + Second && !undone
        )
          wrong(s"slave $i sounds after silence")
      }
    }
    if (owed < now - Second) wrong("the master does not sound for an alarm that it has silenced")
    if (system.line.isNoisy) noisyAt = now
    if (system.slaves.exists(_.isSounding)) soundingAt = now
    for (m <- system.master if m.sounding && silencedAt < now - Carry && silencedAt > masterAt)
      if (heardAt < silencedAt && soundingAt < silencedAt + Second && !fresh && !undone)
        wrong("the master sounds after silence")
    if (system.slaves.exists(s => s.isLatched || s.isAlarm)) latchedAt = now
    val hadTime = resetAt < now - ResetTime && !resetUndone && latchedAt < resetAt + Second
    if (hadTime && system.master.exists(_.fire) && resetAt > masterAt) wrong("fire stays after a reset")
    if (
      faultShownAt == Long.MaxValue && system.now >= faultFrom &&
      (system.master.exists(m => (m.status & MasterStatus.Faults) != 0) || system.server.notices.nonEmpty)
    ) faultShownAt = now
    if (now - lookedAt >= PictureStep) {
      lookedAt = now
      lookAtPicture(now)
    }
  }

  /** What the page shows is right, as soon as the server can know it. */
  private def lookAtPicture(now: Long): Unit = if (serverUp && system.master.nonEmpty) {
    val bound = if (forged > 0) PictureForged else PictureTime
    val known = now - bound
    if (serverAt < known && masterAt < known) {
      val picture = system.server.picture.getOrElse(wrong("the page is empty"))
      for ((s, p) <- system.line.slaves.zipWithIndex) {
        val told     = picture.lift(p).getOrElse(ReportedSlave(SlaveStatus.Absent, 0))
        val flickers = noisyAt >= known && (told.status & SlaveStatus.Absent) != 0
        if (reachable(s.number) < known && s.shownSince < known && !flickers) {
          val other = (told.status ^ s.status) & ~(SlaveStatus.Waiting | SlaveStatus.Wrong)
          if (other != 0 || told.node != s.block.node)
            wrong(
              f"the page shows slave ${s.number} as ${told.status}%04x ${told.node}, it is ${s.status}%04x"
            )
          val isWrong = s.block.node != system.nodes(p)
          if (isWrong != ((told.status & SlaveStatus.Wrong) != 0))
            wrong(s"slave ${s.number} at $p: wrong is shown as ${!isWrong}")
        }
        if (unreachable(s.number) < known && (told.status & SlaveStatus.Absent) == 0)
          wrong(s"the page shows slave ${s.number}, which nobody reaches")
      }
    }
  }

  /** Most records that each slave has told to have dropped, by node ID: as far as the log knows. */
  private val droppedOf = mutable.Map.empty[Int, Long]

  /** The log has each record once, or the server knows that records are missing. */
  def lookAtLog(): Unit = {
    val log = system.server.log
    for (e <- log if e.kind == EventKind.Slave)
      droppedOf(e.node) = droppedOf.getOrElse(e.node, 0L) max (e.slaveTime >> 8)
    val found =
      log.filter(_.kind == EventKind.Detector).groupBy(e => (e.epoch, e.sequence, e.slaveTime, e.state))
    // A number behind it shows that a record is missing.
    val told = log.filter(_.kind == EventKind.Detector).groupBy(_.node)
    def later(node: Int, r: Record) =
      told.getOrElse(node, Nil).exists(e => e.slaveTime > r.time && e.sequence > r.sequence)
    for (s <- system.slaves) {
      val own     = system.nodes(s.number)
      val mine    = records(s.number).groupBy(_.record)
      var missing = 0
      for (f <- records(s.number) if !s.records.exists(_ eq f.record)) {
        val r = f.record
        // Before its host has started a slave has no node ID.
        val copies = found
          .getOrElse((r.epoch, r.sequence, r.time, r.state), Nil)
          .filter(e => moves || e.node == own || e.node == 0 && e.position == s.number)
        // Without a host the same slave begins with the same at each power-up: each of them counts.
        if (!moves && copies.size > 1 && r.epoch != 0)
          wrong(s"$r of slave ${s.number} is in the log ${copies.size} times")
        val kept = mine(r).count(o => o.loss.isEmpty && !s.records.exists(_ eq o.record))
        if (!moves && copies.nonEmpty && copies.size < kept)
          wrong(s"$r of slave ${s.number} is not in the log $kept times")
        if (copies.isEmpty) {
          if (mine(r).exists(_.loss.contains(Loss.Power))) lostByPower += 1
          else if (f.loss.contains(Loss.Dropped)) missing += 1
          // Its master and its slave have both started anew before a server took it.
          else if (f.loss.nonEmpty && offAt(s.number) > f.at) lostByPower += 1
          else if (f.loss.isEmpty || !later(own, r))
            wrong(s"$r of slave ${s.number} is not in the log (${f.loss})")
        }
      }
      if (missing > 0 && !moves && !Seq(own, 0).exists(droppedOf.getOrElse(_, 0L) >= (missing min 255)))
        wrong(s"slave ${s.number} has dropped $missing records, and the log counts ${droppedOf.get(own)}")
    }
  }

  /** Records that were lost with the supply of their slave. */
  var lostByPower = 0

  /** What has been looked at is forgotten. */
  def forget(): Unit = {
    records.foreach(_.clear())
    moves = false
  }

  /** Slaves have had other node IDs than their own. */
  var moves = false

  /** Everything works again. */
  def lookIsNormal(): Unit = {
    val m      = system.master.getOrElse(wrong("there is no master"))
    val faults = m.status & MasterStatus.Faults
    if (faults != 0) wrong(f"the faults $faults%05x stay")
    val notices = system.server.notices & Set("log", "refused", "frames lost")
    if (notices.nonEmpty) wrong(s"the page still shows $notices")
    if (m.fire || m.sounding) wrong(s"fire ${m.fire}, sounder ${m.sounding} stay")
    if (m.waiting > 0) wrong(s"${m.waiting} events wait for ever")
    for (s <- system.slaves) {
      if (s.status != 0) wrong(f"slave ${s.number} stays ${s.status}%04x")
      if (!s.isEmpty) wrong(s"slave ${s.number} keeps ${s.records}")
    }
  }
}

object Monitor {

  // Bounds in us: alarm to sounder; an order to all slaves; to notice who is there; a state to the page.
  val Second        = 1000000L
  val Carry         = 3000000L
  val Notice        = 50000L
  val ResetTime     = 3000000L
  val FaultTime     = 100000000L
  val PictureTime   = 3000000L
  val PictureForged = 25000000L
  val PictureStep   = 250000L

  /** What a monitor has found. */
  final class Violation(what: String) extends Exception(what)
}

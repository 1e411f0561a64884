package flyframe.system

import scala.collection.mutable
import scala.util.Random
import flyframe.protocol._

/** A server as a master and an operator see it. */
trait AlarmServer {

  /** A report has come, with a right tag or not. */
  def report(report: Report, genuine: Boolean, at: Long): Unit

  /** Time has passed; called at least every `SystemModel.Tick`. */
  def tick(at: Long): Unit

  /** What it has answered since this was asked last. */
  def answers(): Seq[Answer]

  /** What the page shows of a line: states of slaves by position; none: it knows nothing of this start. */
  def picture: Option[Seq[ReportedSlave]]

  /** Events of the log, in order. */
  def log: Seq[Event]

  /** What the page shows as wrong. */
  def notices: Set[String]

  /** Faults of the server begin and end. */
  def set(state: ServerState): Unit

  /** An order of somebody at the page. */
  def order(kind: Int): Unit
}

/** How a server is. */
sealed trait ServerState

object ServerState {
  case object Works    extends ServerState
  case object Down     extends ServerState
  case object Refuses  extends ServerState
  case object Locked   extends ServerState
  case object DiskFull extends ServerState
}

/** The server, from the contract: states make the picture, events the log. */
class ServerModel(random: Random, changed: () => Unit) extends AlarmServer {
  import ServerModel._
  import ServerState._

  private var state: ServerState = Works
  private var life               = random.nextLong()

  // On the disk.
  private val stored = mutable.LinkedHashMap.empty[(Long, Int), Event]
  private val wanted = mutable.Map.empty[Long, Int]

  /** Records that are stored: a master that starts anew, or had lost a slave, reports again what it cannot
    * know. Epoch 0 is no name of a start: before its host runs, a slave tells the same after each power-up.
    */
  private val records = mutable.Set.empty[(Int, Int, Int, Int, Int, Long)]

  // In memory.
  private var counters   = Map.empty[Long, Int]
  private val begins     = mutable.Map.empty[Long, Int]
  private var current    = Option.empty[Long]
  private var seen       = Option.empty[Seq[ReportedSlave]]
  private var refused    = 0
  private val shown      = mutable.Set.empty[String]
  private var tickets    = 1
  private var ordered    = Option.empty[Ordered]
  private var now        = 0L
  private var lostAt     = 0L
  private var lostBefore = 0
  private var lostLife   = Option.empty[Long]

  override def picture: Option[Seq[ReportedSlave]] = seen
  override def log: Seq[Event]                     = stored.values.toSeq
  override def notices: Set[String]                = shown.toSet

  override def set(next: ServerState): Unit = {
    // A server that starts is another one, and its memory is empty.
    if (state == Down && next != Down) {
      life = random.nextLong()
      counters = Map.empty
      begins.clear()
      current = None
      seen = None
      ordered = None
    }
    state = next
    if (writable) shown -= "log"
    if (state != Refuses) shown -= "refused"
    changed()
  }

  private def writable = state == Works || state == Refuses

  /** The log is put away; what is wanted next stays. */
  def putAway(): Unit = {
    stored.clear()
    records.clear()
    shown.clear()
  }

  override def order(kind: Int): Unit = if (state == Works) {
    ordered = Some(Ordered(tickets, kind, burning(seen.getOrElse(Nil), kind), now + OrderTime))
    tickets += 1
  }

  /** Slaves that an order would concern: it is for those that were shown, not for a new alarm. */
  private def burning(slaves: Seq[ReportedSlave], kind: Int): Set[Int] = {
    import SlaveStatus._
    val bits = if (kind == Order.Silence) Sounding else Alarm | Latched
    slaves.indices.filter(i => (slaves(i).status & bits) != 0).toSet
  }

  private val sent = mutable.Buffer.empty[Answer]

  override def answers(): Seq[Answer] = {
    val all = sent.toList
    sent.clear()
    all
  }

  override def tick(at: Long): Unit = now = at

  override def report(r: Report, genuine: Boolean, at: Long): Unit = {
    now = at
    sent ++= answered(r, genuine)
  }

  private def answered(r: Report, genuine: Boolean): Option[Answer] =
    state match {
      case Down => None
      case _ if !genuine =>
        shown += "forged"
        None
      case Refuses =>
        shown += "refused"
        Some(Answer(genuine = false, r.life, life, r.counter, r.number))
      case _ if r.server != life => Some(Answer(genuine = true, r.life, life, r.counter, r.number))
      case _ if counters.get(r.life).exists(_ >= r.counter) =>
        None
      case _ if current.exists(_ != r.life) && counters.contains(r.life) =>
        None // an older life
      case _ =>
        if (current.exists(_ != r.life)) shown += "master restarted"
        if (!current.contains(r.life)) {
          refused = 0
          ordered = None
        }
        current = Some(r.life)
        counters += r.life -> r.counter
        if (!seen.contains(r.slaves)) {
          seen = Some(r.slaves)
          changed()
        }
        lookAtLost(r)
        if (r.refused > refused) shown += "forged"
        refused = r.refused
        val next = wanted.getOrElse(r.life, begins.getOrElseUpdate(r.life, r.number))
        if (writable) store(r, next) else shown += "log"
        val number = wanted.getOrElse(r.life, next)
        ordered = ordered.filter(o => o.until > now && (burning(r.slaves, o.kind) -- o.shown).isEmpty)
        val (ticket, order) = ordered.fold((0, Order.None))(o => (o.ticket, o.kind))
        Some(Answer(genuine = true, r.life, life, r.counter, number, trouble = !writable, ticket, order))
    }

  /** Some frames are lost at each cut; a bad cable loses them all the time. */
  private def lookAtLost(r: Report): Unit = {
    if (!lostLife.contains(r.life)) lostBefore = r.lost // it counts anew
    lostLife = Some(r.life)
    if (now - lostAt >= LostTime) {
      if (((r.lost - lostBefore) & 0xffff) >= LostMost) shown += "frames lost" else shown -= "frames lost"
      lostBefore = r.lost
      lostAt = now
    }
  }

  private def store(r: Report, next: Int): Unit = {
    for ((e, i) <- r.events.zipWithIndex if r.number + i >= next) {
      val isNew = e.kind != EventKind.Detector || e.epoch == 0 ||
        records.add((e.position, e.node, e.epoch, e.sequence, e.state, e.slaveTime))
      if (isNew || doubles) stored((r.life, r.number + i)) = e
      if (e.kind == EventKind.Command) ordered = ordered.filter(o => (o.ticket & 0xffff) != e.sequence)
    }
    val end = r.number + r.events.size
    if (end > next || !wanted.contains(r.life)) {
      wanted(r.life) = end max next
      changed()
    }
  }

  /** Records that come again in another life of the master are stored again. */
  protected[system] def doubles: Boolean = false
}

object ServerModel {

  private final case class Ordered(ticket: Int, kind: Int, shown: Set[Int], until: Long)

  /** An order that nobody has taken for so long, in us, is no order any more. */
  val OrderTime = 5000000L

  /** Frames lost in a time in us that are shown. */
  val LostMost = 50
  val LostTime = 20000000L
}

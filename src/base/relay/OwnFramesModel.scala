package flyframe.relay

import scala.collection.mutable.ArrayBuffer

/** A frame of the own node that is not confirmed yet.
  *
  * @param slot
  *   where it stands; none for the start of a life
  */
final class Flight(val slot: Option[Int], val kind: Int, val sequence: Int, val order: Long, val word: Int) {
  import Flight._

  /** How it is with the copies of the two ports. */
  val copies: Array[Int] = Array(NotSent, NotSent)

  /** The unit in which its last copy began, after how many units it is to be repeated, and how often it was.
    */
  var begun: Long          = 0
  var patience: Long       = 0
  var repeats: Int         = 0
  var isAborted: Boolean   = false // the host wants it no more: it is not repeated
  var isConfirmed: Boolean = false // it is done when no copy is being sent any more (RB-24)

  /** What happened to its copies since they were looked at last: the port went down, or came up; the other
    * one began when the time of this one was over.
    */
  val wentDown: Array[Boolean] = Array(false, false)
  val cameUp: Array[Boolean]   = Array(false, false)
  val isOld: Array[Boolean]    = Array(false, false)

  def isWaiting: Boolean = copies.contains(Waits)

  /** FR-57 for copies that came back where they left. */
  def isHome: Boolean = copies.contains(Home) && !copies.exists(c => c == Waits || c == Sent)
}

object Flight {
  val NotSent = 0 // the port was down
  val Waits   = 1
  val Sent    = 2
  val Home    = 3 // it came back by the port by which it left
  val Gone    = 4 // the port has gone down since
}

/** What own frames need of their node. */
trait OwnHost {
  def slots: RelaySlotsModel

  /** Units of 10 us since reset; `confirmUs` in such units. */
  def unit: Long
  def confirm: Int
  def retries: Int
  def isOneShot: Boolean
  def isUp(port: Int): Boolean

  /** A copy is being sent. */
  def isSending(flight: Flight): Boolean
  def counts(counter: Int): Unit

  /** Counts a frame that begins with the coming bit (RB-25). */
  def leaves(counter: Int): Unit
  def lifeSettled(): Unit // the start of a life was confirmed or has failed
}

/** Sequences, copies, confirming and repeating (FR-55 to FR-58). */
class OwnFramesModel(host: OwnHost) {
  import Flight._
  import OwnFramesModel._
  private val flights = ArrayBuffer.empty[Flight] // in the order of their sequences
  private var next    = 0

  /** No data frame has been sent since the start. */
  private var isFresh = true

  /** A new life: sequences begin anew; frames that were on their way fail by [[fail]] (RB-13). */
  def restart(): Unit = {
    next = 0
    isFresh = true
  }

  /** Nothing is on its way any more. */
  def drop(): Unit = flights.clear()

  def isEmpty: Boolean = flights.isEmpty

  /** Frames on their way. */
  def size: Int = flights.size

  /** FR-62: a sequence ahead of the newest sent (RB-14). */
  def isAhead(sequence: Int): Boolean = !isFresh && {
    val distance = sequence - next + 1 & SequenceMask
    distance > 0 && distance < Ahead
  }

  /** The life whose start was made last (RB-30). */
  var life: Int = 0

  /** The start of a life is made. */
  def announce(life: Int): Unit = {
    this.life = life
    val f = new Flight(None, LinkKind.Start, life, 0, 0)
    wait(f)
    flights += f
  }

  private def wait(f: Flight): Unit =
    for (port <- 0 to 1) f.copies(port) = if (host.isUp(port)) Waits else NotSent

  private def mayBegin =
    flights.isEmpty || ((next - flights.head.sequence & SequenceMask) < Window && flights.head.slot.nonEmpty)

  private def fresh: Option[Int] =
    if (!mayBegin) None else host.slots.next(w => flights.exists(f => isSame(f.word, w)))

  /** The identifier is the same, whatever the kind of frame. */
  private def isSame(word: Int, other: Int) = ((word ^ other) & ~(1 << 30)) == 0

  private def waiting(port: Int): Option[Flight] =
    if (flights.isEmpty) None
    else flights.filter(f => f.copies(port) == Waits && !f.isConfirmed).minByOption(_.order)

  /** The order of the own frame that would leave by a port.
    *
    * @param data
    *   data frames may begin
    */
  def order(port: Int, data: Boolean): Option[Long] =
    (waiting(port).map(_.order) ++ (if (data) fresh.map(host.slots.pendingFrame(_).order)
                                    else None)).minOption

  /** The frame that [[order]] tells begins at a port. */
  def begin(port: Int, data: Boolean): Flight = {
    val old  = waiting(port)
    val slot = if (data) fresh else None
    val isNew = slot.exists { s =>
      old.forall(host.slots.pendingFrame(s).order < _.order)
    }
    val flight = if (isNew) create(slot.get) else old.get
    flight.isOld(1 - port) = dueOf(flight) <= host.unit
    flight.copies(port) = Sent
    flight.begun = host.unit
    flight.patience = host.confirm.toLong << (flight.repeats min MostDoublings)
    flight
  }

  private def create(slot: Int): Flight = {
    val frame = host.slots.pendingFrame(slot)
    val f     = new Flight(Some(slot), LinkKind.Data, next, frame.order, frame.word)
    host.slots.begins(slot)
    next = next + 1 & SequenceMask
    isFresh = false
    wait(f)
    flights += f
    host.leaves(RelayCounter.OwnSent)
    f
  }

  /** A copy has come home. */
  def home(header: LinkHeader, port: Int): Unit =
    for (f <- flights.find(f => f.kind == header.kind && f.sequence == header.sequence)) {
      if (port != header.direction) f.isConfirmed = true
      else if (f.copies(port) == Sent) f.copies(port) = Home
    }

  /** A port has gone down. */
  def portDown(port: Int): Unit = for (f <- flights if f.copies(port) != NotSent) {
    f.copies(port) = Gone
    f.wentDown(port) = true
  }

  /** A port has come up. */
  def portUp(port: Int): Unit = for (f <- flights) f.cameUp(port) = true

  /** At the end of a bit: what does not hold any more of what is known of copies (RB-29). */
  def forget(): Unit = for (f <- flights) {
    if (!f.isConfirmed) for (port <- 0 to 1) {
      if (f.copies(port) == Home && (f.isOld(port) || (f.wentDown(1 - port) && dueOf(f) <= host.unit)))
        again(f, port)
      if (f.cameUp(port) && (f.copies(port) == Gone || f.copies(port) == NotSent)) f.copies(port) = Waits
    }
    for (flags <- Seq(f.wentDown, f.cameUp, f.isOld); port <- 0 to 1) flags(port) = false
  }

  /** A copy that has come home goes again, as a repeat; without one its time runs. */
  private def again(f: Flight, port: Int): Unit =
    if (isUseless(f)) f.copies(port) = Sent
    else {
      f.copies(port) = Waits
      f.repeats += 1
      host.counts(RelayCounter.Repeated)
    }

  private def isUseless(f: Flight) = f.isAborted || host.isOneShot || f.repeats >= host.retries

  private def idle = flights.toSeq.filterNot(host.isSending)

  /** Frames that are confirmed are done. */
  def settle(): Unit = {
    for (f <- flights) f.isConfirmed |= f.isHome
    idle.filter(_.isConfirmed).foreach(ends(_, isSent = true))
  }

  /** Frames on their way fail. */
  def fail(): Unit = idle.foreach(ends(_, isSent = false))

  /** The unit in which something is to be repeated next; none while a copy has not even begun. */
  def due: Option[Long] = flights.filterNot(f => f.isWaiting || f.isConfirmed).map(dueOf).minOption

  private def dueOf(f: Flight) = f.begun + f.patience + 1

  /** Something is done as soon as no copy is being sent. */
  def isSettling: Boolean = flights.exists(f => f.isConfirmed || f.isHome)

  /** Repeats what is due (FR-58). */
  def pass(): Unit =
    if (flights.nonEmpty) for (f <- idle if !f.isConfirmed && !f.isWaiting && dueOf(f) <= host.unit) {
      if (isUseless(f)) ends(f, isSent = false)
      else {
        f.repeats += 1
        wait(f)
        host.counts(RelayCounter.Repeated)
      }
    }

  /** The host wants slots no more. */
  def abort(map: Int): Unit =
    for (f <- flights if f.slot.exists(s => (map >> s & 1) == 1)) f.isAborted = true

  private def ends(f: Flight, isSent: Boolean): Unit = {
    flights -= f
    f.slot match {
      case Some(s) =>
        host.slots.ends(s, isSent)
        host.counts(if (isSent) RelayCounter.Confirmed else RelayCounter.Failed)
      case None => host.lifeSettled()
    }
  }
}

object OwnFramesModel {
  val Window                = 16
  val SequenceMask          = 0x3fff
  private val Ahead         = 8192
  private val MostDoublings = 4
}

/** Kinds of link frames. */
object LinkKind {
  val Data  = 0
  val Start = 1
}

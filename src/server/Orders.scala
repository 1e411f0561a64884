package flyframe.server

import java.time.Instant
import scala.collection.immutable.Queue
import flyframe.protocol.{CommandResult, EventKind, Order}

/** An order for a slave, or for all: what the master is asked at a time.
  *
  * @param id
  *   counts the orders of the page to a master since the start of the server; the same for all slaves of a
  *   zone
  * @param number
  *   the ticket by which the master knows it, never 0
  * @param askedMs
  *   when the page asked for it, monotonic; `asked`: the same as a time of day
  * @param sentMs
  *   when the first answer with it left, monotonic
  * @param about
  *   positions of the slaves that it is about: those that the page showed sounding (silence), or in alarm or
  *   latched (reset). It must not meet an alarm that nobody has seen. None: no matter
  * @param zone
  *   it is a part of an order for this zone
  */
final case class Ticket(
    id: Int,
    number: Long,
    order: Int,
    node: Int,
    seconds: Int,
    askedMs: Long,
    asked: Instant,
    about: Option[Set[Int]] = None,
    zone: Option[String] = None,
    sentMs: Option[Long] = None,
    outcome: Option[Either[String, Unit]] = None
)

/** An order of the page: a ticket, or one for each slave of a zone (SRV-25). */
final case class Request(tickets: Seq[Ticket]) {
  private def first = tickets.head

  def id: Int              = first.id
  def zone: Option[String] = first.zone
  def isSent: Boolean      = tickets.exists(_.sentMs.nonEmpty)
  private def ended: Int   = tickets.count(_.outcome.nonEmpty)
  private def isEnded      = ended == tickets.size
  private def failed       = tickets.flatMap(t => t.outcome.flatMap(_.left.toOption).map(t.node -> _))

  /** What became of it as a whole; None: not all slaves have been asked. */
  def outcome: Option[Either[String, Unit]] =
    if (zone.isEmpty) first.outcome else Option.when(isEnded)(Either.cond(failed.isEmpty, (), reason))

  /** Of which slaves of a zone it has failed, by reasons. */
  private def reason: String = {
    val reasons = failed.map(_._2).distinct.map { why =>
      s"${failed.collect { case (node, `why`) => s"ID $node" }.mkString(", ")}: $why"
    }
    (reasons :+ s"done at ${tickets.size - failed.size} of ${tickets.size}").mkString("; ")
  }

  /** How many slaves of a zone have been asked, before the end. */
  def progress: Option[String] =
    Option.when(zone.nonEmpty && !isEnded)(s"$ended of ${tickets.size} slaves")

  /** In words. */
  def text: String = EventText.order(first.order, first.node, first.seconds, zone)
}

/** The orders to one master (SRV-13, SRV-14, SRV-25): one after the other, since its mailbox holds one. An
  * order rides on every answer until the master has told what became of it.
  *
  * @param timeoutMs
  *   after which an order has failed
  * @param nextNumber
  *   a ticket that is not used twice
  */
final class Orders(timeoutMs: Int, nextNumber: () => Long) {
  import Orders._
  private var tickets = Queue.empty[Ticket]          // of the last orders, finished or not
  private var counted = 0
  private var begunMs = Option.empty[(Ticket, Long)] // the current one as it began, and when
  private var ended   = Queue.empty[Request]

  /** The last orders. */
  def all: Seq[Ticket] = tickets

  /** The order that rides on answers now. */
  def current: Option[Ticket] = Orders.current(tickets)

  /** Orders for zones that have ended since this was asked last, or were told to be done later. */
  def takeEnded(): Seq[Request] = {
    val all = ended
    ended = Queue.empty
    all
  }

  /** Puts an order behind the others; Left: why not. */
  def add(
      order: Int,
      node: Int,
      seconds: Int,
      nowMs: Long,
      now: Instant,
      about: Option[Set[Int]] = None
  ): Either[String, Request] =
    queue(id => Seq(Ticket(id, nextNumber(), order, node, seconds, nowMs, now, about)), nowMs)

  /** Puts an order for the slaves of a zone behind the others; Left: why not.
    *
    * @param doubled
    *   node IDs of several slaves: they are not asked
    */
  def addZone(
      order: Int,
      zone: String,
      nodes: Seq[Int],
      doubled: Set[Int],
      seconds: Int,
      nowMs: Long,
      now: Instant
  ): Either[String, Request] =
    queue(
      id => nodes.map(Ticket(id, nextNumber(), order, _, seconds, nowMs, now, zone = Some(zone))),
      nowMs
    ).map { request =>
      update(t => t.id == request.id && doubled(t.node))(_.copy(outcome = Some(Left("several have this ID"))))
      request
    }

  private def queue(make: Int => Seq[Ticket], nowMs: Long): Either[String, Request] =
    if (tickets.filter(_.outcome.isEmpty).map(_.id).distinct.size >= MostWaiting)
      Left("Too many orders are waiting.")
    else {
      counted += 1
      val request = Request(make(counted))
      val all     = tickets ++ request.tickets
      val kept    = all.map(_.id).distinct.takeRight(MostShown).toSet
      tickets = all.filter(t => kept(t.id))
      tick(nowMs)
      Right(request)
    }

  /** The order for the answer to a report; none while the report tells an alarm that the order is not about.
    *
    * @param concerned
    *   positions of slaves that an order would meet
    */
  def ride(nowMs: Long, concerned: Ticket => Set[Int] = _ => Set.empty): Option[Ticket] = {
    tick(nowMs)
    def isNew(t: Ticket) = t.about.exists(about => !concerned(t).subsetOf(about))
    current match {
      case Some(t) if isNew(t) && nowMs - t.askedMs > NewAlarmMs =>
        end(t, "not done: a new alarm")
        ride(nowMs, concerned)
      case Some(t) if isNew(t) => None
      case Some(t) =>
        if (t.sentMs.isEmpty) update(isSame(t))(_.copy(sentMs = Some(nowMs)))
        current
      case None => None
    }
  }

  /** Gives up what has lasted too long; true if something has. */
  def tick(nowMs: Long): Boolean = current match {
    case Some(t) if !begunMs.exists(b => isSame(t)(b._1)) =>
      begunMs = Some((t, nowMs))
      false
    case Some(t) if nowMs - t.sentMs.getOrElse(begunMs.get._2) > timeoutMs =>
      if (t.sentMs.nonEmpty) end(t, "the master has not told a result")
      // So it would be with the other slaves of a zone.
      else update(o => o.id == t.id && o.outcome.isEmpty)(_.copy(outcome = Some(Left("no report has come"))))
      tick(nowMs)
      true
    case _ => false
  }

  /** The master has told something; it may be about an order, also about one that was given up. */
  def told(event: Event): Unit = if (event.kind == EventKind.Command)
    tickets
      .find(t =>
        t.sentMs.nonEmpty && t.order == event.position && t.node == event.node &&
          (t.number & 0xffff) == event.sequence
      )
      .foreach { t =>
        val outcome = Either.cond(event.state == CommandResult.Done, (), EventText.result(event.state))
        update(isSame(t))(_.copy(outcome = Some(outcome)))
      }

  /** The master has another life: what waits will not be answered. */
  def abandon(): Unit =
    update(_.outcome.isEmpty)(_.copy(outcome = Some(Left("the master has restarted"))))

  private def isSame(ticket: Ticket)(other: Ticket) = other.id == ticket.id && other.node == ticket.node

  private def end(ticket: Ticket, why: String): Unit =
    update(isSame(ticket))(_.copy(outcome = Some(Left(why))))

  private def update(which: Ticket => Boolean)(change: Ticket => Ticket): Unit = {
    val before = requests(tickets).map(r => r.id -> r.outcome).toMap
    tickets = tickets.map(t => if (which(t)) change(t) else t)
    ended ++= requests(tickets).filter(r =>
      r.zone.nonEmpty && r.outcome.nonEmpty && r.outcome != before(r.id)
    )
  }
}

object Orders {
  private val MostWaiting = 8
  private val MostShown   = 16

  /** So long an order waits for an alarm to end that it is not about, ms. */
  private val NewAlarmMs = 5000

  /** They change nothing of what an order for a zone does, and do not wait for all its slaves. */
  private val Urgent = Set(Order.Silence, Order.Reset, Order.Acknowledge)

  /** The ticket that rides on answers now. */
  def current(tickets: Seq[Ticket]): Option[Ticket] = {
    val open = tickets.filter(_.outcome.isEmpty)
    open.headOption
      .filter(t => t.zone.isEmpty || t.sentMs.nonEmpty)
      .orElse(open.find(t => Urgent(t.order)))
      .orElse(open.headOption)
  }

  /** The orders that tickets belong to. */
  def requests(tickets: Seq[Ticket]): Seq[Request] =
    tickets.map(_.id).distinct.map(id => Request(tickets.filter(_.id == id)))
}

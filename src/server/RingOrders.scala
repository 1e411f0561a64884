package flyframe.server

import java.time.Instant
import flyframe.protocol.RingResult

/** A message of the server for a node of a ring (GW-06).
  *
  * @param id
  *   counts them since the start of the server
  * @param destination
  *   address of the node, 0: all
  * @param sinceMs
  *   when it was asked for, when it left first, or when the gateway had it, monotonic; the last of these
  * @param counter
  *   by which the gateway knows it, from when it is sent on
  * @param taken
  *   the gateway has this counter
  * @param sentMs
  *   when it left last, monotonic
  */
final case class RingOrder(
    id: Int,
    destination: Int,
    urgent: Boolean,
    data: Vector[Byte],
    asked: Instant,
    sinceMs: Long,
    counter: Option[Long] = None,
    taken: Boolean = false,
    sentMs: Option[Long] = None,
    outcome: Option[Either[String, Unit]] = None
) {

  /** The gateway may have it, and has not said so: nothing else may have this counter. */
  private[server] def mayBeTaken: Boolean = counter.nonEmpty && !taken

  /** In words. */
  def text: String = {
    val to = if (destination == 0) "all nodes" else s"node $destination"
    s"${if (urgent) "urgent to" else "to"} $to: ${RingText.data(data)}"
  }
}

/** The messages to one ring (GW-06): they leave one after the other, each again and again until its gateway
  * has taken it; results come in any order. One message to a node at a time is under way, so that a node that
  * is busy stops no others, and an urgent one beside it. Each ends once, in whatever way. Not for several
  * threads.
  *
  * @param timeoutMs
  *   so long a message waits until it leaves, and then for its result
  */
final class RingOrders(timeoutMs: Int) {
  import RingOrders._
  private var orders  = Vector.empty[RingOrder]
  private var counted = 0
  private var ended   = Vector.empty[RingOrder]

  /** The last ones. */
  def all: Seq[RingOrder] = orders

  /** Some have no result yet. */
  def areOpen: Boolean = orders.exists(_.outcome.isEmpty)

  /** Those that have ended since this was asked last, without a result of the gateway. */
  def takeEnded(): Seq[RingOrder] = {
    val all = ended
    ended = Vector.empty
    all
  }

  /** Puts a message behind the others; Left: why not. */
  def add(
      destination: Int,
      urgent: Boolean,
      data: Vector[Byte],
      nowMs: Long,
      now: Instant
  ): Either[String, RingOrder] = {
    val waiting = orders.filter(_.outcome.isEmpty)
    val most    = if (urgent) MostWaiting else MostWaiting - UrgentPlaces
    val alike   = waiting.count(o => o.destination == destination && o.urgent == urgent)
    if (waiting.size >= most || alike >= MostOfNode)
      Left("Too many messages are waiting.")
    else {
      counted += 1
      val order = RingOrder(counted, destination, urgent, data, now, nowMs)
      // Those that wait stay, whatever has ended meanwhile.
      val (open, over) = orders.partition(o => o.outcome.isEmpty || o.mayBeTaken)
      val kept         = over.takeRight(MostShown - 1 - open.size).map(_.id).toSet
      orders = orders.filter(o => open.contains(o) || kept(o.id)) :+ order
      Right(order)
    }
  }

  /** The one that is to leave now, if it is time. Once it has left it keeps its counter: the gateway may have
    * taken it. If it has ended before that is known, a message to the gateway itself, which refuses it, takes
    * its place.
    *
    * @param taken
    *   counter of the last one that the gateway has taken
    * @param isBusy
    *   it takes urgent ones only: a normal one that has left would stop these, since it keeps its counter
    */
  def next(taken: Long, isBusy: Boolean, nowMs: Long): Option[RingOrder] = {
    for (o <- orders if o.mayBeTaken && o.counter.exists(_ <= taken))
      update(o.id)(_.copy(taken = true, sinceMs = nowMs))
    val underWay = orders.filter(o => o.taken && o.outcome.isEmpty)
    // An urgent one waits for no normal one, a normal one for both.
    def isHeldBy(o: RingOrder)(other: RingOrder) =
      other.destination == o.destination && (other.urgent || !o.urgent)
    val mayLeave = orders.filter(o =>
      o.outcome.isEmpty && o.counter.isEmpty && !underWay.exists(isHeldBy(o)) &&
        (if (o.urgent) underWay.size < GatewayPlaces else !isBusy && underWay.size < GatewayPlaces - 1)
    )
    orders
      .find(_.mayBeTaken)
      .orElse(mayLeave.find(_.urgent))
      .orElse(mayLeave.headOption)
      .filter(_.sentMs.forall(nowMs - _ >= RepeatMs))
      .map { o =>
        val since = if (o.counter.isEmpty) nowMs else o.sinceMs
        val sent =
          o.copy(counter = o.counter.orElse(Some(taken + 1)), sentMs = Some(nowMs), sinceMs = since)
        update(o.id)(_ => sent)
        if (sent.outcome.isEmpty) sent else sent.copy(destination = Ring.Gateway, data = Vector(0))
      }
  }

  /** The gateway has told a result. */
  def told(counter: Long, result: Int): Unit =
    for (o <- orders if o.counter.contains(counter) && o.outcome.isEmpty)
      update(o.id)(
        _.copy(
          taken = true,
          outcome = Some(Either.cond(result == RingResult.Delivered, (), RingText.result(result)))
        )
      )

  /** The gateway has another life: of those that it may have taken no result comes any more, and counters
    * begin anew.
    */
  def abandon(): Unit = {
    for (o <- orders if o.outcome.isEmpty && o.counter.nonEmpty)
      end(o, "not confirmed: the gateway has restarted")
    orders = orders.map(o => if (o.counter.nonEmpty) o.copy(taken = true) else o)
  }

  /** Gives up what has lasted too long; true if something has. */
  def tick(nowMs: Long): Boolean = {
    val late = orders.filter(o => o.outcome.isEmpty && nowMs - o.sinceMs > timeoutMs)
    for (o <- late)
      end(o, if (o.counter.isEmpty) "not sent in time" else "not confirmed: no result has come in time")
    late.nonEmpty
  }

  private def end(order: RingOrder, why: String): Unit = {
    val over = order.copy(outcome = Some(Left(why)))
    update(order.id)(_ => over)
    ended :+= over
  }

  private def update(id: Int)(change: RingOrder => RingOrder): Unit =
    orders = orders.map(o => if (o.id == id) change(o) else o)
}

object RingOrders {
  private val MostWaiting = 16
  private val MostOfNode  = 4 // urgent ones; and as many others
  private val MostShown   = 24

  /** Of those that wait at a time, places that only urgent ones take. */
  private val UrgentPlaces = 4

  /** Messages that a gateway has under way at once (`RING_SERVER_ORDERS` of its program): one of these places
    * is left to an urgent one.
    */
  private val GatewayPlaces = 4

  /** Between two sendings of a message that the gateway has not taken, ms. */
  private val RepeatMs = 200

  /** A gateway tells the result of a message after so long at most, ms: it gives it 30 s, and a frame that
    * cannot leave 10 s more.
    */
  val GatewayMs = 45000
}

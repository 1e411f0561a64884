package flyframe.server

import java.time.Instant
import flyframe.protocol.RingResult

/** A message of the server for a node of a ring (GW-06).
  *
  * @param id
  *   counts them since the start of the server
  * @param destination
  *   address of the node, 0: all
  * @param counter
  *   by which the gateway knows it, from when it is sent on
  * @param taken
  *   the gateway has it
  * @param sentMs
  *   when it left last, monotonic
  */
final case class RingOrder(
    id: Int,
    destination: Int,
    urgent: Boolean,
    data: Vector[Byte],
    asked: Instant,
    counter: Option[Long] = None,
    taken: Boolean = false,
    sentMs: Option[Long] = None,
    outcome: Option[Either[String, Unit]] = None
)

/** The messages to one ring (GW-06): they leave one after the other, each again and again until its gateway
  * has taken it; results come in any order. Not for several threads.
  */
final class RingOrders {
  import RingOrders._
  private var orders  = Vector.empty[RingOrder]
  private var counted = 0

  /** The last ones. */
  def all: Seq[RingOrder] = orders

  /** Puts a message behind the others; Left: why not. */
  def add(destination: Int, urgent: Boolean, data: Vector[Byte], now: Instant): Either[String, RingOrder] =
    if (orders.count(_.outcome.isEmpty) >= MostWaiting) Left("Too many messages are waiting.")
    else {
      counted += 1
      val order = RingOrder(counted, destination, urgent, data, now)
      // Those that wait stay, whatever has ended meanwhile.
      val (ended, open) = orders.partition(_.outcome.nonEmpty)
      val kept          = ended.takeRight(MostShown - 1 - open.size).map(_.id).toSet
      orders = orders.filter(o => o.outcome.isEmpty || kept(o.id)) :+ order
      Right(order)
    }

  /** The one that is to leave now, if it is time. Once it has left it keeps its counter: the gateway may have
    * taken it.
    *
    * @param taken
    *   counter of the last one that the gateway has taken
    */
  def next(taken: Long, nowMs: Long): Option[RingOrder] = {
    for (o <- orders if o.outcome.isEmpty && !o.taken && o.counter.exists(_ <= taken))
      update(o.id)(_.copy(taken = true))
    orders
      .find(o => o.outcome.isEmpty && !o.taken)
      .filter(_.sentMs.forall(nowMs - _ >= RepeatMs))
      .map { o =>
        update(o.id)(_.copy(counter = Some(o.counter.getOrElse(taken + 1)), sentMs = Some(nowMs)))
        orders.find(_.id == o.id).get
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

  /** The gateway has another life: of those that it has taken no result comes any more. */
  def abandon(): Unit =
    for (o <- orders if o.outcome.isEmpty && o.counter.nonEmpty)
      update(o.id)(_.copy(outcome = Some(Left("not confirmed: the gateway has restarted"))))

  private def update(id: Int)(change: RingOrder => RingOrder): Unit =
    orders = orders.map(o => if (o.id == id) change(o) else o)
}

object RingOrders {
  private val MostWaiting = 8
  private val MostShown   = 16

  /** Between two sendings of a message that the gateway has not taken, ms. */
  private val RepeatMs = 200
}

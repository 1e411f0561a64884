package flyframe.server

import scala.collection.immutable.Queue
import flyframe.protocol.{CommandResult, EventKind}

/** A command as the page shows it.
  *
  * @param id
  *   counts the commands of a master since the start of the server
  * @param counter
  *   None: it waits for others before it
  */
final case class Order(
    id: Int,
    code: Int,
    node: Int,
    life: Life,
    counter: Option[Long] = None,
    outcome: Option[Either[String, Unit]] = None
)

/** The commands to one master (SRV-12 to SRV-14): one after the other, since a master takes only counters
  * that rise and its mailbox holds one message. Each is sent again, byte for byte, until the master has told
  * what became of it.
  *
  * @param intervalMs
  *   time between two tries
  * @param tries
  *   after which it has failed
  * @param nextCounter
  *   a counter that has not been used in this life, and will not be after a crash either
  */
final class Commands(key: Array[Byte], intervalMs: Long, tries: Int, nextCounter: Life => Long) {
  import Commands._
  private var orders  = Queue.empty[Order] // the last ones, finished or not
  private var counted = 0
  private var sent    = 0                  // tries of the one at work
  private var due     = 0L

  /** The last commands. */
  def all: Seq[Order] = orders

  /** Puts a command behind the others; Left: why not. */
  def add(life: Life, code: Int, node: Int): Either[String, Order] =
    if (orders.count(_.outcome.isEmpty) >= MostWaiting) Left("Too many commands are waiting.")
    else {
      counted += 1
      val order = Order(counted, code, node, life)
      orders = (orders :+ order).takeRight(MostShown)
      Right(order)
    }

  /** What is to be sent now, if anything. The second: something has changed that the page shows. */
  def tick(nowMs: Long): (Option[Array[Byte]], Boolean) = orders.find(_.outcome.isEmpty) match {
    case Some(order) if order.counter.isEmpty =>
      val begun = order.copy(counter = Some(nextCounter(order.life)))
      replace(begun)
      sent = 0
      (Some(send(begun, nowMs)), true)
    case Some(order) if nowMs - due < 0 => (None, false)
    case Some(order) if sent < tries    => (Some(send(order, nowMs)), false)
    case Some(order) =>
      replace(order.copy(outcome = Some(Left("the master has not answered"))))
      (None, true)
    case None => (None, false)
  }

  /** The master has told something; it may be about a command, also about one that was given up. */
  def told(life: Life, event: Event): Unit = if (event.kind == EventKind.Command)
    orders
      .find(o =>
        o.life == life && o.code == event.position && o.counter.exists(c => (c & 0xffff) == event.sequence)
      )
      .foreach { order =>
        val outcome =
          Either.cond(event.state == CommandResult.Done, (), EventText.result(event.state))
        replace(order.copy(outcome = Some(outcome)))
      }

  /** The master has another life: what waits will not be answered. */
  def abandon(): Unit =
    orders =
      orders.map(o => if (o.outcome.isEmpty) o.copy(outcome = Some(Left("the master has restarted"))) else o)

  private def send(order: Order, nowMs: Long): Array[Byte] = {
    sent += 1
    due = nowMs + intervalMs
    Protocol.encode(Command(order.life, order.counter.get, order.code, order.node), key)
  }

  private def replace(order: Order): Unit = orders = orders.map(o => if (o.id == order.id) order else o)
}

object Commands {
  private val MostWaiting = 8
  private val MostShown   = 16
}

package flyframe.server

import java.net.InetSocketAddress
import java.time.Instant
import scala.collection.mutable
import flyframe.protocol.RingPart

/** The rings that gateways report, and the messages to them (GW-04 to GW-07). Used under the lock of
  * [[Supervisor]], which has reports written and answers them.
  *
  * @param isSilent
  *   what has been heard at this time, monotonic, is silent now
  * @param orderTimeoutMs
  *   see [[Options]]; that of a message begins when its gateway must have told its result
  */
final class Rings(
    isSilent: Option[Long] => Boolean,
    orderTimeoutMs: Int,
    clockMs: () => Long,
    timeOfDay: () => Instant
) {
  import Rings._
  private val rings  = mutable.LinkedHashMap.empty[Int, Ring]
  private val orders = mutable.Map.empty[Int, RingOrders]
  private val from   = mutable.Map.empty[Int, InetSocketAddress]
  private val taken  = mutable.Map.empty[Int, Long]
  private val silent = mutable.Set.empty[Int]

  // Nodes that were not told again, by their rings.
  private var lost = Vector.empty[(Int, Int)]

  // Rings that are not shown, to make room for others. Their gateways do not tell anew what they have told.
  private val away = mutable.Map.empty[Int, Ring]

  /** After a start: what the log tells, the ring with the newest life first. */
  def restore(known: Seq[Ring]): Unit = {
    val (shown, others) = known.map(_.aged).splitAt(MostRings)
    // Of those that have not been heard since, the one with the oldest life makes room first.
    for (r <- shown.reverse) {
      rings(r.id) = r
      silent += r.id
    }
    away ++= others.map(r => r.id -> r)
  }

  def get(life: Life): Option[Ring] = rings.get(life.master).filter(_.life.contains(life))

  def isKnown(id: Int): Boolean = rings.contains(id)

  def hasRoom(id: Int): Boolean = rings.contains(id) || rings.size < MostRings || rings.values.exists(mayGo)

  private def mayGo(r: Ring) = isSilent(r.heardMs) && !orders.get(r.id).exists(_.areOpen)

  /** A report counts. */
  def take(report: RingReport, sender: InetSocketAddress): Unit = {
    val id = report.life.master
    if (!rings.contains(id) && rings.size >= MostRings)
      rings.values.filter(mayGo).minByOption(_.heardMs).foreach(makeRoom)
    val held = rings.get(id).orElse(away.remove(id)) match {
      case Some(r) if r.life.contains(report.life) => r
      case before =>
        ordersOf(id).abandon()
        before.getOrElse(Ring(id)).aged.copy(life = Some(report.life), stored = None, gaps = Vector.empty)
    }
    val since = if (silent.remove(id) || !held.isTold) clockMs() else held.sinceMs
    from(id) = sender
    taken(id) = report.taken
    rings(id) = held.after(report).copy(sinceMs = since, heardMs = Some(clockMs()), heard = Some(timeOfDay()))
    hearOut(rings(id), report)
    for (p <- report.parts if p.kind == RingPart.Result && p.data.size == 5)
      ordersOf(id).told(RingText.number(p.data), p.data(4) & 0xff)
  }

  /** When a report says that nothing waits at the gateway, long behind what it has told of the ring, it has
    * told of all nodes that there are.
    */
  private def hearOut(r: Ring, report: RingReport): Unit =
    if (r.isTold && report.parts.isEmpty && clockMs() - r.sinceMs >= HeardOutMs) {
      lost ++= r.nodes.collect { case (address, n) if n.isOld => r.id -> address }
      rings(r.id) = r.heardOut
    }

  private def makeRoom(r: Ring): Unit = {
    away(r.id) = r
    rings -= r.id
  }

  /** The log has all before this number, and these entries are new. */
  def stored(record: LifeRecord, entries: Seq[LogEntry]): Unit =
    for (r <- get(record.life)) rings(r.id) = r.inLog(record, entries)

  private def ordersOf(id: Int): RingOrders =
    orders.getOrElseUpdate(id, new RingOrders(orderTimeoutMs + RingOrders.GatewayMs))

  /** A message for a node; Left: why it cannot be sent. */
  def send(id: Int, destination: Int, urgent: Boolean, data: Vector[Byte]): Either[String, RingOrder] = for {
    r     <- rings.get(id).toRight(s"There is no ring $id.")
    _     <- Either.cond(!isSilent(r.heardMs), (), s"The gateway of ring $id is silent.")
    _     <- Either.cond(destination != Ring.Gateway, (), "The gateway has no messages for itself.")
    order <- ordersOf(id).add(destination, urgent, data, clockMs(), timeOfDay())
  } yield order

  /** Messages that are to leave now, with the life of the gateway and where it is. */
  def due(): Seq[(Life, InetSocketAddress, RingOrder)] = for {
    (id, address) <- from.toSeq
    r             <- rings.get(id).toSeq if !isSilent(r.heardMs)
    life          <- r.life.toSeq
    order         <- ordersOf(id).next(taken(id), r.isBusy, clockMs()).toSeq
  } yield (life, address, order)

  /** True if a gateway has become silent since the last time, or a message was given up. */
  def tick(): Boolean = {
    val late = orders.values.count(_.tick(clockMs()))
    rings.values.count(r => isSilent(r.heardMs) && silent.add(r.id)) + late > 0
  }

  /** Messages that have ended since this was asked last without a result of their gateways, with the IDs of
    * these.
    */
  def takeEnded(): Seq[(Int, RingOrder)] = orders.toSeq.flatMap { case (id, o) => o.takeEnded().map(id -> _) }

  /** Nodes that have become lost since this was asked last, without their gateways telling so, with the IDs
    * of these.
    */
  def takeLost(): Seq[(Int, Int)] = {
    val all = lost
    lost = Vector.empty
    all
  }

  def picture(isUnproven: Int => Boolean): Vector[RingPicture] =
    rings.values.toVector
      .sortBy(_.id)
      .map(r =>
        RingPicture(
          r,
          isSilent(r.heardMs),
          isUnproven(r.id),
          orders.get(r.id).fold(Seq.empty[RingOrder])(_.all)
        )
      )
}

object Rings {

  /** Gateways at a time. */
  val MostRings = 8

  /** Three HELLO of the slowest ring take 75 s (TB-28), ms. */
  val HeardOutMs = 90000
}

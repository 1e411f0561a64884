package flyframe.server

import java.time.Instant
import flyframe.protocol.{RingPart, RingStatus}

/** A node of a ring, as its gateway has told of it (GW-04).
  *
  * @param life
  *   number of its start
  * @param state
  *   its register `ring_state`; `ports`: `ring_ports`
  * @param can
  *   status of its CAN ports F and T
  * @param distances
  *   from the gateway by its ports 1 and 2, in nodes; 0: not known
  * @param isOld
  *   it was there, but the gateway has not told of it since its start, or the server's
  */
final case class RingNode(
    present: Boolean,
    life: Int = 0,
    state: Int = 0,
    ports: Int = 0,
    can: (Int, Int) = (0, 0),
    deviceType: Int = 0,
    version: Int = 0,
    distances: (Int, Int) = (0, 0),
    isOld: Boolean = false
) {

  /** Port 1 or 2 is up. */
  def isUp(port: Int): Boolean = (ports & (if (port == 1) 0x04 else 0x40)) != 0
}

object RingNode {

  /** As it stands in a part of a report; None: it is something else. */
  def apply(data: Seq[Byte]): Option[RingNode] = {
    def byte(i: Int) = data(i) & 0xff
    data.headOption.collect {
      // As the log keeps it: with what was told of it before.
      case there @ (0 | 1) if data.size >= 11 =>
        RingNode(
          present = there == 1,
          byte(1),
          byte(2),
          byte(3),
          (byte(4), byte(5)),
          byte(6) << 8 | byte(7),
          byte(8),
          (byte(9), byte(10))
        )
      case 0 => RingNode(present = false)
    }
  }
}

/** A ring as the server knows it: what its gateway has told.
  *
  * @param life
  *   of its gateway
  * @param nodes
  *   by address, also those that are lost, and the gateway itself
  * @param order
  *   their addresses, from the gateway's port 2 on, as the ring lies
  * @param ends
  *   addresses at both sides of a break, 0: not known; None: none is known
  * @param isTold
  *   the gateway has told of a break, or that there is none, since its start and the server's
  * @param sinceMs
  *   since when it has told so, and has not been silent, monotonic
  * @param heardMs
  *   when its last report came, monotonic; None: none since the start of the server
  * @param stored
  *   number of the next part that the log wants; None: the log has not said it yet
  * @param gaps
  *   first and last numbers of parts of this life that the log does not have
  * @param urgent
  *   the last urgent messages to the server
  */
final case class Ring(
    id: Int,
    life: Option[Life] = None,
    status: Int = 0,
    nodes: Map[Int, RingNode] = Map.empty,
    order: Seq[Int] = Nil,
    ends: Option[(Int, Int)] = None,
    isTold: Boolean = false,
    sinceMs: Long = 0,
    heardMs: Option[Long] = None,
    heard: Option[Instant] = None,
    stored: Option[Long] = None,
    gaps: Vector[(Long, Long)] = Vector.empty,
    urgent: Seq[LogEntry] = Nil
) {

  /** With what the log has now.
    *
    * @param entries
    *   that are new
    */
  def inLog(record: LifeRecord, entries: Seq[LogEntry]): Ring = {
    val all = urgent ++ entries.filter(e => e.isUrgent && !e.again)
    copy(stored = Some(record.next), gaps = record.gaps, urgent = all.takeRight(Ring.MostUrgent))
  }

  /** Its gateway takes urgent messages only: it has one place left. */
  def isBusy: Boolean = (status & RingStatus.Busy) != 0

  /** Nodes of which the gateway has not told again are lost. */
  def heardOut: Ring = copy(nodes = nodes.map {
    case (address, n) if n.isOld => address -> n.copy(present = false, isOld = false)
    case other                   => other
  })

  /** With what a part says of nodes and ring. */
  def told(kind: Int, source: Int, data: Seq[Byte]): Ring = kind match {
    case RingPart.Node =>
      RingNode(data).fold(this) { n =>
        val before = nodes.get(source)
        // It was there.
        copy(nodes = nodes.updated(source, if (n.present) n else before.getOrElse(n).copy(present = false)))
      }
    case RingPart.Ring if data.size == 2 =>
      val both = (data(0) & 0xff, data(1) & 0xff)
      copy(ends = Option.when(both != (0, 0))(both), isTold = true)
    case _ => this
  }

  /** Nobody knows whether nodes that were there still are, nor whether a break is. */
  def aged: Ring = copy(
    nodes = nodes.map { case (address, n) => address -> n.copy(isOld = n.present) },
    isTold = false
  )

  /** With all that parts say: kind, source and data of each. */
  def told(parts: Seq[(Int, Int, Seq[Byte])]): Ring = {
    val all = parts.foldLeft(this) { case (r, (kind, source, data)) => r.told(kind, source, data) }
    if (all.nodes == nodes) all else all.copy(order = all.arranged)
  }

  /** With all that a report says. */
  def after(report: RingReport): Ring =
    copy(status = report.status).told(report.parts.map(p => (p.kind, p.source, p.data)))

  /** By the distance at port 2 (FR-60); then those that are heard at port 1 only, the farthest first; then
    * those of which no distance is known. A lost node, or one that is not heard yet, stays behind the one
    * behind which it stood: the distances of others may have changed since. Of one that was lost before the
    * start of the server those say where it was that it had last.
    */
  private def arranged: Seq[Int] = {
    def place(address: Int) = nodes(address).distances match {
      case _ if address == Ring.Gateway => (0, 0)
      case (_, d) if d > 0              => (1, d)
      case (d, _) if d > 0              => (2, -d)
      case _                            => (3, 0)
    }
    val stay  = order.filter(a => !nodes(a).present || nodes(a).isOld)
    val moved = nodes.keys.toSeq.filterNot(stay.contains)
    // A node that was taken out may have had the distance of the next one.
    val here = moved.sortBy(a => (place(a), nodes(a).present, order.indexOf(a), a))
    stay.foldLeft(here) { (all, a) =>
      val at = order.takeWhile(_ != a).lastOption.fold(0)(all.indexOf(_) + 1)
      all.patch(at, Seq(a), 0)
    }
  }
}

object Ring {

  /** Address of a gateway on its ring. */
  val Gateway = 1

  /** Urgent messages that stay in sight. */
  val MostUrgent = 5
}

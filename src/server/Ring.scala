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
      case 0 => RingNode(present = false)
      case 1 if data.size >= 11 =>
        RingNode(
          present = true,
          byte(1),
          byte(2),
          byte(3),
          (byte(4), byte(5)),
          byte(6) << 8 | byte(7),
          byte(8),
          (byte(9), byte(10))
        )
    }
  }
}

/** A ring as the server knows it: what its gateway has told.
  *
  * @param life
  *   of its gateway
  * @param nodes
  *   by address, also those that are lost, and the gateway itself
  * @param ends
  *   addresses at both sides of a break, 0: not known; None: none is known
  * @param isTold
  *   the gateway has told of a break, or that there is none, since its start and the server's
  * @param heardMs
  *   when its last report came, monotonic; None: none since the start of the server
  * @param stored
  *   number of the next part that the log wants; None: the log has not said it yet
  * @param gaps
  *   first and last numbers of parts of this life that the log does not have
  */
final case class Ring(
    id: Int,
    life: Option[Life] = None,
    status: Int = 0,
    nodes: Map[Int, RingNode] = Map.empty,
    ends: Option[(Int, Int)] = None,
    isTold: Boolean = false,
    heardMs: Option[Long] = None,
    heard: Option[Instant] = None,
    stored: Option[Long] = None,
    gaps: Vector[(Long, Long)] = Vector.empty
) {

  /** Its gateway takes urgent messages only: it has one place left. */
  def isBusy: Boolean = (status & RingStatus.Busy) != 0

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

  /** With all that a report says. */
  def after(report: RingReport): Ring =
    report.parts.foldLeft(copy(status = report.status))((r, p) => r.told(p.kind, p.source, p.data))

  /** The addresses in the order of the ring, from the gateway's port 2 on (FR-60): by the distance there;
    * then those that are heard at port 1 only, the farthest first; then those of which no distance is known.
    * Lost nodes stand at the break.
    */
  def order: Seq[Int] = {
    val all = nodes.toSeq.collect { case (address, n) if n.present => address -> n.distances }
    def place(address: Int, distances: (Int, Int)) = distances match {
      case _ if address == Ring.Gateway => (0, 0)
      case (_, d) if d > 0              => (1, d)
      case (d, _) if d > 0              => (2, -d)
      case _                            => (3, 0)
    }
    val here            = all.sortBy { case (a, d) => (place(a, d), a) }.map(_._1)
    val lost            = nodes.collect { case (address, n) if !n.present => address }.toSeq.sorted
    val (before, after) = here.splitAt(here.indexOf(ends.fold(0)(_._1)) + 1)
    if (before.isEmpty) here ++ lost else before ++ lost ++ after
  }
}

object Ring {

  /** Address of a gateway on its ring. */
  val Gateway = 1
}

package flyframe.relay

import scala.collection.mutable.ArrayBuffer

/** A frame that is being received, or has been.
  *
  * @param port
  *   by which it came
  * @param time
  *   us counter at its start bit
  */
final class Incoming(val port: Int, val header: LinkHeader, val body: LinkBody, val time: Int) {

  /** Its place in CAN order; unknown before its identifier is there. */
  var order: Option[Long] = None

  /** How many frames of this node had their identifier before it. */
  var turn: Long = 0

  /** The output by which it is passed on. */
  var output: Option[Int] = None

  /** The header behind this node. */
  def passed: LinkHeader = header.copy(hops = header.hops - 1)
}

/** Frames that wait for an output (FR-48). */
class TransitModel {
  import TransitModel._
  private val frames = ArrayBuffer.empty[Incoming] // older ones first

  /** The most that have ever waited. */
  var most = 0

  def size: Int = frames.size

  /** Takes a frame.
    *
    * @return
    *   false if there was no room
    */
  def put(frame: Incoming): Boolean = {
    val fits = frames.size < Size
    if (fits) frames += frame
    most = most max frames.size
    fits
  }

  /** Who leaves next: the first in transit order, of equal ones the one whose identifier was first; one whose
    * identifier is not there is last (RB-08, RB-28).
    */
  def first: Option[Incoming] =
    frames.minByOption(f => f.order.map(inTransit(_) -> f.turn).getOrElse(Long.MaxValue -> 0L))

  /** An own frame of this order is before all that wait (RB-08, RB-28).
    *
    * @param isLate
    *   it is before others of the second half, too
    */
  def isBefore(order: Long, isLate: Boolean): Boolean = {
    val own = if (isLate) order min (Half - 1) else order
    frames.forall(_.order.forall(own < inTransit(_)))
  }

  def remove(frame: Incoming): Boolean = {
    val i = frames.indexOf(frame)
    if (i >= 0) frames.remove(i)
    i >= 0
  }

  def drop(): Unit = frames.clear()
}

object TransitModel {
  val Size = 8

  private val Half = 1L << 31

  def isInFirstHalf(order: Long): Boolean = order < Half

  /** The transit order: all of the second half are equal (RB-28). */
  private def inTransit(order: Long) = order min Half
}

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

  /** Who leaves next: the first in CAN order, older first; one whose identifier is not there is last (RB-08).
    */
  def first: Option[Incoming] = frames.minByOption(_.order.getOrElse(Long.MaxValue))

  /** A frame of this order is before all that wait (RB-08). */
  def isBefore(order: Long): Boolean = frames.forall(_.order.forall(order < _))

  def remove(frame: Incoming): Boolean = {
    val i = frames.indexOf(frame)
    if (i >= 0) frames.remove(i)
    i >= 0
  }

  def drop(): Unit = frames.clear()
}

object TransitModel {
  val Size = 8
}

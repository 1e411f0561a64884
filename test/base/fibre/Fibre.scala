package flyframe.fibre

import scala.collection.mutable

/** A fibre with its two modules, from a port to another one. Times are in ps.
  *
  * @param delay
  *   from pin to pin
  */
class Fibre(val delay: Long) {
  private val edges   = mutable.Queue.empty[(Long, Boolean)]
  private var entered = false
  private var left    = false

  /** No light passes. */
  var isCut = false

  /** By how much an edge is late: of the light behind it. */
  var lateness: Boolean => Long = _ => 0

  /** What the receiver makes of the light at a time. */
  var disturbed: (Long, Boolean) => Boolean = (_, light) => light

  /** The light that is sent from `time` on. */
  def send(time: Long, light: Boolean): Unit = if (light != entered) {
    entered = light
    edges.enqueue((time + delay + lateness(light), light))
  }

  /** The light that arrives at `time`; times ascend. */
  def receive(time: Long): Boolean = {
    while (edges.nonEmpty && edges.head._1 <= time) left = edges.dequeue()._2
    disturbed(time, left && !isCut)
  }
}

package flyframe.fibre

import scala.collection.mutable

/** A fibre with its two modules, from a port to another one. Times are in ps.
  *
  * @param delay
  *   from pin to pin
  */
class Fibre(val delay: Long) {
  private val edges   = mutable.Queue.empty[(Long, Boolean)]
  private var first   = Long.MaxValue // when the first of them arrives, which each sample asks for
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
    first = edges.head._1
  }

  /** The light that arrives at `time`; times ascend. */
  def receive(time: Long): Boolean = {
    while (first <= time) {
      left = edges.dequeue()._2
      first = edges.headOption.fold(Long.MaxValue)(_._1)
    }
    disturbed(time, left && !isCut)
  }
}

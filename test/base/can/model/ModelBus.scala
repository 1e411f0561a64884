package flyframe.can.model

import flyframe.can.CanUnderTest

/** Controllers on one bus, each with a clock of its own.
  *
  * @param periods
  *   of their core clocks, in units of time that are all the same
  * @param hears
  *   the level that a node hears: of the node's number, the time and the level of the bus
  */
class ModelBus(nodes: Seq[CanUnderTest], periods: Seq[Int], hears: (Int, Long, Boolean) => Boolean) {
  private val next = Array.fill(nodes.size)(0L)
  private val all  = nodes.toArray // a loop over it is what most of a long run is

  /** The time up to which all is done. */
  var now: Long = 0

  /** Runs up to time `end`. */
  def run(end: Long): Unit = while (now < end) {
    var first = 0
    var level = true
    var i     = 0
    while (i < next.length) {
      if (next(i) < next(first)) first = i
      i += 1
    }
    now = next(first)
    i = 0
    while (i < all.length) {
      level &= all(i).driven
      i += 1
    }
    all(first).step(hears(first, now, level))
    next(first) += periods(first)
  }
}

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

  /** The time up to which all is done. */
  var now: Long = 0

  /** Runs up to time `end`. */
  def run(end: Long): Unit = while (now < end) {
    var first = 0
    for (i <- 1 until next.length) if (next(i) < next(first)) first = i
    now = next(first)
    var level = true
    for (node <- nodes) level &= node.driven
    nodes(first).step(hears(first, now, level))
    next(first) += periods(first)
  }
}

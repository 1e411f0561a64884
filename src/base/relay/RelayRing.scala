package flyframe.relay

import flyframe.params.CanParams

/** A ring of nodes in relay mode: port 2 of each goes to port 1 of the next. Times are in ps.
  *
  * @param delays
  *   of the links behind each node, both ways; at least a core cycle
  * @param periods
  *   of the core clock of each node
  * @param linkBit
  *   core cycles of a link bit
  */
final case class RelayRingSetting(
    delays: IndexedSeq[Long],
    periods: IndexedSeq[Long],
    linkBit: Int = 25,
    p: CanParams = CanParams()
) {
  require(delays.size == periods.size, "there must be a delay and a period for each node.")
  require(delays.min >= periods.max, "a link's delay must be a core cycle or more.")

  def count: Int = delays.size

  /** When the first cycle of a node begins: nodes start one after the other. */
  def phase(node: Int): Long = 1009L * node

  /** The end of a cycle of a node. */
  def end(node: Int, cycle: Long): Long = phase(node) + (cycle + 1) * periods(node)

  /** The first cycle of a node that ends at `time` or later. */
  def cycleAt(node: Int, time: Long): Long = -Math.floorDiv(phase(node) - time, periods(node)) - 1

  /** Where the link of a port leads: node and port. */
  def target(node: Int, port: Int): (Int, Int) =
    if (port == 1) ((node + 1) % count, 0) else ((node + count - 1) % count, 1)

  /** The delay of the link of a port. */
  def delay(node: Int, port: Int): Long = delays(if (port == 1) node else (node + count - 1) % count)
}

/** A ring that runs: bit by bit ([[RelayBitRing]]) or frame by frame ([[RelayEngine]]). What is done to it at
  * a time counts in the first cycle of a node, or in the first bit of a link, that ends or begins then or
  * later.
  */
trait RelayRing {
  def setting: RelayRingSetting

  /** ps since the start. */
  def now: Long

  def node(n: Int): RelayNodeModel

  /** At `time`, `action` is done. */
  def at(time: Long)(action: => Unit): Unit

  /** Runs until `end`; what happens at `end` itself is still to come. */
  def runTo(end: Long): Unit

  /** The host of a node reads and writes. */
  def access(n: Int)(body: RelayHostModel => Unit): Unit

  /** A port comes up or goes down. */
  def setUp(n: Int, port: Int, isUp: Boolean): Unit

  /** Nothing of what a port sends arrives any more, or again. */
  def setDark(n: Int, port: Int, isDark: Boolean): Unit

  /** The next bit that a port sends arrives wrong. */
  def flip(n: Int, port: Int): Unit

  def runUs(us: Double): Unit = runTo(now + (us * 1e6).toLong)
}

package flyframe.fibre

import flyframe.params.FibreParams
import flyframe.registers.RingRegisters

/** Nodes in a ring: port 2 of each goes to port 1 of the next, by two fibres.
  *
  * @param delays
  *   of the fibres behind each node, in ps
  * @param periods
  *   of the core clocks, in ps
  */
class RingBench(
    val p: FibreParams,
    val nodes: IndexedSeq[FibreUnderTest],
    delays: Seq[Long],
    periods: Seq[Long]
) {
  private val count  = nodes.size
  private val period = periods.toArray
  private val next   = periods.toArray // when the present cycle of each node ends
  // By how much each sample of a node's cycle is in front of its end.
  private val early =
    period.map(t =>
      Array.tabulate(p.samplesPerCycle)(i => t * (p.samplesPerCycle - 1 - i) / p.samplesPerCycle)
    )

  // Nodes in the order in which their cycles end, from `head` on, round and round: to search for the next one
  // in each cycle would take most of the time of a large ring.
  private val order = nodes.indices.sortBy(next(_)).toArray
  private var head  = 0

  /** The fibre from port 2 of a node to port 1 of the next, and the one back. */
  val there: IndexedSeq[Fibre] = delays.map(new Fibre(_)).toIndexedSeq
  val back: IndexedSeq[Fibre]  = delays.map(new Fibre(_)).toIndexedSeq

  // As arrays, which a long run reads faster.
  private val units   = nodes.toArray
  private val thereOf = there.toArray
  private val backOf  = back.toArray

  /** What the controller of a node sends, and what it is told of each cycle. */
  val drives: Array[() => Boolean]      = Array.fill(count)(() => true)
  val hears: Array[RingBench.Listener]  = Array.fill(count)(_ => ())
  var watches: Seq[(Long, Int) => Unit] = Nil // called with time and node behind each cycle
  val optical: Array[Int]               = Array.fill(count)(3)
  val isDead: Array[Boolean]            = Array.fill(count)(false)

  /** ps since the start. */
  var now = 0L

  /** The one before it, round and round. */
  private def behind(n: Int) = if (n == 0) count - 1 else n - 1

  /** What a node samples of a fibre in its present cycle. */
  private def samples(fibre: Fibre, n: Int) = {
    val time    = next(n)
    val before  = early(n)
    var samples = 0
    var i       = 0
    while (i < before.length) {
      if (fibre.receive(time - before(i))) samples |= 1 << i
      i += 1
    }
    samples
  }

  private def cycle(n: Int): Unit = {
    val node   = units(n)
    val before = behind(n)
    val time   = next(n)
    val drive  = drives(n)()
    hears(n).hear(node.bus(drive))
    node.step(drive, samples(thereOf(before), n), samples(backOf(n), n), optical(n))
    thereOf(n).send(time, node.light(1) && !isDead(n))
    backOf(before).send(time, node.light(0) && !isDead(n))
    next(n) += period(n)
    now = time
    if (watches.nonEmpty) for (watch <- watches) watch(time, n)
  }

  /** Runs until `end`. */
  def runTo(end: Long): Unit = {
    while (next(order(head)) <= end) {
      val node = order(head)
      cycle(node)
      var at = head
      head = if (head == count - 1) 0 else head + 1
      while (at != head && isBefore(node, order(behind(at)))) {
        order(at) = order(behind(at))
        at = behind(at)
      }
      order(at) = node
    }
    now = end
  }

  /** The cycle of a node ends in front of another one's. */
  private def isBefore(node: Int, other: Int) =
    next(node) < next(other) || next(node) == next(other) && node < other

  def run(ps: Long): Unit     = runTo(now + ps)
  def runUs(us: Double): Unit = run((us * 1e6).toLong)

  /** Runs until something is so, for `us` at most, and returns the time that it took, in ns. */
  def await(us: Double, what: String)(isSo: => Boolean): Double = {
    val start = now
    while (!isSo && now < start + us * 1e6) run(10000)
    assert(isSo, s"not within $us us: $what")
    (now - start) / 1000.0
  }

  // ---- what a node says ----

  def state(n: Int): Int       = nodes(n).read(RingRegisters.State)
  def mode(n: Int): Int        = state(n) & 3
  def isGuard(n: Int): Boolean = (state(n) >> 2 & 1) == 1
  def guards: Seq[Int]         = nodes.indices.filter(isGuard)
  def modes: Seq[Int]          = nodes.indices.map(mode)

  private def port(n: Int, port: Int, bit: Int) =
    (nodes(n).read(RingRegisters.Ports) >> 4 * port + bit & 1) == 1
  def signal(n: Int, of: Int): Boolean      = port(n, of, 0)
  def hearsSearch(n: Int, of: Int): Boolean = port(n, of, 1)
  def isUp(n: Int, of: Int): Boolean        = port(n, of, 2)
  def isStuck(n: Int, of: Int): Boolean     = port(n, of, 3)
  def bus(n: Int): Boolean                  = nodes(n).bus(drives(n)())

  def control(n: Int, home: Boolean = false, forced: Int = 0, off: Boolean = false): Unit =
    nodes(n).write(RingRegisters.Control, (if (home) 2 else 0) | forced << 2 | (if (off) 0x20 else 0))

  /** Both fibres behind a node are cut, or mended. */
  def cut(n: Int, isCut: Boolean = true): Unit = {
    there(n).isCut = isCut
    back(n).isCut = isCut
  }

  /** The level of a node is dominant from now on, or recessive again. */
  def dominant(n: Int, isSo: Boolean = true): Unit = drives(n) = () => !isSo
}

object RingBench {

  /** What is told of a level in each cycle; no function, as that would box it each time. */
  trait Listener {
    def hear(level: Boolean): Unit
  }

  /** Nodes with addresses from 2 on, short timers, T of 100 core cycles, and all ports up.
    *
    * @param home
    *   the node that is guard
    * @param isLine
    *   nothing joins the last node and the first
    */
  def ready(
      p: FibreParams,
      nodes: IndexedSeq[FibreUnderTest],
      home: Option[Int] = Some(0),
      isLine: Boolean = false,
      delayNs: Long = 0,
      bit: Int = 100
  ): RingBench = {
    val period = 1000000L / p.coreClockMhz
    val ring   = new RingBench(p, nodes, nodes.map(_ => delayNs * 1000), nodes.map(_ => period))
    for (n <- nodes.indices) {
      ring.control(n, home = home.contains(n))
      nodes(n).write(RingRegisters.Address, n + 2)
      nodes(n).setBit(bit)
    }
    if (isLine) ring.cut(nodes.size - 1)
    ring.runUs(12.0 * p.usPerMs + 30)
    ring
  }
}

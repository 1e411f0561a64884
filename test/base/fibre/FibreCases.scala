package flyframe.fibre

import flyframe.params.FibreParams
import org.scalatest.flatspec.AnyFlatSpec

/** What all suites of ports and bus mode share: they run on the golden model and on the RTL. */
abstract class FibreCases extends AnyFlatSpec {

  /** Runs `body` with nodes fresh out of reset. */
  protected def withNodes(p: FibreParams, count: Int)(body: IndexedSeq[FibreUnderTest] => Unit): Unit

  /** A millisecond of these lasts one microsecond. */
  protected val quick: FibreParams = FibreParams(usPerMs = 1)

  /** The core clocks, each with short timers. */
  protected val clocks: Seq[FibreParams] = Seq(quick, quick.copy(coreClockMhz = 50))

  /** Runs `body` with a ring that is up; node 0 is guard if nothing else is said.
    *
    * @param ahead
    *   core cycles that some nodes have lived for when the others come out of reset
    */
  protected def ring(
      count: Int,
      home: Option[Int] = Some(0),
      isLine: Boolean = false,
      delayNs: Long = 0,
      p: FibreParams = quick,
      ahead: Map[Int, Int] = Map.empty
  )(body: RingBench => Unit): Unit = withNodes(p, count) { nodes =>
    for ((n, cycles) <- ahead; _ <- 0 until cycles) nodes(n).step(drive = true, 0, 0)
    body(RingBench.ready(p, nodes, home, isLine, delayNs))
  }

  /** A line of three: what the first one drives goes through the second, in mode 1, to the third. */
  protected def line(p: FibreParams = quick, delayNs: Long = 0)(body: RingBench => Unit): Unit =
    ring(3, home = None, isLine = true, delayNs = delayNs, p = p)(body)

  /** Delays of a fibre behind which its light has every phase to the clock that samples it, each 10 ns. */
  protected val phases: Seq[Long] = 0L until 10L
}

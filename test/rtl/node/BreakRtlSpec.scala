package flyframe.node

import chiseltest._
import flyframe.{SharedSimulation, Simulation, Tier}
import flyframe.fibre._
import flyframe.params.Presets
import org.scalatest.flatspec.AnyFlatSpec

/** Rings of nodes in RTL, all of them simulated as one. */
object RingOfNodes {
  private val Most = 10
  private val p    = Presets.ring.copy(coreClockMhz = 50)

  def apply(home: Option[Int], delays: Seq[Long], kbps: Int, first: Int = 2)(body: CanOnRing => Unit): Unit =
    RawTester.test(
      new RingUnderTest(p, Most),
      Simulation.annotations(this, "ring of nodes")
    )(dut => body(new RtlCanRing(dut, home, delays, kbps, first, p.coreClockMhz)))
}

/** Breaks of a ring of RTL nodes, at 250 kbit/s. */
class BreakRtlSpec extends BreakCases {
  protected val positions: Tier = Tier("Breaks of a ring of RTL nodes", "breaks", test = 1, soak = 40)

  override protected def isSample: Boolean = !Tier.isSoak

  protected def onRing(home: Boolean, first: Int)(body: CanOnRing => Unit): Unit =
    RingOfNodes(Option.when(home)(0), Seq.fill(8)(50L), 250, first)(body)
}

package flyframe.fibre.model

import flyframe.Tier
import flyframe.fibre._
import org.scalatest.flatspec.AnyFlatSpec

/** CAN on a ring of models in bus mode: how far it reaches. */
class CanRingSpec extends AnyFlatSpec {
  private val corners =
    Tier("Bus mode at the corners of the table of reach", "frames", test = 10, soak = 1000)

  // At 100 MHz a quantum is 4 cycles at 1 Mbit/s.
  for {
    kbps  <- Reach.Rates
    nodes <- Reach.Nodes if Reach.metres(kbps, nodes) > 0
    if Tier.isSoak || Seq(1000 -> 2, 400 -> 5, 125 -> 10).contains(kbps -> nodes)
  } {
    val metres = Reach.metres(kbps, nodes).toDouble
    def ring(metres: Double) =
      new CanRing(nodes, Some(nodes - 1), CanRing.spread(nodes, metres), 4000 / kbps, coreClockMhz = 100)

    s"FR-38: $nodes nodes, $metres m, $kbps kbit/s" should "arbitrate between the farthest nodes" in
      corners.run(s"$kbps kbit/s, $nodes nodes", corners.size) {
        val r = ring(metres)
        assert(r.guards == Seq(nodes - 1))
        assert(r.arbitrate(corners.size.toInt), r.errors)
      }

    it should "fail where the way is too long" in assert(!ring(CanRing.tooLong(metres, nodes)).arbitrate(2))
  }

  "FR-38: 2 nodes at 125 kbit/s" should "fail at 1.5 times the length" in {
    val metres = Reach.metres(125, 2).toDouble
    def ring(times: Double) =
      new CanRing(2, Some(1), CanRing.spread(2, metres * times), 32, coreClockMhz = 100)
    assert(ring(1).arbitrate(2))
    assert(!ring(1.5).arbitrate(2))
  }
}

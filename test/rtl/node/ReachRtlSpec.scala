package flyframe.node

import flyframe.{StandingSimulation, Tier}
import flyframe.fibre._
import flyframe.fibre.model.CanRing
import flyframe.params.Presets
import org.scalatest.flatspec.AnyFlatSpec

/** CAN on a ring of RTL nodes in bus mode, pins and tones included: the corners of the table of reach from
  * 125 kbit/s up, in `make test` the first and the last of them. The golden model has them all, and slower
  * ones, with more frames (`CanRingSpec`).
  */
class ReachRtlSpec extends AnyFlatSpec {
  private val corners = Tier("Bus mode in RTL at the corners of reach", "frames", test = 2, soak = 20)
  private val p       = Presets.ring.copy(coreClockMhz = 100)
  private val nodes =
    new StandingSimulation(new RingUnderTest(p, most = 10), this, "ring of nodes at 100 MHz")

  private def ring(kbps: Int, count: Int, metres: Double)(body: CanOnRing => Unit): Unit = nodes { dut =>
    body(new RtlCanRing(dut, Some(count - 1), CanRing.spread(count, metres), kbps, first = 2, p.coreClockMhz))
  }

  for {
    kbps  <- Reach.Rates if kbps >= 125
    count <- Reach.Nodes if Reach.metres(kbps, count) > 0
    if Tier.isSoak || (kbps, count) == (1000, 2) || (kbps, count) == (125, 10)
    metres = Reach.metres(kbps, count).toDouble
  } {
    s"FR-38: $count RTL nodes, $metres m, $kbps kbit/s" should "arbitrate between the farthest nodes" in
      corners.run(s"$kbps kbit/s, $count nodes", corners.size) {
        ring(kbps, count, metres) { r =>
          assert(r.guards == Seq(count - 1))
          assert(r.arbitrate(corners.size.toInt), r.errors)
        }
      }

    it should "fail where the way is too long" in
      ring(kbps, count, CanRing.tooLong(metres, count))(r =>
        assert(!r.arbitrate(2) && r.errors.exists(_ > 0))
      )
  }
}

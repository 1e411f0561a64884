package flyframe

import flyframe.fibre.Reach
import org.scalatest.flatspec.AnyFlatSpec

class RingPlanSpec extends AnyFlatSpec {
  "FR-38: the plan of a ring" should "have the bit rates of the table, and no faster ones" in {
    for {
      mhz   <- Seq(50, 100)
      kbps  <- Reach.Rates
      nodes <- Reach.Nodes
      metres = Reach.metres(kbps, nodes, mhz) if metres > 0
    } {
      def usual(metres: Int) =
        RingPlan(nodes, metres, mhz).lines(1).split("usual rates ?").last.takeWhile(_ != ' ')
      assert(usual(metres) == s"$kbps", s"$nodes nodes, $metres m, $mhz MHz")
      assert(usual(metres + 1) != s"$kbps")
      val prescaler = RingPage.prescaler(mhz, kbps).toLong
      val least     = Reach.prescaler(metres, nodes, mhz, 25)
      assert(least <= prescaler && Reach.prescaler(metres + 1, nodes, mhz, 25) > least - 1)
      // T of 25 quanta is 2 D / 0.72 at least, and with one cycle less it is not.
      val way                  = 2.0 * (Reach.nodeNs(mhz) * (nodes - 1) + Reach.NsPerMetre * metres) / 0.72
      def bit(prescaler: Long) = prescaler * 25 * 1000.0 / mhz
      assert(bit(least) >= way - 1e-6 && bit(least - 1) < way)
    }
  }

  it should "tell what to write, and what is impossible" in {
    assert(
      RingPlan(20, 600).lines == Seq(
        "A ring of 20 nodes and 600 m of fibre, core clocks of 100 MHz:",
        "Bus mode (FR-38): at most 52.6 kbit/s with 0x4B 0x00 0x14 0x22 at 0x0104; of the usual rates " +
          "50 kbit/s with 0x4F 0x00 0x14 0x22 at 0x0104.",
        "Relay mode, a frame to the farthest node when nothing else is sent (FR-46):",
        "  at 2,000 kbit/s at most 0.41 ms, broken 0.68 ms",
        "  at 1,000 kbit/s at most 0.82 ms, broken 1.37 ms",
        "  at 400 kbit/s at most 2.06 ms, broken 3.41 ms"
      )
    )
    assert(RingPlan(2, 0).lines(1).contains("at most 1000.0 kbit/s with 0x03 0x00"))
    assert(RingPlan(50, 1000000).lines(1) == "Bus mode: too long for any bit rate (FR-38).")
    assert(RingPlan(125, 15000).lines(1).endsWith("; slower than all usual rates."))
  }

  "Arguments that no ring has" should "be told in one sentence" in {
    def why(arguments: String*) = RingPlan.parse(arguments).swap.toOption.get
    assert(why("--nodes", "1", "--metres", "5") == "nodes is 1 but must be from 2 to 125.")
    assert(why("--nodes", "5", "--metres", "-1") == "metres is -1 but must be from 0 to 1,000,000.")
    assert(why("--nodes", "5", "--metres", "5", "--mhz", "60") == "mhz is 60 but must be 50 or 100.")
    for (wrong <- Seq(Seq("--nodes", "x"), Seq("--nodes", "5"), Seq("--others")))
      assert(why(wrong: _*).linesIterator.size == 1 && why(wrong: _*).endsWith("."))
    assert(RingPlan.parse(Seq("--nodes", "20", "--metres", "600")) == Right(RingPlan(20, 600)))
  }
}

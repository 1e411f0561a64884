package flyframe.model

import org.scalatest.flatspec.AnyFlatSpec

/** Clocks of lines, by the model of their loops. */
class ClockLineSpec extends AnyFlatSpec {
  for (
    (slaves, cycleUs, within, lockMs) <- Seq((5, 250, 40, 600), (5, 1000, 40, 600), (64, 1000, 250, 600))
  ) {
    s"DC-16, DC-23: $slaves slaves, a frame in $cycleUs us" should s"lock, and keep within $within ns" in {
      val apart   = new ClockLine(slaves, cycleUs).apart(5000000 / cycleUs)
      val settled = ClockLine.settled(apart, within)
      info(f"at most ${apart.max}%.0f ns apart, then ${apart.drop(apart.size / 2).max}%.0f ns")
      info(s"within $within ns after ${settled.map(_ * cycleUs / 1000)} ms")
      assert(settled.exists(_ * cycleUs < 1000 * lockMs))
    }
  }

  "Clocks with a frame far too seldom" should "run apart" in {
    assert(new ClockLine(4, 100000).apart(30).last > 1000)
  }
}

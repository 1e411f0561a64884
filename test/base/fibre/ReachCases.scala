package flyframe.fibre

import org.scalatest.flatspec.AnyFlatSpec

/** How long a ring may be, against the table of the specification. */
abstract class ReachCases extends AnyFlatSpec {
  private val table = """
    1000 0.03 - - - -
    500 0.10 - - - -
    400 0.14 0.02 - - -
    250 0.24 0.12 - - -
    125 0.53 0.41 0.21 - -
    100 0.68 0.56 0.36 - -
    50 1.40 1.28 1.08 0.68 -
    20 3.56 3.44 3.24 2.84 1.64
    10 7.16 7.04 6.84 6.44 5.24
    5 14.3 14.2 14.0 13.6 12.4"""

  "FR-38: the greatest lengths" should "be those of the table" in {
    val ours = Reach.Rates.map(rate => (rate +: Reach.Nodes.map(Reach.entry(rate, _))).mkString(" "))
    assert(ours == table.trim.linesIterator.map(_.trim).toSeq)
  }

  "FR-38: the greatest bit rate" should "be that of the specification" in {
    assert(Reach.bitsPerSecond(10000, 50) / 100 == 60) // 6.0 kbit/s
    assert(Reach.bitsPerSecond(0, 50) / 1000 == 36)
    for (rate <- Reach.Rates; n <- Reach.Nodes; m = Reach.metres(rate, n) if m > 0) {
      assert(Reach.bitsPerSecond(m, n) >= rate * 1000)
      assert(Reach.bitsPerSecond(m + 1, n) < rate * 1000)
    }
  }

  it should "be lower with nodes of 50 MHz" in
    assert(Reach.metres(20, 50, 50) == 1640 - 49 * 80 / 5)
}

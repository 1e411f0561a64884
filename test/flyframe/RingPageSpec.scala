package flyframe

import org.scalatest.flatspec.AnyFlatSpec

class RingPageSpec extends AnyFlatSpec {
  private val rows = RingPage.text.linesIterator.toSet

  // As the specification has the table; 25 quanta at 100 MHz.
  "FR-38: docs/ring.md" should "say how long a ring may be, and how to set its bit rate" in {
    for (
      row <- Seq(
        "| 1000 | 0.03 | - | - | - | - | 4 |",
        "| 400 | 0.14 | 0.02 | - | - | - | 10 |",
        "| 125 | 0.53 | 0.41 | 0.21 | - | - | 32 |",
        "| 50 | 1.40 | 1.28 | 1.08 | 0.68 | - | 80 |",
        "| 10 | 7.16 | 7.04 | 6.84 | 6.44 | 5.24 | 400 |",
        "| 5 | 14.3 | 14.2 | 14.0 | 13.6 | 12.4 | 800 |"
      )
    ) assert(rows(row), row)
    assert(
      rows("| `0x0104`, four bytes | two bytes with the prescaler less one, then 0x14 0x22: 25 quanta |")
    )
  }

  it should "name the registers that tell of a break" in {
    val text = RingPage.text
    for (
      place <- Seq("`0x0012`[1:0]", "`0x0012`[2]", "`0x0013`[2]", "`0x0013`[6]", "`0x0040`[5]", "`0x002C`")
    )
      assert(text.contains(place), place)
  }
}

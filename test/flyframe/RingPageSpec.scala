package flyframe

import flyframe.fibre.Reach
import org.scalatest.flatspec.AnyFlatSpec
import scala.sys.process.Process

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

  // A program of Debian's can-utils; its controllers have 16 quanta before the sample point at most.
  it should "set bit rates as can-calc-bit-timing does, as far as that goes" in {
    val own = 100.0 * (1 + RingPage.timing.tseg1) / RingPage.timing.length
    for (clock <- Seq(50, 100); kbps <- Reach.Rates.filter(_ >= 125)) {
      val command = s"can-calc-bit-timing -q -c ${clock}000000 -b ${kbps}000 -s ${(10 * own).round}"
      // Nominal rate, quantum, segments (3), SJW, prescaler, real rate, its error, both sample points, ...
      val rows =
        Process(command).!!.linesIterator.map(_.trim.split(" +").toSeq).filter(_.head == s"${kbps}000").toSeq
      assert(rows.nonEmpty, command)
      for (row <- rows) {
        val Seq(propagation, phase1, phase2) = row.slice(2, 5).map(_.toInt)
        val (before, length)                 = (1 + propagation + phase1, 1 + propagation + phase1 + phase2)
        assert(row(7) == s"${kbps}000" && row(8) == "0.0%", row)
        assert(row(6).toInt * length == RingPage.prescaler(clock, kbps) * RingPage.timing.length, row)
        val far = own - 100.0 * before / length
        assert(far.abs <= 100.0 / length || propagation + phase1 == 16, row)
      }
    }
  }

  it should "name the registers that tell of a break" in {
    val text = RingPage.text
    for (
      place <- Seq("`0x0012`[1:0]", "`0x0012`[2]", "`0x0013`[2]", "`0x0013`[6]", "`0x0040`[5]", "`0x002C`")
    )
      assert(text.contains(place), place)
  }
}

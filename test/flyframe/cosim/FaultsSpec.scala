package flyframe.cosim

import org.scalatest.flatspec.AnyFlatSpec
import flyframe.{TestSets, Tier}

/** Five slaves in OP while one cable after the other is bad, and a ring that is cut in mid-frame. `make
  * faults` takes any number of cycles from any seed.
  */
class FaultsSpec extends AnyFlatSpec {
  private val harness = new Harness("faults", TestSets.faults)

  private val tier =
    Tier("Five slaves behind cables that fail, in OP", "cycles of the master", test = 500, soak = 40000)
  private val Seed = 1L

  private def run(part: String, weight: Long, more: String*): Unit = {
    val cycles = tier.share(weight, 10)
    val text   = tier.run(part, cycles, Some(Seed))(harness.faults(cycles, Seed, more: _*))
    assert("cycles (\\d+)".r.findFirstMatchIn(text).exists(_.group(1).toLong >= cycles), text)
  }

  "ERR-02, ERR-08, ERR-11: slaves behind a bad cable" should "be right, count where it is, and come back" in
    run("line", 8)

  it should "do so with an error in every second frame" in run("line, many errors", 1, "--bit-errors", "3000")

  "LP-07: a ring" should "lose at most the frame in which it is cut or mended" in run("ring", 1, "--ring")
}

package flyframe.cosim

import org.scalatest.flatspec.AnyFlatSpec
import flyframe.{TestSets, Tier}

/** SyncManagers between bus and host: no torn, lost or doubled buffer, whatever the timing. `make smsoak`
  * takes any number of steps from any seed.
  */
class SmSoakSpec extends AnyFlatSpec {
  private val plan    = TestSets.soak
  private val harness = new Harness("smsoak", plan.map(_._1))

  private val tier =
    Tier("SyncManagers between bus and host, at random", "steps", test = 200000, soak = 20000000)
  private val Seed = 1L

  for ((p, weight) <- plan) {
    val steps = tier.share(weight, plan.map(_._2).sum)
    s"SM-12 to SM-20, B-59: ${p.preset}" should s"take $steps steps of bus and host" in {
      val text = tier.run(p.preset, steps, Some(Seed))(harness.soak(p, steps, Seed))
      assert("steps (\\d+)".r.findFirstMatchIn(text).exists(_.group(1).toLong >= steps), text)
    }
  }
}

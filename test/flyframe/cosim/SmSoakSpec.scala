package flyframe.cosim

import org.scalatest.flatspec.AnyFlatSpec
import flyframe.TestSets

/** SyncManagers between bus and host: no torn, lost or doubled buffer, whatever the timing. 10 million steps;
  * `make smsoak` takes any number from any seed.
  */
class SmSoakSpec extends AnyFlatSpec {
  private val plan    = TestSets.soak
  private val harness = new Harness("smsoak", plan.map(_._1))

  assert(plan.map(_._2).sum >= 10000000)
  for ((p, steps) <- plan)
    s"SM-12 to SM-20, B-59: ${p.preset}" should s"take $steps steps of bus and host" in {
      val text = harness.soak(p, steps, seed = 1)
      assert("steps (\\d+)".r.findFirstMatchIn(text).exists(_.group(1).toLong >= steps), text)
    }
}

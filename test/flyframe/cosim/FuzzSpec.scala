package flyframe.cosim

import org.scalatest.flatspec.AnyFlatSpec
import flyframe.TestSets
import flyframe.model.FuzzVectors

/** Random frames, RTL against the golden model: 100,000 and more. `make fuzz` plays any number from any seed.
  */
class FuzzSpec extends AnyFlatSpec {
  private val plan    = TestSets.fuzz
  private val harness = new Harness("fuzz", plan.map(_._1))

  assert(plan.map(_._2).sum >= 100000)
  for ((p, frames) <- plan)
    s"FP, LP, ERR${if (p.hasAlarm) ", AP, ALARM, DET" else ""}: ${p.preset}" should s"answer $frames random frames as the model does" in {
      val last = harness.play(s"${p.preset}.vectors")(FuzzVectors.write(p, seed = 20261121, frames, _))
      assert(last.contains("differences 0"), last)
      assert("frames (\\d+)".r.findFirstMatchIn(last).exists(_.group(1).toInt >= frames), last)
    }
}

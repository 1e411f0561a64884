package flyframe.cosim

import org.scalatest.flatspec.AnyFlatSpec
import flyframe.{TestSets, Tier}
import flyframe.model.FuzzVectors

/** Random frames, RTL against the golden model. `make fuzz` plays any number from any seed. */
class FuzzSpec extends AnyFlatSpec {
  private val plan    = TestSets.fuzz
  private val harness = new Harness("fuzz", plan.map(_._1))

  private val tier = Tier("random frames, RTL against the model", "frames", test = 10000, soak = 300000)
  private val Seed = 20261121L

  for ((p, weight) <- plan) {
    val frames = tier.share(weight, plan.map(_._2).sum).toInt
    val rules  = "FP, LP, ERR" + (if (p.hasAlarm) ", AP, ALARM, DET" else "")
    s"$rules: ${p.preset}" should s"answer $frames random frames as the model does" in {
      val last = tier.run(p.preset, frames, Some(Seed)) {
        harness.play(s"${p.preset}.vectors")(FuzzVectors.write(p, Seed, frames, _))
      }
      assert(last.contains("differences 0"), last)
      assert("frames (\\d+)".r.findFirstMatchIn(last).exists(_.group(1).toInt >= frames), last)
    }
  }
}

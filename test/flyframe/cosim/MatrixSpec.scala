package flyframe.cosim

import org.scalatest.flatspec.AnyFlatSpec
import flyframe.TestSets
import flyframe.model.{FuzzVectors, VectorWriter}
import flyframe.rules.{
  AlarmRules,
  ApplicationRules,
  FmmuRules,
  FrameRules,
  LedRules,
  ModelBench,
  PortRules,
  Steps,
  SyncManagerRules
}

/** Every point of {dataBusWidth 8, 16, 32} x {ports 1, 2, 4} x {maxSubTelegrams 1, 15, 128} x {nodeIdWidth 8,
  * 16}, and of FMMUs 0 to 16 x SyncManagers 0 to 16, and nine alarm slaves that have each pair of
  * {dataBusWidth 8, 16, 32}, {maxSubTelegrams 1, 4, 15} and {nodeIdWidth 4, 8, 16}: elaborates, lints clean,
  * and behaves as the model does in all rule tests (which assert on the model) and in random frames.
  */
class MatrixSpec extends AnyFlatSpec {
  private val rules =
    FrameRules.all ++ PortRules.all ++ FmmuRules.all ++ SyncManagerRules.all ++ ApplicationRules.all ++ LedRules.all ++
      AlarmRules.all
  private val harness = new Harness("matrix", TestSets.matrix)

  "All points of the parameter matrix" should "elaborate and lint clean" in {
    harness.build
    assert(harness.lint().linesIterator.toSeq.last == s"${TestSets.matrix.size} passed, 0 failed")
  }

  // The vectors know no EEPROM.
  for (p <- TestSets.matrix if !p.hasSii)
    s"Point ${p.preset}" should "pass the rule tests and random frames" in {
      val last = harness.play(s"${p.preset}.vectors") { out =>
        val bench = new ModelBench(p, model => Some(new VectorWriter(p, 1, out, model)))
        for (rule <- rules if rule.needs(p) && !rule.usesTime) {
          out.println(s"# ${rule.name}")
          bench.reset()
          rule.run(new Steps(bench))
        }
        FuzzVectors.write(p, seed = p.hashCode, count = if (p.hasAlarm) 1000 else 300, out)
      }
      assert(last.contains("differences 0"), last)
    }
}

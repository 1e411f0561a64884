package flyframe.cosim

import org.scalatest.flatspec.AnyFlatSpec
import flyframe.{TestSets, Tier}
import flyframe.model.{FuzzVectors, VectorWriter}
import flyframe.params.EscParams
import flyframe.registers.AlarmRegisters
import flyframe.rules.{
  AlarmRules,
  ApplicationRules,
  FmmuRules,
  FrameRules,
  LedRules,
  ModelBench,
  PortRules,
  Rule,
  Steps,
  SyncManagerRules
}

/** Parameter sets of all kinds elaborate, lint clean, and behave as the model does in the rule tests (which
  * assert on the model) and in random frames.
  *
  * In `make test` a sample in which each pair of values of two parameters stands, of which a third is
  * compiled, and what its pairs leave out ([[flyframe.TestSets.besidePairs]]). In `make soak` also every
  * point of {dataBusWidth 8, 16, 32} x {ports 1, 2, 4} x {maxSubTelegrams 1, 15, 128} x {nodeIdWidth 8, 16},
  * FMMUs 0 to 16 x SyncManagers 0 to 16, and alarm slaves ([[flyframe.TestSets.matrix]]).
  */
class MatrixSpec extends AnyFlatSpec {
  private val plain = FrameRules.all ++ PortRules.all
  private val units = FmmuRules.all ++ SyncManagerRules.all ++ ApplicationRules.all ++ LedRules.all

  /** The rule tests of the units send several datagrams in a frame, those of the alarm slave know nothing of
    * other units; elsewhere there are random frames only.
    */
  private def rules(p: EscParams): Seq[Rule] = {
    val others = p.translates || p.hasApplicationLayer
    val all =
      if (p.hasAlarm) { if (others || p.ports != 2) Nil else plain ++ AlarmRules.all }
      else if (others && p.maxSubTelegrams == 1) plain
      else plain ++ units
    all.filter(rule => rule.needs(p) && !rule.usesTime)
  }
  private val sample = TestSets.sample ++ TestSets.besidePairs
  private val whole  = TestSets.sample ++ TestSets.matrix
  private val tier   = Tier("parameter sets", "sets", test = sample.size, soak = whole.size)
  private val frames = Tier("random frames per parameter set", "frames", test = 100, soak = 400)
  private val points = if (Tier.isSoak) whole else sample

  // Nobody waits for frames here, but for the compiler: of the pairs one set in three is compiled in
  // `make test`.
  private val (played, emittedOnly) =
    points.partition(p => Tier.isSoak || TestSets.sample.indexOf(p) % 3 <= 0)
  private val harness = new Harness("matrix", played, "COSIM_OPT=-O1")
  private val others  = new Harness("matrix-others", emittedOnly)

  s"The ${points.size} parameter sets" should "elaborate and lint clean" in {
    tier.run("elaborated, linted", points.size) {
      for ((h, sets) <- Seq(harness -> played, others -> emittedOnly) if sets.nonEmpty) {
        h.emitted
        assert(h.lint().linesIterator.toSeq.last == s"${sets.size} passed, 0 failed")
      }
    }
  }

  // The simulator drives the host port.
  "The host interfaces" should "elaborate and lint clean" in {
    val sets       = TestSets.hosts ++ TestSets.digital
    val interfaces = new Harness("host-interfaces", sets)
    interfaces.emitted
    assert(interfaces.lint().linesIterator.toSeq.last == s"${sets.size} passed, 0 failed")
  }

  // What they do is shown by the suites of their units and by RingNodeSpec.
  "The nodes of a fibre ring" should "elaborate and lint clean" in {
    val rings = new Harness("ring-nodes", TestSets.rings)
    rings.emitted
    assert(rings.lint().linesIterator.toSeq.last == s"${TestSets.rings.size} passed, 0 failed")
  }

  // The vectors know no EEPROM.
  for (p <- played if !p.hasSii)
    s"Parameter set ${p.preset}" should s"pass ${rules(p).size} rule tests and random frames" in {
      val count = frames.size.toInt * (if (p.hasAlarm) 3 else 1)
      val last  = frames.run(p.preset, count, Some(p.hashCode))(play(p, count))
      assert(last.contains("differences 0"), last)
    }

  private def play(p: EscParams, count: Int): String =
    harness.play(s"${p.preset}.vectors") { out =>
      val bench = new ModelBench(p, model => Some(new VectorWriter(p, 1, out, model)))
      for (rule <- rules(p)) {
        out.println(s"# ${rule.name}")
        bench.reset()
        if (p.hasAlarm && plain.contains(rule)) bench.hostWrite(AlarmRegisters.Enable, 0) // it may take long
        rule.run(new Steps(bench))
      }
      FuzzVectors.write(p, seed = p.hashCode, count, out)
    }
}

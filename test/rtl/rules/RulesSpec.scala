package flyframe.rules

import chiseltest._
import org.scalatest.flatspec.AnyFlatSpec
import scala.util.Try
import flyframe.{ControllerUnderTest, RtlBench, Simulation, TestSets, Tier}
import flyframe.params.EscParams

/** All rule tests, on the golden model and on the RTL of several parameter sets. */
class RulesSpec extends AnyFlatSpec with ChiselScalatestTester {
  private val rules =
    FrameRules.all ++ PortRules.all ++ FmmuRules.all ++ SyncManagerRules.all ++ ApplicationRules.all ++
      WatchdogRules.all ++ LedRules.all ++ OutputRules.all ++ ClockRules.all

  private val sets = TestSets.rules
  private def rulesFor(p: EscParams) =
    ((if (p.isDigitalIo) DigitalRules.all
      else if (p.acknowledgesByWrite && p.hasAlarm) AlarmRules.all ++ AcknowledgeRules.all
      else if (p.acknowledgesByWrite) AcknowledgeRules.all ++ ClockRules.all ++ FrameRules.all
      else if (p.savesClockPower) ClockRules.all
      else if (p.hasClocks) ClockRules.all ++ ApplicationRules.all
      else if (p.hasAlarm) AlarmRules.all ++ ApplicationRules.all
      else if (p.hasEmulation) EmulationRules.all
      else if (p.hasI2c) EepromRules.all
      else rules) ++ MiRules.all ++ LinkRules.all ++ ResetRules.all ++ ProtectionRules.all)
      .filter(_.needs(p))

  for (
    p    <- sets;
    rule <- rulesFor(p)
  )
    s"${rule.name} [model, ${p.preset}]" should "hold" in rule.run(new Steps(new ModelBench(p)))

  // In `make test` one of those that differ in widths, clocks, or the host's interface only, which are in
  // MatrixSpec, too; and none whose few rules others have, too.
  private val variants = Set("units", "clocks-32", "alarm-16", "eeprom-25", "wishbone", "avalon", "bus") ++
    Set("alarm-25", "emulation-25", "digital-in", "digital-min")
  private val tier =
    Tier("rules on RTL", "sets", test = sets.count(p => !variants(p.preset)), soak = sets.size)
  private val simulated = if (Tier.isSoak) sets else sets.filterNot(p => variants(p.preset))

  // One simulation per parameter set; each rule reports its own result.
  for (p <- simulated) {
    val mine = rulesFor(p)
    lazy val results: Map[String, Try[Unit]] = {
      var found = Map.empty[String, Try[Unit]]
      tier.run(p.preset, 1) {
        test(new ControllerUnderTest(p)).withAnnotations(Simulation.annotations(this, p.preset)) { dut =>
          val bench = new RtlBench(dut, p)
          mine.foreach { rule =>
            bench.reset()
            found += rule.name -> Try(rule.run(new Steps(bench)))
          }
        }
      }
      found
    }
    for (rule <- mine) s"${rule.name} [RTL, ${p.preset}]" should "hold" in results(rule.name).get
  }
}

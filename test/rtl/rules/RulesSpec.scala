package flyframe.rules

import chiseltest._
import chiseltest.simulator.VerilatorBackendAnnotation
import org.scalatest.flatspec.AnyFlatSpec
import scala.util.Try
import flyframe.{ControllerUnderTest, RtlBench}
import flyframe.params.{EscParams, Presets}

/** All rule tests, on the golden model and on the RTL of several parameter sets. */
class RulesSpec extends AnyFlatSpec with ChiselScalatestTester {
  private val rules =
    FrameRules.all ++ PortRules.all ++ FmmuRules.all ++ SyncManagerRules.all ++ ApplicationRules.all ++
      WatchdogRules.all ++ LedRules.all ++ OutputRules.all

  private def preset(name: String) = Presets.named(name).get.params.copy(temporaryLoopMs = 1)
  private val sets = Seq(
    preset("cyclone4-min"),
    preset("cyclone4-min")
      .copy(preset = "four-25", ports = 4, ramKiB = 8, coreClockMhz = 25, dataBusWidth = 32),
    preset("cyclone4-min")
      .copy(preset = "wide-50", coreClockMhz = 50, dataBusWidth = 16, maxSubTelegrams = 4, nodeIdWidth = 8)
  )

  private val units = preset("cyclone4-min")
    .copy(
      preset = "units",
      ramKiB = 8,
      fmmus = 8,
      fmmuBitwise = 1,
      syncManagers = 8,
      applicationLayer = 1,
      watchdogs = 1,
      digitalOutputs = 4
    )
  private val unitSets = Seq(
    units,
    units.copy(
      preset = "units-16",
      watchdogs = 1,
      leds = 1,
      dataBusWidth = 32,
      fmmus = 16,
      fmmuBitwise = 0,
      syncManagers = 16,
      coreClockMhz = 125
    )
  )

  // With an EEPROM only the rules that speak of it: its load takes time after every reset.
  private val eeprom = preset("cyclone4-min").copy(
    preset = "eeprom-25",
    coreClockMhz = 25,
    applicationLayer = 1,
    leds = 1,
    sii = 1,
    siiClockKhz = 1000,
    siiStartUs = 1
  )
  private val eepromSets = Seq(
    eeprom,
    eeprom.copy(
      preset = "eeprom-100",
      coreClockMhz = 100,
      dataBusWidth = 32,
      ramKiB = 8,
      fmmus = 8,
      syncManagers = 8,
      watchdogs = 1
    )
  )
  private val emulated = Seq(
    eeprom.copy(preset = "emulation-25", sii = 2),
    units.copy(preset = "emulation-100", sii = 2, siiStartUs = 1, dataBusWidth = 16)
  )
  private val alarms = Seq(
    preset("cyclone4-min").copy(preset = "alarm", alarm = 1),
    preset("cyclone4-min")
      .copy(preset = "alarm-16", alarm = 1, maxSubTelegrams = 1, dataBusWidth = 16, nodeIdWidth = 8),
    preset("cyclone4-min").copy(
      preset = "alarm-25",
      alarm = 1,
      maxSubTelegrams = 4,
      dataBusWidth = 32,
      nodeIdWidth = 8,
      coreClockMhz = 25,
      applicationLayer = 1
    )
  )
  private def rulesFor(p: EscParams) =
    (if (p.hasAlarm) AlarmRules.all
     else if (p.hasEmulation) EmulationRules.all
     else if (p.hasI2c) EepromRules.all
     else rules).filter(_.needs(p))

  for (
    p    <- sets ++ unitSets ++ eepromSets ++ emulated ++ alarms;
    rule <- rulesFor(p)
  )
    s"${rule.name} [model, ${p.preset}]" should "hold" in rule.run(new Steps(new ModelBench(p)))

  // One simulation per parameter set; each rule reports its own result.
  for (p <- sets ++ unitSets ++ eepromSets ++ emulated ++ alarms) {
    val mine = rulesFor(p)
    lazy val results: Map[String, Try[Unit]] = {
      var found = Map.empty[String, Try[Unit]]
      test(new ControllerUnderTest(p)).withAnnotations(Seq(VerilatorBackendAnnotation)) { dut =>
        val bench = new RtlBench(dut, p)
        mine.foreach { rule =>
          bench.reset()
          found += rule.name -> Try(rule.run(new Steps(bench)))
        }
      }
      found
    }
    for (rule <- mine) s"${rule.name} [RTL, ${p.preset}]" should "hold" in results(rule.name).get
  }
}

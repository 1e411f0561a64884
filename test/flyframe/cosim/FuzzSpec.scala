package flyframe.cosim

import org.scalatest.flatspec.AnyFlatSpec
import flyframe.model.FuzzVectors
import flyframe.params.{EscParams, Presets}

/** Random frames, RTL against the golden model: 100,000 and more. `make fuzz` plays any number from any seed.
  */
class FuzzSpec extends AnyFlatSpec {
  private def preset(name: String): EscParams = Presets.named(name).get.params
  private val min                             = preset("cyclone4-min")

  // The EEPROM's answers take time, which the model does not know: the RAM is opened by pin.
  private val complete = preset("slave").copy(preset = "complete", sii = 0, digitalOutputs = 4)

  // Presets, and every core clock with another bus width.
  private val plan: Seq[(EscParams, Int)] = Seq(
    min                                                                     -> 50000,
    min.copy(preset = "four", ports = 4, ramKiB = 8, maxSubTelegrams = 128) -> 10000,
    complete                                                                -> 30000,
    complete.copy(
      preset = "complete-125",
      coreClockMhz = 125,
      dataBusWidth = 32,
      fmmus = 16,
      syncManagers = 16,
      digitalOutputs = 2,
      ports = 3
    ) -> 10000,
    complete.copy(
      preset = "complete-3",
      dataBusWidth = 16,
      fmmus = 3,
      fmmuBitwise = 0,
      digitalOutputs = 3,
      syncManagers = 2,
      ramKiB = 1,
      watchdogs = 0,
      leds = 0
    )                                                                                           -> 10000,
    preset("frame-processor")                                                                   -> 10000,
    min.copy(preset = "mhz25", coreClockMhz = 25, ports = 3, maxSubTelegrams = 128)             -> 10000,
    min.copy(preset = "mhz25-32", coreClockMhz = 25, dataBusWidth = 32, nodeIdWidth = 12)       -> 5000,
    min.copy(preset = "mhz50-16", coreClockMhz = 50, dataBusWidth = 16, ramKiB = 3)             -> 5000,
    min.copy(preset = "mhz125-8", coreClockMhz = 125, ports = 1, txShift = 3)                   -> 5000,
    preset("alarm-slave")                                                                       -> 20000,
    complete.copy(preset = "complete-alarm", alarm = 1, dataBusWidth = 16, maxSubTelegrams = 4) -> 3000,
    min.copy(preset = "mhz100-32", dataBusWidth = 32, ramKiB = 60, registerWritesPerFrame = 16) -> 5000
  )
  private val harness = new Harness("fuzz", plan.map(_._1))

  assert(plan.map(_._2).sum >= 100000)
  for ((p, frames) <- plan)
    s"FP, LP, ERR${if (p.hasAlarm) ", AP, ALARM, DET" else ""}: ${p.preset}" should s"answer $frames random frames as the model does" in {
      val last = harness.play(s"${p.preset}.vectors")(FuzzVectors.write(p, seed = 20261121, frames, _))
      assert(last.contains("differences 0"), last)
      assert("frames (\\d+)".r.findFirstMatchIn(last).exists(_.group(1).toInt >= frames), last)
    }
}

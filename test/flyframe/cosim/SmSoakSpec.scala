package flyframe.cosim

import org.scalatest.flatspec.AnyFlatSpec
import flyframe.params.{EscParams, Presets}

/** SyncManagers between bus and host: no torn, lost or doubled buffer, whatever the timing. 10 million steps;
  * `make smsoak` takes any number from any seed.
  */
class SmSoakSpec extends AnyFlatSpec {
  import SmSoak._

  assert(plan.map(_._2).sum >= 10000000)
  for ((p, steps) <- plan)
    s"SM-12 to SM-20, B-59: ${p.preset}" should s"take $steps steps of bus and host" in {
      val text = harness.soak(p, steps, seed = 1)
      assert("steps (\\d+)".r.findFirstMatchIn(text).exists(_.group(1).toLong >= steps), text)
    }
}

object SmSoak {

  // As the preset `slave`, but for what only costs time here: further ports, LEDs, the EEPROM's start.
  private val small = Presets
    .named("slave")
    .get
    .params
    .copy(preset = "smsoak", ports = 1, leds = 0, watchdogs = 0, sii = 0, ramKiB = 1, maxSubTelegrams = 128)

  // Host words of four bytes, each byte an access of its own to the SyncManagers; another core clock.
  private val wide = small.copy(preset = "smsoak-wide", dataBusWidth = 32, coreClockMhz = 125)

  val plan: Seq[(EscParams, Long)] = Seq(small -> 9500000L, wide -> 500000L)
  lazy val harness                 = new Harness("smsoak", plan.map(_._1))

  /** Builds the program. */
  def main(arguments: Array[String]): Unit = harness.soakProgram
}

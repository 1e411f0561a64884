package flyframe.can

import chiseltest._
import flyframe.Simulation
import org.scalatest.flatspec.AnyFlatSpec
import scala.util.Random

/** The bit timing alone beside the model's, at any levels: edges at all distances, far more of them than a
  * bus has.
  */
class BitTimingSpec extends AnyFlatSpec with ChiselScalatestTester {

  /** Bits of nobody: what happens in a cycle. */
  private class Watched extends BitStream {
    var ends     = false
    var sample   = Option.empty[Boolean]
    var restarts = false
    var isHard   = false
    var level    = true

    def begins(): Unit              = ends = true
    def samples(bit: Boolean): Unit = sample = Some(bit)
    def hardSynchronises(): Unit    = restarts = true
    def clear(): Unit = {
      ends = false
      restarts = false
      sample = None
    }
  }

  "CAN-01 to CAN-06, CB-02: bits" should "be found as by the model, whatever is heard" in
    test(new BitTiming).withAnnotations(Simulation.annotations(this, "timing")) { dut =>
      val random  = new Random(1)
      var samples = 0
      for (_ <- 1 to 60) {
        val length = random.between(8, 30)
        val tseg2  = random.between(1, (length - 2 min 16) + 1)
        val tseg1  = length - 1 - tseg2
        val setting =
          BitSetting(tseg1, tseg2, random.between(1, tseg2 + 1), tseg1 > 1 && random.nextBoolean())
        val prescaler = random.between(1, 4)
        val bits      = new Watched
        val model     = new BitTimingModel(setting, bits)
        dut.run.poke(false)
        dut.setting.prescaler.poke(prescaler - 1)
        dut.setting.tseg1.poke(tseg1 - 1)
        dut.setting.tseg2.poke(tseg2 - 1)
        dut.setting.sjw.poke(setting.sjw - 1)
        dut.threeSamples.poke(setting.threeSamples)
        dut.heard.poke(true)
        dut.clock.step(3)
        dut.run.poke(true)
        var heard = true
        val calm  = 1 + random.nextInt(2 * length)
        for (cycle <- 1 to 60 * length) {
          if (random.nextInt(calm) == 0) heard = !heard
          dut.heard.poke(heard)
          dut.hard.poke(bits.isHard)
          dut.dominant.poke(!bits.level)
          bits.clear()
          if (cycle % prescaler == 0) model.quantum(heard)
          val what = s"cycle $cycle of $setting, prescaler $prescaler"
          dut.ends.expect(bits.ends, what)
          dut.restarts.expect(bits.restarts, what)
          dut.sample.valid.expect(bits.sample.nonEmpty, what)
          bits.sample.foreach(dut.sample.bits.expect(_, what))
          samples += bits.sample.size
          dut.clock.step()
          // The next bit is one that synchronises hard, or in which something is driven, or not.
          if (bits.ends) {
            bits.isHard = random.nextInt(4) == 0
            bits.level = bits.isHard || random.nextBoolean()
          }
        }
      }
      assert(samples > 2000)
    }
}

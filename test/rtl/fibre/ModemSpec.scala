package flyframe.fibre

import chiseltest._
import flyframe.params.FibreParams
import org.scalatest.flatspec.AnyFlatSpec
import scala.util.Random

/** Modulator and fast demodulator, cycle by cycle against the golden model. */
class ModemSpec extends AnyFlatSpec with ChiselScalatestTester {
  private val tones = Seq(Tone.Dominant, Tone.Recessive, Tone.Search, Tone.Dark)

  for (p <- Seq(FibreParams(), FibreParams(coreClockMhz = 50))) {
    s"FR-01, FR-02, FB-01: a modulator at ${p.coreClockMhz} MHz" should "be that of the model" in
      test(new Modulator(p)) { dut =>
        val model  = new ModulatorModel(p)
        val random = new Random(p.coreClockMhz)
        var lit    = 0
        for (_ <- 0 until 600) {
          val code = random.nextInt(4)
          dut.tone.poke(code)
          for (_ <- 0 until 1 + random.nextInt(if (random.nextBoolean()) 4 else 80)) {
            model.step(tones(code))
            dut.clock.step()
            assert(dut.light.peekBoolean() == model.light)
            if (model.light) lit += 1
          }
        }
        assert(lit > 1000)
      }

    s"FR-04: a demodulator at ${p.coreClockMhz} MHz" should "be that of the model" in
      test(new FastDemodulator(p)) { dut =>
        val model   = new FastDemodulatorModel(p)
        val random  = new Random(4 + p.coreClockMhz)
        var changes = 0
        var light   = false
        var left    = 0
        var most    = 3
        for (cycle <- 0 until 20000) {
          if (cycle % 50 == 0) most = 1 + random.nextInt(10)
          val before = model.level
          val samples = for (_ <- 0 until p.samplesPerCycle) yield {
            if (left == 0) { light = !light; left = 1 + random.nextInt(most) }
            left -= 1
            model.sample(light)
            light
          }
          dut.odd.poke(false)
          dut.samples.poke(samples.zipWithIndex.collect { case (true, i) => 1 << i }.sum)
          dut.clock.step()
          assert(dut.level.peekBoolean() == model.level)
          if (model.level != before) changes += 1
        }
        assert(changes > 100)
      }
  }
}

package flyframe.relay

import chisel3._
import chisel3.util.Valid
import chiseltest._
import flyframe.Simulation
import flyframe.can.{BitStream, BitTimingModel}
import org.scalatest.flatspec.AnyFlatSpec
import scala.util.Random

/** [[LinkBits]] with what its setting becomes. */
class LinkBitsUnderTest extends Module {
  val length  = IO(Input(UInt(8.W))) // of a bit
  val restart = IO(Input(Bool()))
  val heard   = IO(Input(Bool()))
  val hard    = IO(Input(Bool()))
  val sample  = IO(Output(Valid(Bool())))

  private val unit = Module(new LinkBits)
  unit.setting := LinkSetting.of(length)
  unit.restart := restart
  unit.heard   := heard
  unit.hard    := hard
  sample       := unit.sample
}

class LinkBitsSpec extends AnyFlatSpec with ChiselScalatestTester {
  "FR-40, RB-05: bits of every length" should "be sampled as by the model, whatever is heard" in
    test(new LinkBitsUnderTest).withAnnotations(Simulation.annotations(this, "bits")) { dut =>
      val random  = new Random(1)
      var samples = 0
      for (cycles <- 25 to 250 by 5) {
        var sample  = Option.empty[Boolean]
        var hardNow = false
        val bits = new BitStream {
          def begins(): Unit              = ()
          def samples(bit: Boolean): Unit = sample = Some(bit)
          def isHard: Boolean             = hardNow
          def hardSynchronises(): Unit    = ()
          def level: Boolean              = true
        }
        val model = new BitTimingModel(LinkTiming(cycles).setting, bits)
        dut.length.poke(cycles)
        dut.restart.poke(false)
        dut.heard.poke(true)
        dut.clock.step(2)
        var heard = true
        val calm  = 1 + random.nextInt(2 * cycles)
        for (cycle <- 0 until 40 * cycles) {
          if (random.nextInt(calm) == 0) heard = !heard
          if (random.nextInt(cycles) == 0) hardNow = !hardNow
          dut.restart.poke(cycle == 0)
          dut.heard.poke(heard)
          dut.hard.poke(hardNow)
          sample = None
          model.quantum(heard)
          dut.sample.valid.expect(sample.nonEmpty, s"cycle $cycle of bits of $cycles")
          sample.foreach(dut.sample.bits.expect(_))
          samples += sample.size
          dut.clock.step()
        }
      }
      assert(samples > 1000)
    }
}

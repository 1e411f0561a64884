package flyframe.master

import scala.util.Random
import chiseltest._
import flyframe.SharedSimulation
import org.scalatest.flatspec.AnyFlatSpec

class HeldCounterSpec extends AnyFlatSpec with SharedSimulation {
  together("counter", new HeldCounter(16))(
    "REP-01: a count stands still while it is read, and loses nothing" -> { dut =>
      val random = new Random(1)
      var pulses = 0
      for (_ <- 1 to 500) {
        val seen = dut.value.peekInt()
        val hold = random.nextInt(20)
        for (i <- 0 until hold + random.nextInt(10) + 1) {
          dut.holds.poke(i < hold)
          // At most one pulse while it is held, and none in the cycle behind, which is for that one.
          val pulse = i == hold / 2 || (i > hold + 1 && random.nextBoolean())
          dut.count.poke(pulse)
          if (pulse) pulses += 1
          if (i > 0 && i <= hold) assert(dut.value.peekInt() == seen)
          dut.clock.step()
          if (i == 0 && hold > 0) assert(dut.value.peekInt() == seen)
        }
        dut.count.poke(false)
        dut.holds.poke(false)
        dut.clock.step()
        assert(dut.value.peekInt() == pulses % 65536)
      }
    }
  )
}

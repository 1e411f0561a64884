package flyframe.port

import chiseltest._
import org.scalatest.flatspec.AnyFlatSpec

class SlotTimerSpec extends AnyFlatSpec with ChiselScalatestTester {

  /** Cycles, counted from now, in which the tick is high. `reference` tells the pin's level in each cycle. */
  private def ticks(dut: SlotTimer, length: Int, reference: Int => Boolean): Seq[Int] =
    (0 until length).filter { c =>
      dut.reference.poke(reference(c))
      val now = dut.tick.peekBoolean()
      dut.clock.step()
      now
    }

  for (cycles <- Seq(1, 2, 4, 5)) {
    s"A slot of $cycles core cycles" should "tick once per slot with the reference tied low" in
      test(new SlotTimer(cycles)) { dut =>
        val found = ticks(dut, 20 * cycles, _ => false)
        assert(found.size == 20)
        assert(found.zip(found.drop(1)).forall { case (a, b) => b - a == cycles })
      }

    if (cycles > 1)
      it should "follow the reference from any phase, always with the same delay" in {
        val phases = (0 until cycles).map { phase =>
          var found = Seq.empty[Int]
          test(new SlotTimer(cycles)) { dut =>
            dut.clock.step(cycles) // the pin is low meanwhile
            // High for half a slot, a single cycle in the shortest.
            found = ticks(dut, 20 * cycles, c => (c + cycles - phase) % cycles < (cycles / 2 max 1))
          }
          val settled = found.filter(_ >= 4 * cycles)
          assert(settled.zip(settled.drop(1)).forall { case (a, b) => b - a == cycles }, s"phase $phase")
          assert(settled.size == 16, s"phase $phase")
          (settled.head - phase) % cycles
        }
        assert(phases.distinct.size == 1, s"delays $phases")
      }
  }
}

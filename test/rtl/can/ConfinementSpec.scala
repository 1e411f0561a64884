package flyframe.can

import chisel3._
import chiseltest._
import org.scalatest.flatspec.AnyFlatSpec

class ConfinementSpec extends AnyFlatSpec with ChiselScalatestTester {

  /** The counters, two cycles and more between steps. */
  private class Bench(dut: Confinement) {
    private val all = dut.steps
    for (s <- Seq(all.tecUp8, all.tecDown1, all.recUp1, all.recUp8, all.recDown1, dut.clear)) s.poke(false)
    dut.clock.step(2)

    private val passive = dut.passiveBehind
    private val behind =
      Map(all.tecUp8 -> passive.tecUp8, all.recUp1 -> passive.recUp1, all.recUp8 -> passive.recUp8)

    /** States behind the step, as the next bit needs them; then the counters. */
    def step(which: Bool): (Boolean, Boolean) = {
      which.poke(true)
      val next = (behind.get(which).exists(is), is(dut.busOffNext))
      dut.clock.step()
      which.poke(false)
      dut.clock.step()
      next
    }
    def tec: Int    = dut.tec.peekInt().toInt
    def rec: Int    = dut.rec.peekInt().toInt
    def is(b: Bool) = b.peekBoolean()
  }

  "CAN-31, CAN-33: TEC" should "lead to warning, passive and bus-off, each with the step that reaches it" in
    test(new Confinement) { dut =>
      val b = new Bench(dut)
      for (n <- 1 to 32) {
        val (passive, off) = b.step(dut.steps.tecUp8)
        assert((b.tec, passive, off) == ((8 * n, n >= 16, n == 32)))
        assert((b.is(dut.warning), b.is(dut.passive), b.is(dut.busOff)) == ((n >= 12, n >= 16, n == 32)))
      }
      b.step(dut.steps.tecDown1)
      b.step(dut.steps.recUp8)
      assert((b.tec, b.rec) == ((256, 0)), "neither changes in bus-off")
      b.step(dut.clear)
      assert((b.tec, b.is(dut.busOff), b.is(dut.warning)) == ((0, false, false)))
    }

  "CAN-30, CB-07: REC" should "stop at 255 and 0, and return from passive to 119" in
    test(new Confinement) { dut =>
      val b = new Bench(dut)
      b.step(dut.steps.recDown1)
      assert(b.rec == 0)
      for (n <- 1 to 300) {
        val (passive, _) = b.step(dut.steps.recUp1)
        assert((b.rec, passive, b.is(dut.passive)) == ((n min 255, n >= 128, n >= 128)))
      }
      b.step(dut.steps.recUp8)
      assert(b.rec == 255)
      b.step(dut.steps.recDown1)
      assert((b.rec, b.is(dut.passive), b.is(dut.warning)) == ((119, false, true)))
      for (n <- 118 to 0 by -1) {
        b.step(dut.steps.recDown1)
        assert(b.rec == n)
      }
      for (n <- 1 to 15) b.step(dut.steps.recUp8)
      assert((b.rec, b.step(dut.steps.recUp8)) == ((120, (true, false))))
    }
}

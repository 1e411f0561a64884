package flyframe.board

import chisel3._
import chiseltest._
import org.scalatest.flatspec.AnyFlatSpec
import flyframe.DirectSimulation

/** [[PllReset]] on the clock of the test. */
private class PllResetBench extends Module {
  val locked = IO(Input(Bool()))
  val out    = IO(Output(Bool()))

  private val dut = Module(new PllReset)
  dut.clock  := clock
  dut.locked := locked
  out        := dut.reset
}

class PllResetSpec extends AnyFlatSpec with ChiselScalatestTester {
  private val cyclesPerMs = 50000

  "HB-07: a PLL without lock" should "be reset again and again, and left alone while it is locked" in
    test(new PllResetBench).withAnnotations(Seq(DirectSimulation)) { dut =>
      dut.clock.setTimeout(0)
      def resets(cycles: Int): Seq[Boolean] = Seq.fill(cycles) {
        dut.clock.step()
        dut.out.peekBoolean()
      }
      dut.locked.poke(true)
      dut.clock.step(5)
      assert(!resets(1000).contains(true))
      dut.locked.poke(false)
      val seen  = resets(11 * cyclesPerMs)
      val turns = seen.zip(seen.tail).count { case (a, b) => !a && b }
      assert(turns == 2) // a PLL locks within 1 ms: there is time for it between two resets
      val longest = seen.indexOf(true)
      assert(longest > 2 * cyclesPerMs && longest < 6 * cyclesPerMs)
      assert(seen.count(identity) > cyclesPerMs)
      dut.locked.poke(true)
      dut.clock.step(5)
      assert(!resets(6 * cyclesPerMs).contains(true))
    }
}

package flyframe.mi

import chisel3._
import chiseltest._
import org.scalatest.flatspec.AnyFlatSpec
import flyframe.SharedSimulation

/** LNK-08 to LNK-10, OP-17: the grid of intervals to the cycle. */
class EnhancedLinkDetectionSpec extends AnyFlatSpec with SharedSimulation {
  private val interval = 250

  private class Bench(dut: EnhancedLinkDetection) {
    for (y <- 0 to 1) {
      dut.found(y).poke(true)
      dut.rxEr(y).poke(false)
      dut.on(y).poke(true)
    }
    dut.reset.poke(true.B)
    dut.clock.step()
    dut.reset.poke(false.B)
    def link: Seq[Boolean] = Seq(0, 1).map(dut.link(_).peekBoolean())

    /** Symbols in a row at port 0; how many times its PHY was to begin anew. */
    def errors(symbols: Int): Int = {
      dut.rxEr(0).poke(true)
      var restarts = 0
      for (i <- 0 to symbols) {
        if (i == symbols) dut.rxEr(0).poke(false)
        if (dut.restarts(0).peekBoolean()) restarts += 1
        dut.clock.step()
      }
      restarts
    }
    def toTick(): Unit = {
      while (!dut.tick.peekBoolean()) dut.clock.step()
      dut.clock.step()
    }
  }
  private def check(name: String)(run: (Bench, EnhancedLinkDetection) => Unit) =
    name -> { dut: EnhancedLinkDetection => run(new Bench(dut), dut) }

  together("two ports", new EnhancedLinkDetection(2, 25))(
    check("OP-17, LNK-08: only symbols of one interval of 10 us count together") { (b, dut) =>
      for (before <- Seq(1, 16, 31)) {
        b.toTick()
        dut.clock.step(interval - 1 - before)
        assert(b.errors(before + 31) == 0 && b.link == Seq(true, true))
      }
      b.toTick()
      assert(b.errors(31) == 0)
      dut.clock.step(interval - 40)
      assert(b.errors(1) == 1 && b.link == Seq(false, true))
    },
    check("LNK-08: there is one restart, whatever comes behind the 32nd symbol") { (b, dut) =>
      b.toTick()
      assert(b.errors(3 * interval) == 1)
      dut.clock.step(3 * interval)
      assert(b.link == Seq(false, true))
    },
    check("LNK-09: the link is back when it has gone and come") { (b, dut) =>
      b.toTick()
      b.errors(32)
      assert(!b.link.head)
      b.toTick()
      dut.found(0).poke(false)
      dut.clock.step()
      dut.found(0).poke(true)
      assert(b.link.head)
      dut.clock.step()
      assert(b.link.head)
    },
    check("LNK-11: where it is off errors do nothing, and without a link neither") { (b, dut) =>
      dut.on(0).poke(false)
      b.toTick()
      assert(b.errors(100) == 0 && b.link.head)
      dut.on(0).poke(true)
      dut.found(0).poke(false)
      b.toTick()
      b.toTick()
      assert(b.errors(100) == 0)
    }
  )

  together("a reset", new PhyReset)(
    "LNK-10, B-97: lasts from the order to the second tick" -> { dut =>
      dut.tick.poke(false)
      dut.start.poke(false)
      dut.reset.poke(true.B)
      dut.clock.step()
      assert(!dut.resetN.peekBoolean())
      dut.reset.poke(false.B)
      dut.clock.step()
      assert(dut.resetN.peekBoolean())
      dut.start.poke(true)
      dut.clock.step()
      dut.start.poke(false)
      dut.clock.step()
      for (_ <- 0 until 2) {
        assert(!dut.resetN.peekBoolean())
        dut.tick.poke(true)
        dut.clock.step()
        dut.tick.poke(false)
        dut.clock.step(5)
      }
      assert(dut.resetN.peekBoolean())
    }
  )
}

package flyframe.master

import chisel3._
import chiseltest._
import flyframe.SharedSimulation
import org.scalatest.flatspec.AnyFlatSpec

/** Which slaves each end of a line reaches. */
class LineEndsSpec extends AnyFlatSpec with SharedSimulation {
  private class Ends(dut: LineEnds) {
    dut.counted.valid.poke(false)
    dut.silent.poke(false)
    dut.over.poke(false)
    dut.forget.poke(false)
    dut.expected.poke(0)
    dut.across.poke(false)
    var changes = 0
    private def pulse(b: Bool): Unit = {
      b.poke(true)
      if (dut.changed.peekBoolean()) changes += 1
      dut.clock.step()
      b.poke(false)
    }

    /** An answer, or None, of the first end, then of the second one where it is asked. */
    def cycle(first: Option[Int], second: Option[Int] = None, across: Boolean = false): Boolean = {
      def exchange(end: Int, came: Option[Int]): Unit = {
        dut.atSecond.poke(end == 1)
        came.foreach(dut.counted.bits.poke(_))
        dut.across.poke(across)
        pulse(if (came.isDefined) dut.counted.valid else dut.silent)
      }
      exchange(0, first)
      if (!(first.isDefined && across)) exchange(1, second)
      val whole = dut.whole.peekBoolean()
      pulse(dut.over)
      whole
    }
    def present: Int    = dut.present.peekInt().toInt
    def closed: Boolean = dut.closed.peekBoolean()

    /** For each position: the end that reaches it; None: nobody does. Of some it is `open`. */
    def reach(count: Int, open: Int => Boolean = _ => false): Seq[Option[Int]] = (0 until count).map { k =>
      dut.position.poke(k)
      val ends = (0 to 1).filter { end =>
        dut.atSecond.poke(end == 1)
        dut.mine.peekBoolean()
      }
      val gone = dut.gone.peekBoolean()
      assert(ends.size <= 1 && ends.isEmpty == (gone || open(k)), s"position $k")
      ends.headOption
    }
    def base: Int = {
      dut.atSecond.poke(true)
      dut.base.peekInt().toInt
    }
  }
  private val (a, b, none) = (Option(0), Option(1), Option.empty[Int])

  together("a ring", new LineEnds(64, 2))(
    "LM-04: the position of the first slave behind the cut follows from how many there were" -> { dut =>
      val e = new Ends(dut)
      e.cycle(Some(7), across = true)
      assert(e.closed && e.present == 7 && e.reach(8) == Seq.fill(7)(a) :+ none)
      for (first <- 1 to 6; second <- 1 to 7 - first) {
        assert(e.cycle(Some(first), Some(second)))
        assert(!e.closed && e.present == first + second && e.base == 7 - second)
        assert(e.reach(7) == Seq.fill(first)(a) ++ Seq.fill(7 - first - second)(none) ++ Seq.fill(second)(b))
      }
    },
    "LM-04: nobody at the first end: the ring is cut before the first slave, at once" -> { dut =>
      val e = new Ends(dut)
      e.cycle(Some(7), across = true)
      assert(e.cycle(None, Some(7)))
      assert(!e.closed && e.present == 7 && e.base == 0 && e.reach(7) == Seq.fill(7)(b))
    },
    "LM-04: nobody at either end is no cut yet; the third cycle more is" -> { dut =>
      val e = new Ends(dut)
      e.cycle(Some(7), across = true)
      for (_ <- 1 to 3) {
        assert(!e.cycle(None, None) && e.closed && e.present == 7)
      }
      e.cycle(None, None)
      assert(!e.closed && e.present == 0 && e.reach(7) == Seq.fill(7)(none))
      assert(e.cycle(None, None), "an end that is not in use is not missed")
      e.changes = 0
      e.cycle(Some(3), Some(4))
      assert(e.reach(7) == Seq.fill(3)(a) ++ Seq.fill(4)(b) && e.changes == 2)
      e.cycle(Some(3), Some(4))
      assert(e.changes == 2, "the same again is no change")
    },
    "LM-04: a ring that has just been cut: nobody is gone before the second end has had its turn" -> { dut =>
      val e = new Ends(dut)
      e.cycle(Some(7), across = true)
      for (_ <- 1 to 3) {
        assert(e.cycle(Some(3), None) && !e.closed)
        assert(e.reach(7, _ >= 3) == Seq.fill(3)(a) ++ Seq.fill(4)(none))
      }
      e.cycle(Some(3), Some(2))
      assert(e.reach(7) == Seq.fill(3)(a) ++ Seq.fill(2)(none) ++ Seq.fill(2)(b))
      e.cycle(Some(7), across = true)
      for (_ <- 1 to 4) e.cycle(Some(3), None)
      assert(e.reach(7) == Seq.fill(3)(a) ++ Seq.fill(4)(none), "it had its turns")
    },
    "LM-04: an end that misses some cycles keeps its slaves; mended, all are the first one's" -> { dut =>
      val e = new Ends(dut)
      e.cycle(Some(7), across = true)
      e.cycle(Some(3), Some(4))
      for (_ <- 1 to 3) assert(!e.cycle(None, Some(4)) && e.present == 7)
      assert(e.cycle(Some(3), Some(4)))
      for (_ <- 1 to 3) assert(!e.cycle(Some(3), None) && e.present == 7)
      assert(!e.cycle(Some(3), None) && e.present == 3 && e.reach(7) == Seq.fill(3)(a) ++ Seq.fill(4)(none))
      assert(e.cycle(Some(3), None))
      e.cycle(Some(7), across = true)
      assert(e.closed && e.reach(7) == Seq.fill(7)(a))
    },
    "LM-04: never closed: the list tells how many there are, or those that answer; never fewer" -> { dut =>
      val e = new Ends(dut)
      e.cycle(Some(2), Some(3))
      assert(e.base == 2)
      dut.expected.poke(9)
      assert(e.base == 6)
      dut.expected.poke(4)
      assert(e.base == 2)
    }
  )
}

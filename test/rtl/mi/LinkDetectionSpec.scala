package flyframe.mi

import chisel3._
import chiseltest._
import org.scalatest.Assertions
import org.scalatest.flatspec.AnyFlatSpec
import flyframe.SharedSimulation
import flyframe.params.EscParams

/** The order of its questions, with a test that answers them: LNK-04, LNK-06, B-93 to B-95. */
class LinkDetectionSpec extends AnyFlatSpec with SharedSimulation {
  private val p = EscParams(ports = 3, mi = 1, miLinkDetection = 1, fxPorts = 0x4)

  private class Bench(val dut: LinkDetection) extends Assertions {
    for (y <- 0 until 3) {
      dut.signal(y).poke(true)
      dut.restart(y).poke(false)
    }
    dut.clear.poke(false)
    dut.access.done.poke(false)
    dut.clock.step()

    /** Ends the access at hand; what it was: port, register, and the value if it was a write. */
    def answer(value: Option[Int]): (Int, Int, Option[Int]) = {
      var cycles = 0
      while (!dut.access.valid.peekBoolean()) {
        dut.clock.step()
        cycles += 1
        assert(cycles < 4, "no question")
      }
      def is(signal: UInt) = signal.peekInt().toInt
      val isWrite          = dut.access.isWrite.peekBoolean()
      val asked =
        (is(dut.access.port), is(dut.access.register), Option.when(isWrite)(is(dut.access.data)))
      dut.access.answer.poke(value.getOrElse(0xffff))
      dut.access.silent.poke(value.isEmpty && !isWrite)
      dut.access.done.poke(true)
      dut.clock.step()
      dut.access.done.poke(false)
      asked
    }
    def answers(values: Int*): Seq[(Int, Int, Option[Int])] = values.map(v => answer(Some(v)))
    def link: Seq[Boolean]                                  = (0 until 3).map(dut.link(_).peekBoolean())

    /** All three ports as they should be. */
    def round(): Unit = answers(0, 0x0101, 0x1000, 0x24, 0x100, 0, 0x0101, 0x1000, 0x24, 0x100, 0x2100, 4)
  }
  private def check(name: String)(run: Bench => Unit) = name -> { dut: LinkDetection => run(new Bench(dut)) }

  together("three ports", new LinkDetection(p))(
    check("LNK-06, B-93: a configuration that is right is read once, then the links only") { b =>
      val asked  = b.answers(0, 0x0101, 0x1000, 0x24, 0x100, 0, 0x0101, 0x1000, 0x24, 0x100, 0x2100, 4)
      val copper = Seq(9, 4, 0, 1, 5)
      assert(asked == copper.map((0, _, None)) ++ copper.map((1, _, None)) ++ Seq((2, 0, None), (2, 1, None)))
      assert(b.link == Seq(true, true, true))
      assert(
        b.answers(0x24, 0x100, 0x24, 0x100, 4, 0).map(a => (a._1, a._2)) ==
          Seq(0 -> 1, 0 -> 5, 1 -> 1, 1 -> 5, 2 -> 1, 0 -> 1)
      )
    },
    check("LNK-06, B-93: every register that is wrong is written, and auto-negotiation begun anew") { b =>
      val asked = b.answers(0x0300, 0, 0x01e1, 0, 0x1000, 0, 0x24, 0x100)
      assert(
        asked.map(a => (a._2, a._3)) ==
          Seq(
            (9, None),
            (9, Some(0)),
            (4, None),
            (4, Some(0x0101)),
            (0, None),
            (0, Some(0x1200)),
            (1, None),
            (5, None)
          )
      )
      b.answers(0, 0x0101, 0x1000, 0x24, 0x100)
      assert(
        b.answers(0x3100, 0, 4).map(a => (a._1, a._2, a._3)) ==
          Seq((2, 0, None), (2, 0, Some(0x2100)), (2, 1, None))
      )
      assert(Seq(0, 1, 2).map(b.dut.status(_).configured.peekBoolean()) == Seq(true, false, true))
    },
    check("LNK-04, B-94: after a question without an answer comes the next port, and each is asked again") {
      b =>
        b.round()
        for (_ <- 0 until 2; y <- 0 until 3) assert(b.answer(None)._1 == y)
        assert(Seq(0, 1, 2).forall(b.dut.status(_).pollError.peekBoolean()))
        b.dut.signal(1).poke(false)
        assert(b.link == Seq(true, false, true), "as the inputs are")
        assert(b.answers(0).head == ((0, 9, None)), "the configuration again")
    },
    check("LNK-06, B-94: a PHY in its reset has not answered, and is configured behind that") { b =>
      b.answers(0, 0x0101, 0x9000)
      assert(b.dut.status(0).pollError.peekBoolean())
      b.answers(0, 0x0101, 0x1000, 0x24, 0x100)
      assert(b.answers(0xa100).head == ((2, 0, None)), "fibre")
      assert(b.answers(0, 0x01e1, 0).map(a => (a._1, a._2)) == Seq(0 -> 9, 0 -> 4, 0 -> 4))
      assert(b.answers(0x1000, 0, 0x24, 0x100).map(_._3) == Seq(None, Some(0x1200), None, None))
      assert(b.answers(0x24, 0x100).map(_._1) == Seq(1, 1) && b.answers(0x3100).head == ((2, 0, None)))
    },
    check("LNK-06, B-93: where the link has gone the next questions are the configuration, once") { b =>
      b.round()
      assert(b.answers(0x20).head == ((0, 1, None)) && !b.link.head, "taken at once")
      // Link again, and bits that stay as they are.
      val copper = b.answers(0x0300, 0, 0x01e1, 0, 0x1000, 0, 0x24, 0x100)
      assert(copper.map(a => (a._1, a._2)) == Seq(9, 9, 4, 4, 0, 0, 1, 5).map(0 -> _) && b.link.head)
      assert(b.answers(0x24, 0x100).forall(_._1 == 1))
      assert(b.answers(0).head == ((2, 1, None)) && b.link == Seq(true, true, false))
      assert(b.answers(0x2100, 0, 0).map(a => (a._1, a._2)) == Seq(2 -> 0, 2 -> 1, 2 -> 1), "fibre")
      b.answers(0x24, 0x100, 0x24, 0x100)
      assert(b.answers(0, 0).forall(a => (a._1, a._2) == (2 -> 1)) && !b.link(2), "still none")
      assert(b.answers(0x24, 0x100).map(_._2) == Seq(1, 5), "the bits were not looked at again")
    },
    check("LNK-08, MI-10: a restart is one write between the questions, and confirmed once") { b =>
      b.round()
      b.dut.restart(1).poke(true)
      b.answers(0x24, 0x100)
      assert(b.answers(0x1000).head == ((1, 0, None)))
      b.dut.access.done.poke(true)
      assert(b.dut.restarted(1).peekBoolean() && !b.dut.restarted(0).peekBoolean())
      b.dut.access.done.poke(false)
      assert(b.answer(Some(0)) == ((1, 0, Some(0x1200))))
      b.dut.restart(1).poke(false)
      assert(b.answers(0x24, 0x100, 4).map(a => (a._1, a._2)) == Seq(1 -> 1, 1 -> 5, 2 -> 1))
      assert(!b.dut.status(1).configured.peekBoolean())
    }
  )
}

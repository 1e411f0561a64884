package flyframe.port

import chisel3._
import chiseltest._
import org.scalatest.flatspec.AnyFlatSpec
import flyframe.params.EscParams
import flyframe.protocol.LoopSetting

class LoopControlSpec extends AnyFlatSpec with ChiselScalatestTester {
  import LoopSetting._

  /** The unit with everything quiet; inputs stay until changed. */
  private class Bench(dut: LoopControl, n: Int) {
    private val all = 0 until n
    for (y <- all) {
      dut.quiet(y).poke(true)
      dut.link(y).poke(false)
      dut.setting(y).poke(Auto)
    }
    def link(up: Boolean*): Unit      = { all.foreach(y => dut.link(y).poke(up(y))); dut.clock.step() }
    def setting(values: Int*): Unit   = { all.foreach(y => dut.setting(y).poke(values(y))); dut.clock.step() }
    def quiet(port: Int, is: Boolean) = dut.quiet(port).poke(is)
    def open: Seq[Boolean]            = all.map(dut.open(_).peekBoolean())
    def closed: Seq[Boolean]          = all.map(dut.reportClosed(_).peekBoolean())
    def circulating: Boolean          = dut.circulating.peekBoolean()
    def pulse(signal: Bool): Unit = {
      signal.poke(true)
      dut.clock.step()
      signal.poke(false)
      dut.clock.step()
    }
  }
  private def bench(ports: Int)(run: (LoopControl, Bench) => Unit): Unit =
    test(new LoopControl(EscParams(ports = ports)))(dut => run(dut, new Bench(dut, ports)))

  "LP-01, LP-04, LP-06, LP-14: every setting and link of two ports" should "give the loops of the rules" in
    bench(2) { (_, b) =>
      // Auto close has seen neither a write nor a frame, so it stays closed.
      def wanted(setting: Int, link: Boolean) = setting == Open || (setting == Auto && link)
      for {
        s0 <- Auto to Closed
        s1 <- Auto to Closed
        l0 <- Seq(false, true)
        l1 <- Seq(false, true)
      } {
        b.link(l0, l1)
        b.setting(s0, s1)
        val want = Seq(wanted(s0, l0), wanted(s1, l1))
        val open = if (want.contains(true)) want else Seq(true, false)
        assert(b.open == open, s"settings $s0 $s1, links $l0 $l1")
        assert(b.closed == want.map(!_), s"settings $s0 $s1, links $l0 $l1")
        assert(b.circulating == (!open.head && s0 <= AutoClose), s"settings $s0 $s1, links $l0 $l1")
      }
    }

  "LP-06, B-34: the recovery port" should "be port 0 alone, whatever closed the loops" in bench(4) { (_, b) =>
    b.link(false, false, false, false)
    assert(b.open == Seq(true, false, false, false) && b.closed.forall(identity))
    b.link(true, true, true, true)
    b.setting(Closed, Closed, Closed, Closed)
    assert(b.open == Seq(true, false, false, false) && b.closed.forall(identity))
    assert(!b.circulating, "open as recovery port")
    b.setting(Closed, Closed, Closed, Open)
    assert(b.open == Seq(false, false, false, true) && !b.circulating, "closed by hand")
  }

  "LP-03, LP-04: auto close" should "open when written or after a good frame, and close with the link" in
    bench(2) { (dut, b) =>
      b.setting(Auto, AutoClose)
      for (release <- Seq(dut.settingWritten, dut.goodFrame(1))) {
        b.link(true, false)
        b.pulse(release)
        assert(!b.open(1), "before the link came up it does not count")
        b.link(true, true)
        b.pulse(dut.goodFrame(0))
        assert(!b.open(1), "another port's frame does not count")
        b.pulse(release)
        assert(b.open(1))
        b.link(true, false)
        assert(!b.open(1))
        b.link(true, true)
        assert(!b.open(1), "closed wait")
      }
    }
  "B-35: a good frame" should "count for auto close if it came in another setting" in bench(2) { (dut, b) =>
    b.link(true, true)
    b.pulse(dut.goodFrame(1))
    b.setting(Auto, AutoClose)
    assert(b.open(1))
  }

  "B-30: a loop" should "change only while its port is quiet" in bench(2) { (_, b) =>
    b.link(true, true)
    b.quiet(1, is = false)
    b.link(true, false)
    assert(b.open == Seq(true, true))
    b.setting(Auto, Closed)
    assert(b.open == Seq(true, true))
    b.link(false, false)
    assert(b.open == Seq(true, true), "port 0 is quiet, and needed as recovery port")
    b.quiet(1, is = true)
    b.setting(Auto, Closed)
    assert(b.open == Seq(true, false))
    b.quiet(1, is = false)
    b.setting(Auto, Open)
    assert(b.open == Seq(false, false) || b.open == Seq(true, false))
    assert(!b.open(1), "it does not open either")
  }

  "Reset" should "close all loops until the link is known" in bench(3) { (dut, b) =>
    b.link(true, true, true)
    assert(b.open == Seq(true, true, true))
    dut.reset.poke(true.B)
    dut.clock.step()
    assert(b.open == Seq(false, false, false) && b.closed.forall(identity))
  }
}

package flyframe.port

import chiseltest._
import org.scalatest.flatspec.AnyFlatSpec
import flyframe.params.EscParams

class TemporaryLoopsSpec extends AnyFlatSpec with ChiselScalatestTester {
  private val p      = EscParams(coreClockMhz = 25, temporaryLoopMs = 1)
  private val cycles = 25000

  /** A frame with register writes, as the memory plays it: the commit starts, then the registers change. */
  private def commit(dut: TemporaryLoops, temporary: Boolean, settings: Int*): Unit = {
    dut.commitStarts.poke(true)
    dut.clock.step()
    dut.commitStarts.poke(false)
    dut.clock.step(2)
    dut.temporary.poke(temporary)
    for ((s, y) <- settings.zipWithIndex) dut.setting(y).poke(s)
  }
  private def former(dut: TemporaryLoops): Seq[Int] =
    (0 until p.ports).map(dut.former(_).peekInt().toInt)

  /** Steps until the settings come back, at most `limit` cycles. */
  private def untilRestore(dut: TemporaryLoops, limit: Int): Option[Int] = {
    val waited = (0 until limit).iterator.takeWhile { _ =>
      val waits = !dut.restore.peekBoolean()
      if (waits) dut.clock.step()
      waits
    }.size
    Option.when(waited < limit)(waited)
  }

  for (clock <- Seq(25, 125))
    s"B-31: a temporary setting at $clock MHz" should "end after its time and bring back what was before" in
      test(new TemporaryLoops(p.copy(coreClockMhz = clock))) { dut =>
        dut.clock.setTimeout(0)
        commit(dut, temporary = false, 2, 1)
        commit(dut, temporary = true, 3, 3)
        dut.clock.step(900 * clock)
        val waited = untilRestore(dut, 200 * clock)
        assert(waited.exists(w => w >= 100 * clock - 2 && w <= 100 * clock), waited)
        assert(former(dut) == Seq(2, 1))
      }

  "B-31: a temporary setting" should "neither be prolonged nor save anew when written again while it runs" in
    test(new TemporaryLoops(p)) { dut =>
      dut.clock.setTimeout(0)
      commit(dut, temporary = false, 2, 1)
      commit(dut, temporary = true, 3, 3)
      dut.clock.step(cycles / 2)
      commit(dut, temporary = true, 0, 2)
      assert(untilRestore(dut, 2 * cycles).exists(_ <= cycles - cycles / 2))
      assert(former(dut) == Seq(2, 1))
    }

  it should "stay for good once the bit is written 0, and start afresh when set again" in
    test(new TemporaryLoops(p)) { dut =>
      dut.clock.setTimeout(0)
      commit(dut, temporary = true, 3, 3)
      dut.clock.step(cycles / 2)
      commit(dut, temporary = false, 3, 3)
      assert(untilRestore(dut, cycles).isEmpty)
      commit(dut, temporary = true, 0, 0)
      assert(untilRestore(dut, 2 * cycles).exists(_ >= cycles - 2))
      assert(former(dut) == Seq(3, 3))
    }
}

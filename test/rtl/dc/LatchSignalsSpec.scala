package flyframe.dc

import chiseltest._
import org.scalatest.flatspec.AnyFlatSpec
import flyframe.SharedSimulation
import flyframe.params.EscParams
import flyframe.registers.ClockRegisters

/** LATCH signals alone, against the times at which the test has changed them. */
class LatchSignalsSpec extends AnyFlatSpec with SharedSimulation {
  private class Bench(dut: ClocksUnderTest) extends ClockBench(dut) {
    val p = dut.p
    for (n   <- 0 to 1) dut.pins.get.latch(n).poke(false)
    for (n   <- 0 to 1; edge <- Seq("positive", "negative")) single(n, edge, on = false)
    for (pin <- Seq(dut.good, dut.bad)) pin.poke(false)
    step(20)

    def now: Long = cycle * p.clockPeriodNs
    def single(n: Int, edge: String, on: Boolean): Unit =
      bit(s"latch${n}_${edge}_single", on)
    def byPdi(n: Int, on: Boolean): Unit = bit(s"latch${n}_by_pdi", on)

    /** The pin changes; when. */
    def pin(n: Int, level: Boolean): Long = {
      dut.pins.get.latch(n).poke(level)
      now
    }
    def pulse(n: Int): (Long, Long) = {
      val up = pin(n, level = true)
      step(37)
      val down = pin(n, level = false)
      step(200)
      (up, down)
    }
    def time(edge: Int): Long = {
      frame()
      end(None)
      read(ClockRegisters.LatchTimes + 8 * edge, p.clockBytes).toLong
    }

    /** A frame has begun, and sees this. */
    def status(n: Int): Int = {
      begins()
      shown(n)
    }
    def shown(n: Int): Int = Seq("positive", "negative", "pin").zipWithIndex.map { case (bit, i) =>
      dut.status.uint(s"latch${n}_$bit").peekInt().toInt << i
    }.sum
    def begins(): Unit = {
      dut.begins.poke(true)
      step()
      dut.begins.poke(false)
    }
    def near(is: Long, wanted: Long): Unit =
      Predef.assert(is >= wanted - p.clockPeriodNs && is <= wanted + p.clockPeriodNs, s"$is, not $wanted")

    /** A frame reads the time of an edge, and ends well or not. */
    def ecatReads(edge: String, ends: Boolean = true, of: Int = 0): Unit = {
      begins()
      goesOn(edge, ends, of)
    }
    def goesOn(edge: String, ends: Boolean = true, of: Int = 0): Unit = {
      dut.reads.pulse(s"latch${of}_${edge}_time").poke(true)
      step()
      dut.reads.pulse(s"latch${of}_${edge}_time").poke(false)
      (if (ends) dut.good else dut.bad).poke(true)
      step()
      dut.good.poke(false)
      dut.bad.poke(false)
    }
    def hostReads(edge: Int, byte: Int = 0): BigInt = {
      val at   = ClockRegisters.LatchTimes + 8 * edge + byte
      val data = hostRead(at, 1)
      dut.host.ack.poke(true)
      dut.host.write.poke(false)
      dut.host.addr.poke(at)
      dut.host.be.poke(1 << (at % p.lanes))
      step()
      dut.host.ack.poke(false)
      step()
      data
    }
  }
  private def check(name: String)(run: Bench => Unit) = name -> { dut: ClocksUnderTest =>
    run(new Bench(dut))
  }

  private val p = EscParams(clocks = 2, latchSignals = 2)
  for (q <- Seq(p, p.copy(clockBits = 32, dataBusWidth = 16, coreClockMhz = 125)))
    together(s"${q.clockBits} bits, bus of ${q.dataBusWidth}, ${q.coreClockMhz} MHz", new ClocksUnderTest(q))(
      check("DC-37, DC-39: continuously each edge leaves its system time, whatever else goes on") { b =>
        b.write(ClockRegisters.Offset, 12345678, b.p.clockBytes)
        for (k <- 1 to 30; n <- 0 to 1) {
          if (k % 3 == 0) b.frame()
          b.step(k)
          val (up, down) = b.pulse(n)
          b.near(b.time(2 * n) - 12345678, up)
          b.near(b.time(2 * n + 1) - 12345678, down)
          assert((b.status(n) & 3) == 0)
        }
      },
      check("DC-37: edges at the same time, close to each other, and with a frame") { b =>
        for (k <- 1 to 20) {
          b.dut.begins.poke(true)
          val up = b.pin(0, level = true)
          b.pin(1, level = true)
          b.step()
          b.dut.begins.poke(false)
          b.step(k)
          val down = b.pin(0, level = false)
          b.pin(1, level = false)
          b.step(400)
          for (n <- 0 to 1) {
            b.near(b.time(2 * n), up)
            b.near(b.time(2 * n + 1), down)
          }
        }
      },
      check("DC-38, B-89: an edge while the time of one before is read is another event") { b =>
        b.single(0, "positive", on = true)
        b.byPdi(0, on = true)
        val (first, _) = b.pulse(0)
        val low        = b.hostReads(0)
        assert(b.status(0) == 0)
        val (second, _) = b.pulse(0)
        assert(b.status(0) == 1)
        val bytes = low +: (1 until b.p.clockBytes).map(i => b.hostReads(0, i))
        if (b.p.lanes == 1)
          b.near(bytes.zipWithIndex.map { case (byte, i) => byte << (8 * i) }.sum.toLong, first)
        else b.near((b.hostReads(0) | b.hostReads(0, 1) << 8).toLong & 0xffff, second & 0xffff)
        if (b.p.lanes == 1) {
          assert(b.status(0) == 1, "only the first byte acknowledges")
          val again = (0 until b.p.clockBytes).map(i => b.hostReads(0, i) << (8 * i)).sum
          b.near(again.toLong, second)
        }
        assert(b.status(0) == 0)
        b.byPdi(0, on = false)
        // A frame that has begun before does not see it, nor does it acknowledge.
        b.begins()
        val (third, _) = b.pulse(0)
        b.goesOn("positive")
        assert(b.status(0) == 1)
        b.near(b.time(0), third)
        b.ecatReads("positive")
        assert(b.status(0) == 0)
        b.single(0, "positive", on = false)
      },
      check("DC-37, B-89: a pin that never rests leaves the engine to the other one") { b =>
        for (k <- 1 to 5) {
          for (i <- 1 to 100) {
            b.pin(0, level = i % 2 == 1)
            b.step(11)
          }
          val up = b.pin(1, level = true)
          for (i <- 1 to 200) {
            b.pin(0, level = i % 2 == 1)
            b.step(11)
          }
          val last = b.pin(0, level = true)
          b.step(1100)
          b.near(b.time(2), up)
          b.near(b.time(0), last)
          b.pin(0, level = false)
          b.pin(1, level = false)
          b.step(1100)
        }
      },
      check("DC-38: a single event is the first edge, until its time is read; DC-41: the pin") { b =>
        b.single(0, "positive", on = true)
        val (up, down) = b.pulse(0)
        assert(b.status(0) == 1)
        b.pulse(0)
        b.near(b.time(0), up)
        assert(b.time(1) > down + 1000, "the other edge goes on")
        b.ecatReads("positive", ends = false)
        assert(b.status(0) == 1, "a frame in error has not read")
        b.ecatReads("negative")
        assert(b.status(0) == 1)
        b.ecatReads("positive")
        assert(b.status(0) == 0)
        val (again, _) = b.pulse(0)
        b.near(b.time(0), again)
        assert(b.status(0) == 1)
        b.pin(0, level = true)
        b.step(10)
        assert(b.status(0) == 5)
      },
      check("DC-38, B-89: a frame sees events and times as they were when it began") { b =>
        b.single(1, "negative", on = true)
        b.pulse(1)
        val old = b.time(3)
        b.ecatReads("negative", of = 1)
        assert(b.status(1) == 0)
        b.step(300)
        b.begins()
        b.step(20)
        b.pin(1, level = true)
        b.step(30)
        val down = b.pin(1, level = false)
        b.step(400)
        assert((b.shown(1) & 2) == 0)
        val seen = b.read(ClockRegisters.LatchTimes + 24, b.p.clockBytes)
        assert(seen == old || (seen - down).abs <= b.p.clockPeriodNs)
        b.near(b.time(3), down)
        assert((b.status(1) & 2) == 2)
      },
      check("DC-40: only the owner acknowledges, and has the event") { b =>
        for (edge <- Seq("positive", "negative")) b.single(0, edge, on = true)
        b.byPdi(0, on = true)
        assert(b.dut.guard.pulse("latch0_of_pdi").peekBoolean())
        assert(!b.dut.guard.pulse("latch0_of_ecat").peekBoolean())
        b.pulse(0)
        assert(b.status(0) == 3)
        b.ecatReads("positive")
        assert(b.status(0) == 3)
        b.hostReads(0)
        assert(b.status(0) == 2)
        b.hostReads(1)
        assert(b.status(0) == 0)
        b.byPdi(0, on = false)
        b.pulse(0)
        b.hostReads(0)
        assert(b.status(0) == 3)
        b.ecatReads("positive")
        assert(b.status(0) == 2)
      }
    )
}

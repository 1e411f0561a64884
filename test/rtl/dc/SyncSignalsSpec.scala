package flyframe.dc

import scala.util.Random
import chiseltest._
import org.scalatest.flatspec.AnyFlatSpec
import flyframe.SharedSimulation
import flyframe.params.EscParams
import flyframe.registers.ClockRegisters

/** SYNC signals alone, against the times at which their pulses should be. */
class SyncSignalsSpec extends AnyFlatSpec with SharedSimulation {
  private class Bench(dut: ClocksUnderTest) extends ClockBench(dut) {
    val p              = dut.p
    val period         = p.clockPeriodNs
    def now: Long      = cycle * period
    private val levels = Array(false, false)

    /** Times at which a signal has become active, and inactive. */
    val begins = Array.fill(2)(Vector.empty[Long])
    val ends   = Array.fill(2)(Vector.empty[Long])

    dut.value.uint("sync_pulse_length").poke(50)

    def level(n: Int): Boolean = dut.pins.get.sync(n).peekBoolean()

    /** Lets time pass, and watches the signals. */
    def watch(us: Double): Unit = for (_ <- 1 to (us * p.coreClockMhz).toInt) {
      step()
      for (n <- 0 until p.syncSignals) {
        val is = level(n)
        if (is && !levels(n)) begins(n) :+= now
        if (!is && levels(n)) ends(n) :+= now
        levels(n) = is
      }
    }
    def forget(): Unit = for (n <- 0 to 1) {
      begins(n) = Vector.empty
      ends(n) = Vector.empty
    }
    def start(at: BigInt): Unit = write(ClockRegisters.StartTime, at, p.clockBytes)
    def cycles(first: BigInt, second: BigInt): Unit = {
      write(ClockRegisters.SyncCycles, first, 4)
      write(ClockRegisters.SyncCycles + 4, second, 4)
    }
    def activate(bits: Int): Unit = write(ClockRegisters.Activation, bits, 1)
    def next(n: Int): BigInt      = { frame(); end(None); read(0x0990 + 8 * n, p.clockBytes) }

    /** The signal has been active from these times on, to one core cycle. */
    def beganAt(n: Int, times: Seq[Long]): Unit = {
      assert(begins(n).size == times.size, s"SYNC$n: ${begins(n)}, not $times")
      for ((is, wanted) <- begins(n).zip(times))
        assert(is > wanted && is <= wanted + period, s"SYNC$n: ${begins(n)}, not $times")
    }
    private def assert(condition: Boolean, clue: => String): Unit = Predef.assert(condition, clue)
  }
  private def check(name: String)(run: Bench => Unit) = name -> { dut: ClocksUnderTest =>
    run(new Bench(dut))
  }

  /** When SYNC1 has pulses, with those of SYNC0 at `start` + k `first` (DC-32, OP-05). */
  private def followers(start: Long, first: Long, second: Long, until: Long): Seq[Long] =
    Iterator
      .iterate(start + second)(last => start + ((last - start) / first + 1) * first + second)
      .takeWhile(_ < until)
      .toSeq

  private val p = EscParams(clocks = 2, syncSignals = 2, sii = 1)
  for (q <- Seq(p, p.copy(clockBits = 32, dataBusWidth = 32, coreClockMhz = 125)))
    together(s"${q.clockBits} bits, bus of ${q.dataBusWidth}, ${q.coreClockMhz} MHz", new ClocksUnderTest(q))(
      check("DC-27, DC-28, DC-34: pulses from the start time on, every cycle, until it is deactivated") { b =>
        b.activate(0)
        val start = b.now + 40000
        b.start(start)
        b.cycles(20000, 0)
        b.activate(3)
        b.watch(190)
        val times = (0 to 20).map(start + 20000L * _).filter(_ < b.now - b.period)
        b.beganAt(0, times)
        for ((from, to) <- b.begins(0).zip(b.ends(0)))
          assert(math.abs(to - from - 500) <= b.period, "the length of a pulse")
        assert(b.next(0) == start + 20000L * times.size, "the register shows the next one")
        assert(b.begins(1).isEmpty, "SYNC1 is not enabled")
        b.activate(2)
        b.forget()
        b.watch(100)
        assert(b.begins(0).isEmpty)
      },
      check("DC-27: a start in the past never comes; a new one does after another activation") { b =>
        b.cycles(20000, 0)
        b.start(b.now - 100)
        b.activate(3)
        b.watch(100)
        assert(b.begins(0).isEmpty)
        b.start(b.now + 20000)
        b.watch(50)
        assert(b.begins(0).isEmpty, "the start time counts when it becomes active")
        b.activate(0)
        val start = b.now + 30000
        b.start(start)
        b.activate(3)
        b.watch(65)
        b.beganAt(0, Seq(start, start + 20000))
      },
      check("DC-29: with a cycle time of 0 there is one pulse") { b =>
        for (_ <- 1 to 2) {
          val start = b.now + 30000
          b.start(start)
          b.cycles(0, 7000)
          b.activate(7)
          b.forget()
          b.watch(150)
          b.beganAt(0, Seq(start))
          b.beganAt(1, Seq(start + 7000))
          b.activate(0)
        }
      },
      check("DC-26, DC-29: after one pulse the unit becomes active again at once") { b =>
        b.cycles(0, 0)
        for (later <- 1 to 80) {
          b.start(b.now + 10000)
          b.activate(3)
          while (!b.level(0)) b.watch(0.01)
          b.step(later)
          val start = b.now + 10000
          b.activate(0)
          b.start(start)
          b.activate(3)
          b.watch(0.02)
          b.forget()
          b.watch(12)
          b.beganAt(0, Seq(start))
          b.activate(0)
        }
      },
      check("DC-27, B-88: a start 5 us ahead is not missed, at no phase of the engine") { b =>
        b.cycles(0, 0)
        for (phase <- 0 until 300 by 7) {
          b.activate(0)
          b.step(phase + 600)
          val start = b.now + 5000 + b.period * p.clockBytes
          b.start(start)
          b.forget()
          b.activate(3)
          b.watch(7)
          b.beganAt(0, Seq(start))
        }
        b.activate(0)
      },
      check("DC-32: SYNC1 waits as long as it has to") { b =>
        // With 32 bits more than half the range: it seems to have passed.
        b.cycles(20000, BigInt("c0000000", 16))
        b.start(b.now + 10000)
        b.activate(7)
        b.forget()
        b.watch(500)
        assert(b.begins(1).isEmpty)
        assert(b.next(1) > b.now + BigInt("b0000000", 16) || p.clockBits == 32)
        val first = b.begins(0).head - b.period
        assert((b.next(1) - BigInt("c0000000", 16) - first).abs <= b.period, "of the first pulse still")
        b.activate(0)
      },
      check("B-86: SYNC1 with the shortest cycle") { b =>
        for (second <- Seq(500, 1000, 3500)) {
          val start = b.now + 20000
          b.start(start)
          b.cycles(4000, second)
          b.activate(7)
          b.forget()
          b.watch(120)
          val end = b.now - b.period
          b.beganAt(0, Iterator.iterate(start)(_ + 4000).takeWhile(_ < end).toSeq)
          b.beganAt(1, followers(start, 4000, second, end))
          b.activate(0)
        }
      },
      check("DC-27: the first pulse may be far away") { b =>
        val start = b.now + 400000
        b.start(start)
        b.cycles(150000, 0)
        b.activate(3)
        b.watch(600)
        b.beganAt(0, Seq(start, start + 150000))
      },
      check("DC-32, DC-33, OP-05: SYNC1 follows SYNC0") { b =>
        val random = new Random(3)
        val some = Seq(0L, 5000L, 20000L, 40000L, 19000L, 21000L, 59990L, 60010L) ++
          Seq.fill(6)(random.nextInt(100000).toLong)
        for (second <- some) {
          b.activate(0)
          val start = b.now + 20000
          b.start(start)
          b.cycles(20000, second)
          b.activate(7)
          b.forget()
          b.watch(350)
          val end = b.now - b.period
          b.beganAt(0, Iterator.iterate(start)(_ + 20000).takeWhile(_ < end).toSeq)
          b.beganAt(1, followers(start, 20000, second, end))
        }
      },
      check("DC-28: pulses longer than the cycle make the signal active all the time") { b =>
        b.dut.value.uint("sync_pulse_length").poke(3000)
        b.start(b.now + 20000)
        b.cycles(20000, 0)
        b.activate(3)
        b.watch(150)
        assert(b.begins(0).size == 1 && b.ends(0).isEmpty)
        b.activate(0)
        b.watch(1)
        assert(b.ends(0).size == 1)
      },
      check("DC-30, DC-31: with a pulse length of 0 the signal stays until its status is read") { b =>
        b.dut.value.uint("sync_pulse_length").poke(0)
        def acknowledge(): Unit = {
          b.dut.host.ack.poke(true)
          b.dut.host.write.poke(false)
          b.dut.host.addr.poke(0x098e)
          b.dut.host.be.poke(if (b.p.lanes == 1) 1 else 4)
          b.step()
          b.dut.host.ack.poke(false)
        }
        val start = b.now + 20000
        b.start(start)
        b.cycles(20000, 0)
        b.activate(3)
        b.watch(25)
        b.beganAt(0, Seq(start))
        assert(b.dut.status.uint("sync0_status").peekInt() == 1)
        b.watch(25)
        assert(b.ends(0).isEmpty, "also over the next pulse")
        acknowledge()
        b.watch(2)
        assert(b.ends(0).size == 1)
        b.watch(20)
        b.beganAt(0, Seq(start, start + 40000))
        b.activate(0)
        b.watch(1)
        assert(b.ends(0).size == 2)
      },
      check("B-86: cycle times of less than 4 us leave pulses out, and nothing gets stuck") { b =>
        for (cycle <- Seq(1, 10, 60, 500, 1000, 3000)) {
          b.activate(0)
          val start = b.now + 20000
          b.start(start)
          b.cycles(cycle, 0)
          b.activate(3)
          b.forget()
          b.watch(60)
          assert(b.begins(0).nonEmpty, cycle)
          for (is <- b.begins(0).init) { // each pulse is at one of its times
            val late = (is - start) % cycle
            assert(is > start && (late <= b.period || cycle < 20), s"$cycle: ${b.begins(0)}, start $start")
          }
          b.activate(0)
          b.watch(1)
          assert(!b.level(0))
        }
        // It still works.
        b.forget()
        val start = b.now + 20000
        b.start(start)
        b.cycles(4000, 0)
        b.activate(3)
        b.watch(60)
        b.beganAt(0, (0 to 40).map(start + 4000L * _).filter(_ < b.now - b.period))
      },
      check("B-87: a jump of the time leaves pulses out, and puts off others") { b =>
        val start = b.now + 20000
        b.start(start)
        b.cycles(20000, 0)
        b.activate(3)
        b.watch(50)
        b.write(ClockRegisters.Offset, 300000, b.p.clockBytes)
        b.forget()
        b.watch(200)
        // System times are 300 us later than local ones. What was armed is not moved; then all that is
        // jumped over is left out, and no later one.
        val first = b.begins(0)(1)
        val kept  = start - 300000 + 20000L * ((first + 300000 - start) / 20000)
        assert(first < start + 140000, "those jumped over do not take long")
        val until = b.now - b.period
        b.beganAt(0, (start + 40000) +: Iterator.iterate(kept)(_ + 20000).takeWhile(_ < until).toSeq)
        while (b.now < b.begins(0).last + 5000) b.watch(0.1)
        // It is armed already; the one behind it waits for its time, which lies 300 us further ahead.
        val armed = kept + 20000L * (b.begins(0).size - 1)
        b.write(ClockRegisters.Offset, 0, b.p.clockBytes)
        b.forget()
        b.watch((armed + 330000 - b.now) / 1000.0)
        b.beganAt(0, Seq(armed, armed + 320000))
      },
      check("DC-40: who has the cyclic unit and SYNC1 writes the activation") { b =>
        val dut = b.dut
        def guards =
          Seq("sync_of_ecat", "sync_of_pdi", "sync0_of_ecat", "sync0_of_pdi", "sync1_of_ecat", "sync1_of_pdi")
            .map(dut.guard.pulse(_).peekBoolean())
        def bits =
          Seq("cyclic_active", "sync0_enable", "sync1_enable").map(dut.status.uint(_).peekInt().toInt)
        def owners(by0: Boolean, other: Boolean): Unit = {
          b.bit("sync0_by_pdi", by0)
          b.bit("sync1_by_other", other)
        }
        owners(by0 = false, other = false)
        assert(guards == Seq(true, false, true, false, true, false))
        owners(by0 = true, other = true)
        assert(guards == Seq(true, true, false, true, true, false))
        dut.registerWriteByHost.poke(false)
        b.activate(7)
        assert(bits == Seq(0, 0, 1), "ECAT has SYNC1 only")
        dut.registerWriteByHost.poke(true)
        b.activate(3)
        assert(bits == Seq(1, 1, 1))
        owners(by0 = true, other = false)
        assert(guards == Seq(false, true, false, true, false, true))
        b.activate(0)
        assert(bits == Seq(0, 0, 0))
        dut.registerWriteByHost.poke(false)
      }
    )
}

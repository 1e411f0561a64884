package flyframe.alarm

import chisel3._
import chiseltest._
import flyframe.SharedSimulation
import flyframe.protocol.DetectorState.{Alarm, Normal, Off, Open, Short}
import flyframe.rules.Line
import org.scalatest.flatspec.AnyFlatSpec

/** The detector with its ticks. */
class DetectorUnderTest(coreClockMhz: Int) extends Module {
  val current  = IO(Input(UInt(3.W)))
  val enable   = IO(Input(Bool()))
  val debounce = IO(Input(UInt(16.W)))
  val offTime  = IO(Input(UInt(16.W)))
  val restart  = IO(Input(Bool()))
  val supply   = IO(Output(Bool()))
  val state    = IO(Output(UInt(3.W)))
  val tick     = IO(Output(Bool()))

  private val time = Module(new AlarmClock(coreClockMhz))
  time.hold := false.B
  private val detector = Module(new Detector)
  detector.current     := current
  detector.debounce    := debounce
  detector.changes     := debounce =/= RegNext(debounce)
  detector.enable      := enable
  detector.offTime     := offTime
  detector.restart     := restart
  detector.tenth       := time.tenth
  detector.millisecond := time.millisecond
  supply               := detector.supply
  state                := detector.state
  tick                 := time.tenth
}

/** A smoke detector: its supply, and what becomes of a line that does not come to rest. */
class DetectorSpec extends AnyFlatSpec with SharedSimulation {
  private def on(dut: DetectorUnderTest)    = dut.supply.peekBoolean()
  private def state(dut: DetectorUnderTest) = dut.state.peekInt().toInt
  private def start(dut: DetectorUnderTest, debounce: Int, ms: Int = 0): Unit = {
    dut.current.poke(Line.current(Normal))
    dut.restart.poke(false)
    dut.debounce.poke(debounce)
    dut.offTime.poke(ms)
    dut.enable.poke(true)
    dut.clock.step(10)
  }
  private def restart(dut: DetectorUnderTest, ms: Int): Unit = {
    start(dut, debounce = 0, ms)
    dut.restart.poke(true)
    dut.clock.step()
    dut.restart.poke(false)
    dut.clock.step(2)
    assert(!on(dut))
  }

  for (clock <- Seq(25, 125))
    together(s"$clock MHz", new DetectorUnderTest(clock))(
      "DET-01: it is supplied from the reset on" -> { dut =>
        start(dut, debounce = 0)
        assert(on(dut) && state(dut) == Normal)
        dut.enable.poke(false)
        dut.clock.step(3)
        assert(!on(dut) && state(dut) == Off)
      },
      "DET-04: the supply stays off for the time set, and up to one millisecond more" -> { dut =>
        for (ms <- Seq(0, 1, 3)) {
          restart(dut, ms)
          if (ms > 0) dut.clock.step(1000 * clock * ms - 10)
          assert(ms == 0 || !on(dut), s"$ms ms")
          dut.clock.step(1000 * clock + 20)
          assert(on(dut), s"$ms ms")
        }
      },
      "DET-04: the longest off time is one, too" -> { dut =>
        restart(dut, 0xffff)
        for (_ <- 0 until 5) {
          dut.clock.step(1000 * clock)
          assert(!on(dut))
        }
      }
    )

  private val Debounce = 20

  /** With a debounce of 20 ticks of 100 cycles, from the beginning of a tick on. */
  private def line(dut: DetectorUnderTest)(check: Chatter => Unit): Unit = {
    start(dut, Debounce)
    dut.clock.step(100 * Debounce + 100)
    assert(state(dut) == Normal)
    while (!dut.tick.peekBoolean()) dut.clock.step()
    dut.clock.step(2)
    check(new Chatter(dut))
  }
  private class Chatter(dut: DetectorUnderTest) {
    private var came = Vector(Normal)

    /** The states so far, without repetition. */
    def states: Seq[Int] = came

    def is(level: Int, cycles: Int): Unit = {
      dut.current.poke(Line.current(level))
      for (_ <- 1 to cycles) {
        dut.clock.step()
        if (state(dut) != came.last) came :+= state(dut)
      }
    }

    /** So many times so long in each of these levels. */
    def turns(times: Int, levels: (Int, Int)*): Unit =
      for (_ <- 1 to times; (level, cycles) <- levels) is(level, cycles)
  }
  together("10 MHz", new DetectorUnderTest(10))(
    "DET-03: a level counts when it has lasted for the debounce time, not before" -> (line(_) { line =>
      line.is(Alarm, 100 * Debounce - 200)
      line.is(Normal, 100 * Debounce)
      assert(line.states == Seq(Normal))
      line.is(Alarm, 100 * Debounce + 200)
      assert(line.states == Seq(Normal, Alarm))
    }),
    "DET-03: a line between alarm and normal is an alarm, and no open line" -> (line(_) { line =>
      line.turns(Debounce - 2, Alarm -> 60, Normal -> 40)
      assert(line.states == Seq(Normal))
      line.turns(6, Alarm -> 60, Normal -> 40)
      assert(line.states == Seq(Normal, Alarm))
      line.is(Normal, 100 * Debounce + 200)
      assert(line.states == Seq(Normal, Alarm, Normal))
    }),
    "DET-03: a line between alarm and short circuit, or open and alarm, is an alarm" -> { dut =>
      for (other <- Seq(Short, Open)) line(dut) { line =>
        line.turns(30, Alarm -> 100, other -> 120)
        assert(line.states == Seq(Normal, Alarm))
      }
    },
    "DET-03: a line between open and normal is open" -> (line(_) { line =>
      line.turns(Debounce + 4, Open -> 10, Normal -> 90)
      assert(line.states == Seq(Normal, Open))
    }),
    "DET-03: of a normal line each fourth tick counts against the others" -> (line(_) { line =>
      // One tick of five: up as often as down.
      line.turns(200, Alarm -> 50, Normal -> 450)
      assert(line.states == Seq(Normal))
      // One tick of three: that is an alarm after 40 turns at most.
      line.turns(45, Alarm -> 50, Normal -> 250)
      assert(line.states == Seq(Normal, Alarm))
    }),
    "DET-03: rare noise is nothing, and forgotten while the line is normal" -> (line(_) { line =>
      line.turns(40, Alarm -> 100, Normal -> (100 * Debounce + 100))
      assert(line.states == Seq(Normal))
    }),
    "DET-03: one look at a higher level makes no alarm of a line that is open or shorted for long" -> { dut =>
      for (level <- Seq(Open, Short)) line(dut) { line =>
        line.is(level, 100 * Debounce * 4)
        line.is(Alarm, 3)
        line.is(level, 50)
        line.is(Alarm, 3)
        line.is(Normal, 100 * Debounce + 200)
        assert(line.states == Seq(Normal, level, Normal))
      }
    },
    "DET-03: without debounce a level counts at once" -> { dut =>
      start(dut, debounce = 0)
      for (level <- Seq(Alarm, Short, Open, Normal, Open, Alarm, Normal)) {
        dut.current.poke(Line.current(level))
        dut.clock.step(6)
        assert(state(dut) == level)
      }
    }
  )
}

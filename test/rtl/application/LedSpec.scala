package flyframe.application

import chiseltest._
import org.scalatest.flatspec.AnyFlatSpec
import flyframe.params.EscParams
import flyframe.protocol.LedCode
import flyframe.registers.LedRegisters
import flyframe.{ControllerUnderTest, RtlBench, SharedSimulation}

/** Patterns and overrides of the LEDs: LED-01 to LED-04, LED-08. */
class LedSpec extends AnyFlatSpec with SharedSimulation {

  /** Cycles of a step of 50 ms here. */
  private val scale = 3

  /** One step: the tick in its last cycle; the light throughout the step. */
  private def steps(dut: LedPattern, count: Int): Seq[Boolean] = (0 until count).map { _ =>
    val lit = (0 until scale).map { c =>
      dut.tick.poke(c == scale - 1)
      val now = dut.lit.peekBoolean()
      dut.clock.step()
      now
    }
    assert(lit.distinct.size == 1, "changes with a step only")
    lit.head
  }

  /** Lengths of the phases in ms, beginning with a lit one, as they repeat. */
  private def phases(shown: Seq[Boolean]): Seq[(Boolean, Int)] =
    if (shown.isEmpty) Nil
    else {
      val (same, rest) = shown.span(_ == shown.head)
      (shown.head -> same.size * 50) +: phases(rest)
    }

  private def pattern(code: Int, expected: Int*) =
    s"LED-08: code $code is ${expected.mkString("/")} ms" -> { dut: LedPattern =>
      begin(dut, code)
      val length = expected.sum / 50
      val shown  = steps(dut, 3 * length)
      assert(phases(shown.take(length)) == expected.zipWithIndex.map { case (ms, i) => (i % 2 == 0) -> ms })
      assert(shown == Seq.fill(3)(shown.take(length)).flatten, "repeats")
    }
  private def begin(dut: LedPattern, code: Int): Unit = {
    dut.tick.poke(false)
    dut.code.poke(0)
    dut.clock.step(2)
    dut.code.poke(code)
    dut.clock.step() // the pattern begins
  }

  private val flashes =
    (1 to 12).map(n => pattern(n, Seq.fill(n - 1)(Seq(200, 200)).flatten ++ Seq(200, 1000): _*))
  together("pattern", new LedPattern)(
    flashes ++ Seq(
      pattern(LedCode.Blinking, 200, 200),
      pattern(LedCode.Flicker, 50, 50),
      "LED-08: off and on" -> { dut: LedPattern =>
        begin(dut, LedCode.Off)
        assert(!steps(dut, 300).contains(true))
        begin(dut, LedCode.On)
        assert(!steps(dut, 300).contains(false))
      },
      "LED-08: a new code begins its pattern, whatever was shown" -> { dut: LedPattern =>
        for (
          before <- Seq(1, 2, 12, 13, 14, 15); code <- Seq(1, 2, 13, 14) if code != before;
          after  <- Seq(1, 5, 23)
        ) {
          begin(dut, before)
          steps(dut, after)
          dut.tick.poke(false)
          dut.code.poke(code)
          dut.clock.step()
          assert(
            phases(steps(dut, 8)).head == (true -> (if (code == LedCode.Flicker) 50 else 200)),
            s"$before, $code"
          )
        }
      },
      "LED-08: a tick together with a new code does not shorten the first flash" -> { dut: LedPattern =>
        begin(dut, 13)
        steps(dut, 9)
        dut.tick.poke(true)
        dut.code.poke(1)
        dut.clock.step()
        assert(phases(steps(dut, 20)).head == (true -> 200))
      },
      "LED-08: patterns of 12 flashes end before the counter does" -> { dut: LedPattern =>
        begin(dut, 12)
        assert(steps(dut, 2 * (12 * 8 + 16)).count(identity) == 2 * 12 * 4)
      }
    ): _*
  )

  private def write(dut: LedControl, byte: Int, drop: Boolean = false): Unit = {
    dut.write.valid.poke(true)
    dut.write.bits.poke(byte)
    dut.drop.poke(drop)
    dut.clock.step()
    dut.write.valid.poke(false)
    dut.drop.poke(false)
  }
  private def shows(dut: LedControl, code: Int, taken: Boolean): Unit = {
    assert(dut.code.peekInt() == code)
    assert(dut.taken.peekBoolean() == taken)
  }
  private def prepare(dut: LedControl): Unit = {
    dut.automaticCode.poke(13)
    dut.write.valid.poke(false)
    dut.drop.poke(false)
    dut.clock.step()
  }
  together("control", new LedControl)(
    "LED-01, LED-03: automatic after reset" -> { dut: LedControl =>
      prepare(dut)
      for (code <- 0 to 15) {
        dut.automaticCode.poke(code)
        shows(dut, code, taken = false)
        dut.clock.step()
      }
    },
    "LED-02, LED-04: a code with bit 4 is shown, until it is written without" -> { dut: LedControl =>
      prepare(dut)
      for (code <- 0 to 15) {
        write(dut, 0x10 | code)
        shows(dut, code, taken = true)
        dut.clock.step(5)
        shows(dut, code, taken = true)
      }
      write(dut, 0x07)
      shows(dut, 13, taken = false)
    },
    "LED-02, LED-04: dropped with the event, and shown again when written again" -> { dut: LedControl =>
      prepare(dut)
      write(dut, 0x1f)
      dut.drop.poke(true)
      dut.clock.step()
      dut.drop.poke(false)
      shows(dut, 13, taken = false)
      write(dut, 0x12)
      shows(dut, 2, taken = true)
    },
    "LED-02: an override written in the very cycle of the event stays" -> { dut: LedControl =>
      prepare(dut)
      write(dut, 0x12, drop = true)
      shows(dut, 2, taken = true)
    }
  )

  private class Link(dut: LinkActivity) {
    dut.link.poke(true)
    dut.traffic.poke(false)

    /** Light in each step of four cycles, frames passing as `busy` says of step and cycle. */
    def watch(count: Int, busy: (Int, Int) => Boolean): Seq[Boolean] = (0 until count).map { i =>
      val lit = (0 until 4).map { c =>
        dut.tick.poke(c == 3)
        dut.traffic.poke(busy(i, c))
        val now = dut.lit.peekBoolean()
        dut.clock.step()
        now
      }
      assert(lit.distinct.size == 1, "changes with a step only")
      lit.head
    }
  }
  together("link", new LinkActivity)(
    "LED-06: dark without link, lit with it" -> { dut: LinkActivity =>
      val l = new Link(dut)
      assert(l.watch(5, (_, _) => false) == Seq.fill(5)(true))
      dut.link.poke(false)
      assert(l.watch(5, (i, _) => i > 1) == Seq.fill(5)(false))
    },
    "LED-06: one frame: dark for one step; frames: every other step" -> { dut: LinkActivity =>
      val l = new Link(dut)
      for (cycle <- 0 until 4) {
        val dark = if (cycle == 3) 5 else 4 // a frame together with the tick belongs to the next step
        assert(l.watch(8, (i, c) => i == 3 && c == cycle) == (0 until 8).map(_ != dark), s"cycle $cycle")
      }
      assert(l.watch(12, (_, _) => true) == (0 until 12).map(_ % 2 == 0))
    }
  )

  // 25 MHz would not show whether the step follows the core clock.
  private val p =
    EscParams(preset = "leds", coreClockMhz = 125, ports = 1, ramKiB = 0, applicationLayer = 1, leds = 1)
  together("125 MHz", new ControllerUnderTest(p))(
    "LED-08: a step is 50 ms" -> { dut: ControllerUnderTest =>
      new RtlBench(dut, p).hostWrite(LedRegisters.Run, 0x10 | LedCode.Flicker)
      def lit = dut.led.get.run.peekBoolean()
      def untilChange(): Int = {
        val before = lit
        var ms     = 0
        while (lit == before) {
          dut.clock.step(1000 * p.coreClockMhz)
          ms += 1
          assert(ms < 60)
        }
        ms
      }
      untilChange()
      val step = untilChange()
      assert(step >= 49 && step <= 51, s"$step ms")
    }
  )
}

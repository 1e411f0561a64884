package flyframe.master

import chisel3._
import chiseltest._
import flyframe.SharedSimulation
import flyframe.protocol.SlaveStatus
import org.scalatest.flatspec.AnyFlatSpec

/** What the master knows of fire. */
class CyclicStateSpec extends AnyFlatSpec with SharedSimulation {
  private class Cyclic(dut: CyclicState) {
    private val pulses =
      Seq(
        dut.answer.valid,
        dut.over.valid,
        dut.newAlarm,
        dut.newSound,
        dut.silence,
        dut.resetAlarm,
        dut.expires,
        dut.givenUp
      )
    pulses.foreach(_.poke(false))
    def pulse(b: Bool): Unit = {
      b.poke(true)
      dut.clock.step()
      b.poke(false)
    }
    def answer(status: Int): Unit = {
      dut.answer.bits.poke(status)
      pulse(dut.answer.valid)
    }
    def over(all: Boolean = true): Unit = {
      dut.over.bits.poke(all)
      pulse(dut.over.valid)
    }

    /** A cycle with answers of all ends. */
    def cycle(status: Int*): Unit = {
      status.foreach(answer)
      over()
    }
    private def is(b: Bool)      = b.peekBoolean()
    def loud: (Boolean, Boolean) = (is(dut.fire), is(dut.sounding))
    def others: Seq[Boolean]     = Seq(dut.alarm, dut.slaveFault, dut.disabled, dut.testing).map(is)
  }
  import SlaveStatus._
  private val rings                = Alarm | Latched | Sounding
  private val (quiet, loud, still) = ((false, false), (true, true), (true, false))

  together("alone", new CyclicState)(
    "LM-07: orders that are given up between the answers of two ends are heard at the first one again" -> {
      dut =>
        val c = new Cyclic(dut)
        c.cycle(rings, 0)
        c.pulse(dut.silence)
        c.cycle(rings, 0)
        assert(c.loud == still)
        c.answer(rings)
        c.pulse(dut.givenUp)
        c.answer(0)
        c.over()
        c.cycle(rings, 0)
        assert(c.loud == loud)
    },
    "LM-05: a sounder that goes on is heard, and fire, each kind of it" -> { dut =>
      for (status <- Seq(Sounding, Alarm, Latched, rings)) {
        val c = new Cyclic(dut)
        c.cycle(0)
        assert(c.loud == quiet)
        c.answer(status)
        assert(c.loud == ((status != Sounding, (status & Sounding) != 0)), "before the cycle is over")
        c.over()
        c.pulse(dut.silence)
        c.pulse(dut.resetAlarm)
        c.cycle(0)
        assert(c.loud == quiet)
      }
    },
    "LM-05: what sounds still does not sound again, what is new does" -> { dut =>
      val c = new Cyclic(dut)
      c.cycle(rings)
      c.pulse(dut.silence)
      c.cycle(rings)
      c.cycle(rings, rings)
      assert(c.loud == still)
      c.pulse(dut.newSound)
      assert(c.loud == loud)
      c.pulse(dut.silence)
      c.answer(rings)
      c.pulse(dut.newAlarm)
      assert(c.loud == loud)
      c.over()
      c.pulse(dut.silence)
      c.cycle(Latched)
      c.cycle(rings)
      assert(c.loud == loud)
    },
    "LM-05: a record of times past does not sound" -> { dut =>
      val c = new Cyclic(dut)
      c.answer(0)
      c.pulse(dut.newAlarm)
      c.over()
      assert(c.loud == quiet)
      // The smoke is still there, but silenced: a new master hears the record once more.
      c.answer(Alarm | Latched)
      c.pulse(dut.newAlarm)
      assert(c.loud == still)
    },
    "LM-07: what sounds still when orders are given up is heard again" -> { dut =>
      val c = new Cyclic(dut)
      c.cycle(rings)
      c.pulse(dut.silence)
      c.cycle(rings)
      c.pulse(dut.givenUp)
      assert(c.loud == still)
      c.answer(rings)
      assert(c.loud == loud)
      c.over()
      c.pulse(dut.silence)
      c.cycle(Latched)
      c.pulse(dut.givenUp)
      c.cycle(Latched)
      assert(c.loud == still, "if it does")
    },
    "LM-06: the sound ends by silence or reset, and by nothing that slaves say" -> { dut =>
      for (button <- Seq(dut.silence, dut.resetAlarm)) {
        val c = new Cyclic(dut)
        c.cycle(rings)
        c.cycle(Latched)
        c.cycle(0)
        c.over(all = false)
        assert(c.loud == loud)
        c.pulse(button)
        assert(c.loud == still)
        c.pulse(dut.resetAlarm)
        c.cycle(0)
        assert(c.loud == quiet)
      }
    },
    "LM-05: an end that misses a cycle makes nothing new" -> { dut =>
      val c = new Cyclic(dut)
      c.cycle(0, rings)
      c.pulse(dut.silence)
      c.answer(0)
      c.over(all = false)
      c.cycle(0, rings)
      assert(c.loud == still)
    },
    "LM-06: fire ends after a reset, when nobody has it any more" -> { dut =>
      val c = new Cyclic(dut)
      c.cycle(rings)
      c.pulse(dut.silence)
      c.cycle(0)
      assert(c.loud == still, "without a reset")
      c.pulse(dut.resetAlarm)
      c.cycle(Latched)
      c.cycle(Alarm)
      c.answer(0)
      c.over(all = false)
      assert(c.loud == still)
      c.cycle(0)
      assert(c.loud == quiet)
    },
    "LM-06: a reset does not end an alarm that comes after it, nor one after its time" -> { dut =>
      val c = new Cyclic(dut)
      c.cycle(rings)
      c.pulse(dut.resetAlarm)
      c.answer(rings)
      c.pulse(dut.newAlarm)
      c.over()
      c.cycle(0)
      c.cycle(0)
      assert(c.loud == loud)
      c.pulse(dut.resetAlarm)
      c.pulse(dut.newSound)
      c.cycle(0)
      assert(c.loud == loud)
      c.pulse(dut.resetAlarm)
      c.cycle(0, rings)
      c.cycle(0)
      assert(c.loud == loud, "it has risen")
      c.cycle(rings)
      c.pulse(dut.resetAlarm)
      c.cycle(rings)
      c.pulse(dut.expires)
      c.cycle(0)
      c.cycle(0)
      assert(c.loud == still)
      c.pulse(dut.resetAlarm)
      c.cycle(0)
      assert(c.loud == quiet)
    },
    "LM-05: in the same clock as a silence or a reset an alarm counts" -> { dut =>
      for (button <- Seq(dut.silence, dut.resetAlarm)) {
        val c = new Cyclic(dut)
        c.cycle(0)
        button.poke(true)
        c.answer(rings)
        button.poke(false)
        c.over()
        assert(c.loud == loud)
        button.poke(true)
        c.pulse(dut.newSound)
        button.poke(false)
        assert(c.loud == loud)
        c.pulse(dut.silence)
        c.pulse(dut.resetAlarm)
        c.cycle(0)
      }
    },
    "LM-05: the other bits follow what came last" -> { dut =>
      val c = new Cyclic(dut)
      c.cycle(Alarm | Open)
      assert(c.others == Seq(true, true, false, false))
      c.cycle(Disabled, Testing)
      assert(c.others == Seq(false, false, true, true))
      c.over(all = false)
      assert(c.others == Seq(false, false, true, true))
      for (bit <- Seq(Open, Short, Unwatched, HostDead, Dropped, Unwell, Configuration)) {
        c.cycle(0)
        assert(!c.others(1))
        c.cycle(bit)
        assert(c.others(1), f"0x$bit%04x")
      }
    }
  )
}

package flyframe.application

import chiseltest._
import org.scalatest.Assertions
import org.scalatest.flatspec.AnyFlatSpec
import flyframe.SharedSimulation

/** Rules WD-01 to WD-03, WD-05 and B-61, to the cycle. */
class WatchdogSpec extends AnyFlatSpec with SharedSimulation {
  for (cycles <- Seq(1, 2, 4, 5)) {
    def ticks(dut: WatchdogDivider, count: Int): Seq[Int] = {
      var found = Vector.empty[Int]
      var now   = 0
      while (found.size < count) {
        assert(now < 1000000)
        if (dut.tick.peekBoolean()) found :+= now
        dut.clock.step()
        now += 1
      }
      found
    }
    together(s"$cycles cycles a slot", new WatchdogDivider(cycles))(
      Seq(0, 1, 2, 3, 10, 100).map { divider =>
        s"WD-01: divider $divider makes a tick of ${divider + 2} slots, one cycle long" -> {
          dut: WatchdogDivider =>
            dut.divider.poke(divider)
            val found = ticks(dut, 12).drop(1)
            assert(found.zip(found.drop(1)).forall { case (a, b) => b - a == (divider + 2) * cycles }, found)
        }
      } ++ Seq(
        "WD-01: the reset value makes 100 us" -> { dut: WatchdogDivider =>
          dut.divider.poke(0x09c2)
          val found = ticks(dut, 3).drop(1)
          assert(found(1) - found.head == 2500 * cycles)
        },
        "WD-01: a new divider counts from the next tick on" -> { dut: WatchdogDivider =>
          dut.divider.poke(50)
          ticks(dut, 2)
          dut.divider.poke(3)
          val found = ticks(dut, 6).drop(1)
          assert(found.zip(found.drop(1)).forall { case (a, b) => b - a == 5 * cycles }, found)
          dut.divider.poke(0xffff)
          ticks(dut, 1)
          dut.clock.step()
          val long = ticks(dut, 1)
          assert(long.head + 2 == 0x10001 * cycles)
        }
      ): _*
    )
  }

  private class Bench(dut: Watchdog) extends Assertions {
    dut.tick.poke(false)
    dut.trigger.poke(false)
    dut.restart.poke(false)
    time(3)

    /** One cycle with these inputs; true if it expires in it. */
    def step(tick: Boolean = false, trigger: Boolean = false, restart: Boolean = false): Boolean = {
      dut.tick.poke(tick)
      dut.trigger.poke(trigger)
      dut.restart.poke(restart)
      val expired = dut.expired.peekBoolean()
      dut.clock.step()
      dut.tick.poke(false)
      dut.trigger.poke(false)
      dut.restart.poke(false)
      expired
    }
    def time(ticks: Int): Unit = dut.timeTicks.poke(ticks)
    def running: Boolean       = dut.running.peekBoolean()

    /** Ticks until it expires, with idle cycles between; none within `limit`. */
    def ticksLeft(limit: Int = 100): Option[Int] = (1 to limit).find { _ =>
      assert(!step() && !step(), "expires with a tick only")
      step(tick = true)
    }
  }
  private def check(name: String)(run: Bench => Unit): (String, Watchdog => Unit) =
    name -> (dut => run(new Bench(dut)))

  together("watchdog", new Watchdog)(
    check("B-61: after reset expired until the first trigger, without expiring") { b =>
      assert(!b.running)
      assert(b.ticksLeft().isEmpty)
      b.step(trigger = true)
      assert(b.running)
    },
    check("WD-02, B-61: it expires at tick time + 1") { b =>
      for (time <- Seq(1, 2, 3, 7, 50)) {
        b.time(time)
        b.step(trigger = true)
        assert(b.running)
        assert(b.ticksLeft().contains(time + 1))
        assert(!b.running)
      }
    },
    check("WD-02: the longest time") { b =>
      b.time(0xffff)
      b.step(trigger = true)
      for (_ <- 0 until 0xffff) assert(!b.step(tick = true))
      assert(b.running)
      assert(b.step(tick = true))
      assert(!b.running)
    },
    check("WD-05: expiry is one cycle, once, until the next trigger") { b =>
      b.step(trigger = true)
      assert(b.ticksLeft().contains(4))
      assert(b.ticksLeft(200).isEmpty && !b.running)
      b.step(trigger = true)
      assert(b.running && b.ticksLeft().contains(4))
    },
    check("WD-04, B-61: every trigger begins anew, one in the tick that would expire included") { b =>
      b.step(trigger = true)
      for (_ <- 0 until 3) assert(!b.step(tick = true))
      b.step(trigger = true)
      for (_ <- 0 until 3) assert(!b.step(tick = true))
      b.step(tick = true, trigger = true)
      assert(b.running)
      assert(b.ticksLeft().contains(4))
    },
    check("WD-02: a tick together with the trigger is not counted") { b =>
      b.step(tick = true, trigger = true)
      assert(b.ticksLeft().contains(4))
    },
    check("WD-03: time 0 is off: status 1, never expires") { b =>
      b.time(0)
      assert(b.running, "also without trigger")
      b.step(trigger = true)
      assert(b.ticksLeft(200).isEmpty && b.running)
    },
    check("WD-03, B-61: switched off and on again while running") { b =>
      b.step(trigger = true)
      b.step(tick = true)
      b.time(0)
      b.step(restart = true)
      assert(b.ticksLeft(20).isEmpty && b.running)
      b.time(5)
      b.step(restart = true)
      assert(b.running && b.ticksLeft().contains(6))
    },
    check("WD-03, B-61: switched on without a trigger it is expired, and does not count") { b =>
      b.time(0)
      b.step(restart = true)
      b.time(5)
      b.step(restart = true)
      assert(!b.running && b.ticksLeft().isEmpty)
    },
    check("B-61: writing a time restarts a running one, not an expired one") { b =>
      b.step(trigger = true)
      for (_ <- 0 until 3) b.step(tick = true)
      b.step(restart = true)
      assert(b.ticksLeft().contains(4))
      b.step(restart = true)
      assert(!b.running && b.ticksLeft().isEmpty)
    }
  )
}

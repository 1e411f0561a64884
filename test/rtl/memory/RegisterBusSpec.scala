package flyframe.memory

import chisel3._
import chiseltest._
import org.scalatest.flatspec.AnyFlatSpec
import flyframe.SharedSimulation
import flyframe.params.EscParams
import flyframe.registers.WatchdogRegisters

/** What a unit gets by a name, and what the bus refuses. */
class RegisterBusSpec extends AnyFlatSpec with SharedSimulation {
  private val p = EscParams(dataBusWidth = 16, applicationLayer = 1, watchdogs = 1, syncManagers = 2)

  private def unit(connection: RegisterBus => Unit) = new RegisterUnit(WatchdogRegisters.all) {
    def connect(bus: RegisterBus): Unit = connection(bus)
  }

  /** Pins of what the tests look at. */
  private class Looking
      extends UnitUnderTest(
        p,
        unit { bus =>
          bus.interrupt(bus.writes("watchdog_time_pdi") && !bus.completes("watchdog_time_pdi"))
          bus.counts("watchdog_count_pdi") := bus.hostReads("watchdog_time_pdi")
          bus.set("al_status", bus.order("temporary_use"), 5.U)
        }
      )

  together("16 bits", new Looking)(
    "a register is written and read by any of its bytes, and complete by its last" -> { dut =>
      def is(signal: Bool) = signal.peekBoolean()
      dut.registerWrite.valid.poke(true)
      dut.registerWrite.bits.address.poke(WatchdogRegisters.TimePdi / 2)
      for ((mask, first) <- Seq(1 -> true, 2 -> false, 3 -> false, 0 -> false)) {
        dut.registerWrite.bits.mask.poke(mask)
        assert(is(dut.irq) == first, mask)
      }
      dut.host.ack.poke(true)
      dut.host.write.poke(false)
      val accesses = Seq((0, 1, true), (1, 2, true), (0, 0, false), (2, 1, false), (-2, 3, false))
      for ((address, be, read) <- accesses) {
        dut.host.addr.poke(WatchdogRegisters.TimePdi + address)
        dut.host.be.poke(be)
        assert(is(dut.event.pulse("watchdog_count_pdi")) == read, (address, be))
      }
      dut.host.addr.poke(WatchdogRegisters.TimePdi)
      dut.host.be.poke(3)
      dut.host.write.poke(true)
      assert(!is(dut.event.pulse("watchdog_count_pdi")), "a write")
    },
    "an order returns to 0 at once" -> { dut =>
      for (asked <- Seq(1, 0)) {
        dut.value.uint("temporary_use").poke(asked)
        for (field <- Seq("temporary_use", "al_status"))
          dut.set.load(field).valid.expect(asked == 1)
        dut.set.load("temporary_use").bits.expect(0)
        dut.set.load("al_status").bits.expect(5)
      }
    }
  )

  private def refused(sentence: String)(connection: RegisterBus => Unit): Unit = {
    val told = intercept[IllegalArgumentException](
      circt.stage.ChiselStage.emitCHIRRTL(new UnitUnderTest(p, unit(connection)))
    ).getMessage
    assert(told.contains(sentence), told)
  }

  "A second driver of a field" should "be refused" in
    refused("watchdog_pdi is driven in two places but must be in 1.") { bus =>
      bus.status("watchdog_pdi") := 0.U
      bus.status("watchdog_pdi") := 1.U
    }

  "The value of a field in RAM" should "be refused" in
    refused("field al_status_code has no value for units")(bus => bus.interrupt(bus.bool("al_status_code")))
}

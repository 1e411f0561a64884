package flyframe.alarm

import chisel3._
import chiseltest._
import org.scalatest.flatspec.AnyFlatSpec
import flyframe.SharedSimulation

/** The detector's supply alone: Verilator's models have no port `time`. */
class SupplyUnderTest(coreClockMhz: Int) extends Module {
  val enable  = IO(Input(Bool()))
  val offTime = IO(Input(UInt(16.W)))
  val restart = IO(Input(Bool()))
  val supply  = IO(Output(Bool()))

  private val detector = Module(new Detector(coreClockMhz))
  detector.current  := 1.U
  detector.debounce := 0.U
  detector.enable   := enable
  detector.offTime  := offTime
  detector.restart  := restart
  supply            := detector.supply
}

/** The supply of a smoke detector: DET-04. */
class DetectorSpec extends AnyFlatSpec with SharedSimulation {
  private def restart(dut: SupplyUnderTest, ms: Int): Unit = {
    dut.enable.poke(true)
    dut.offTime.poke(ms)
    dut.clock.step(10)
    dut.restart.poke(true)
    dut.clock.step()
    dut.restart.poke(false)
    dut.clock.step(2)
    assert(!on(dut))
  }
  private def on(dut: SupplyUnderTest) = dut.supply.peek().litToBoolean

  for (clock <- Seq(25, 125))
    together(s"$clock MHz", new SupplyUnderTest(clock))(
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
}

package flyframe.memory

import chisel3._
import chiseltest._
import org.scalatest.flatspec.AnyFlatSpec
import flyframe.registers.RegisterRam

/** The place of a register in RAM is the same in RTL and in the checks of the register map. */
class RegisterPlaceSpec extends AnyFlatSpec with ChiselScalatestTester {
  private class Place extends Module {
    val address = IO(Input(UInt(12.W)))
    val index   = IO(Output(UInt(9.W)))
    index := RegisterPlace(address)
  }

  "A register's place in the register RAM" should "be that of RegisterRam at every address" in
    test(new Place) { dut =>
      for (address <- 0 to 0xfff) {
        dut.address.poke(address)
        dut.index.expect(RegisterRam.index(address))
      }
    }
}

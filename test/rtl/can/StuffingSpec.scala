package flyframe.can

import chisel3._
import chiseltest._
import org.scalatest.flatspec.AnyFlatSpec

/** Stuffing and CRC behind registers. */
class BitsUnderTest extends Module {
  val start = IO(Input(Bool()))
  val bit   = IO(Input(Bool()))

  /** There are stuff bits, which are none of the CRC. */
  val stuffed = IO(Input(Bool()))
  val isFull  = IO(Output(Bool()))
  val crc     = IO(Output(UInt(15.W)))

  private val run = Reg(new EqualBits)
  private val sum = Reg(UInt(15.W))
  run    := Mux(start, EqualBits.none, run.and(bit))
  sum    := Mux(start, 0.U, Mux(stuffed && run.isFull, sum, SerialCrc.Can.and(sum, bit)))
  isFull := run.isFull
  crc    := sum
}

class StuffingSpec extends AnyFlatSpec with ChiselScalatestTester {

  /** Gives bits, and returns where stuff bits were expected, and the CRC. */
  private def send(dut: BitsUnderTest, bits: String, stuffed: Boolean = true): (Seq[Int], Int) = {
    dut.stuffed.poke(stuffed)
    dut.start.poke(true)
    dut.clock.step()
    dut.start.poke(false)
    val stuff = bits.indices.filter { i =>
      val full = dut.isFull.peekBoolean()
      dut.bit.poke(bits(i) == '1')
      dut.clock.step()
      full
    }
    (stuff, dut.crc.peekInt().toInt)
  }

  "CAN-09: a bit of the other level" should "be expected behind five equal ones, itself among the next" in
    test(new BitsUnderTest) { dut =>
      assert(send(dut, "0000010000010")._1 == Seq(5, 11))
      assert(send(dut, "000001111100000")._1 == Seq(5, 10))
      assert(send(dut, "0101010000111")._1.isEmpty)
    }

  "CAN-09: CRC-15" should "be that of the vectors" in test(new BitsUnderTest) { dut =>
    val text = "123456789".flatMap(c => ("0" * 8 + c.toInt.toBinaryString).takeRight(8))
    assert(send(dut, text, stuffed = false)._2 == 0x059e)
    // Base frame 0x123, DE AD, with its stuff bits; then its CRC leaves 0.
    val frame = "000100100011000001101101111010101101000101101101110"
    assert(send(dut, frame)._2 == 0)
    assert(send(dut, frame.dropRight(15))._2 == 0x0b6e)
  }
}

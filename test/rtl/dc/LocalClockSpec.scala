package flyframe.dc

import chisel3._
import chiseltest._
import org.scalatest.flatspec.AnyFlatSpec
import flyframe.SharedSimulation

/** The local clock alone, against a count of its cycles. */
class LocalClockSpec extends AnyFlatSpec with SharedSimulation {
  for ((period, bytes) <- Seq(8 -> 8, 10 -> 8, 20 -> 4, 40 -> 4))
    together(s"$period ns, $bytes bytes", new LocalClock(period, bytes, bytes))(
      "DC-01, DC-02, DC-03: each round gives the time of its first cycle" -> { dut: LocalClock =>
        dut.clock.setTimeout(0)
        dut.more.poke(0.S)
        dut.reset.poke(true.B)
        dut.clock.step()
        dut.reset.poke(false.B)
        var cycle = 0L
        for (_ <- 1 to 4000) {
          val began = cycle
          val time = (0 until bytes).map { i =>
            assert(dut.place.peekInt() == i && dut.last.peekBoolean() == (i == bytes - 1))
            val byte = dut.timeByte.peekInt() << (8 * i)
            dut.clock.step()
            cycle += 1
            byte
          }.sum
          assert(time == BigInt(began) * period)
        }
        // Carries run through all bytes.
        dut.clock.step(((1L << 24) / period / bytes * bytes).toInt)
        cycle += (1L << 24) / period / bytes * bytes
        val began = cycle
        val late = (0 until bytes).map { i =>
          val byte = dut.timeByte.peekInt() << (8 * i)
          dut.clock.step()
          byte
        }.sum
        assert(late == BigInt(began) * period)
      }
    )
}

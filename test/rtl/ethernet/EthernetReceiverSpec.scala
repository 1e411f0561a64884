package flyframe.ethernet

import scala.util.Random
import chisel3._
import chiseltest._
import flyframe.SharedSimulation
import org.scalatest.flatspec.AnyFlatSpec

class EthernetReceiverSpec extends AnyFlatSpec with SharedSimulation {
  private def is(b: Bool) = b.peekBoolean()

  /** The bytes of a frame, and whether it was good at its end. */
  private def receive(
      dut: EthernetReceiver,
      nibbles: Seq[Int],
      cycles: Int,
      bad: Boolean = false
  ): (Seq[Int], Boolean) = {
    var bytes = Vector.empty[Int]
    var good  = Option.empty[Boolean]
    def look(): Unit = {
      if (is(dut.byte.valid)) {
        assert(good.isEmpty && is(dut.first) == bytes.isEmpty)
        bytes :+= dut.byte.bits.peekInt().toInt
      }
      if (is(dut.end.valid)) {
        assert(good.isEmpty, "it ends once")
        good = Some(is(dut.end.bits))
      }
    }
    val all = Seq.fill(15)(5) ++ Seq(13) ++ nibbles
    for ((nibble, i) <- (all ++ Seq.fill(4)(0)).zipWithIndex) {
      dut.in.valid.poke(i < all.size)
      dut.in.payload.poke(i >= 16 && i <= all.size)
      dut.in.data.poke(nibble)
      dut.in.end.poke(i == all.size)
      dut.in.bad.poke(bad && i == all.size)
      for (cycle <- 1 to cycles) {
        dut.step.poke(cycle == cycles)
        look()
        dut.clock.step()
      }
    }
    (bytes, good.get)
  }

  together("frames", new EthernetReceiver)(
    "MST-13: every byte of a frame comes, FCS included, then its end" -> { dut =>
      val random = new Random(1)
      for (size <- Seq(1, 4, 5, 64, 200); cycles <- 1 to 4) {
        val bytes               = Seq.fill(size)(random.nextInt(256))
        val nibbles             = bytes.flatMap(b => Seq(b & 0xf, b >> 4))
        assert(receive(dut, nibbles, cycles) == (bytes             -> true))
        assert(receive(dut, nibbles, cycles, bad = true) == (bytes -> false))
        // An odd nibble is no byte, also behind a good frame, and the next frame begins anew.
        assert(receive(dut, nibbles :+ 7, cycles) == (bytes             -> true))
        assert(receive(dut, nibbles :+ 7, cycles, bad = true) == (bytes -> false))
      }
      assert(receive(dut, Nil, 2, bad = true) == (Nil -> false), "nothing but preamble")
    }
  )
}

package flyframe.memory

import chiseltest._
import chiseltest.simulator.VerilatorBackendAnnotation
import org.scalatest.flatspec.AnyFlatSpec

/** Rules FP-32 and FP-33: register writes wait for the end of the frame. */
class WriteLogSpec extends AnyFlatSpec with ChiselScalatestTester {
  private case class Write(address: Int, mask: Int, data: BigInt)

  private class Bench(dut: WriteLog, lanes: Int) {
    dut.clock.setTimeout(0)
    var replayed: Vector[Write] = Vector.empty

    def step(): Unit = {
      if (dut.replay.valid.peek().litToBoolean)
        replayed :+= Write(
          dut.replay.bits.address.peek().litValue.toInt,
          dut.replay.bits.mask.peek().litValue.toInt,
          dut.replay.bits.data.peek().litValue
        )
      dut.clock.step()
    }
    def idle(cycles: Int): Unit = (0 until cycles).foreach(_ => step())
    def frame(): Unit           = { dut.frameStart.poke(true); step(); dut.frameStart.poke(false) }
    def commit(): Unit = {
      dut.commit.poke(true)
      assert(dut.replayStarts.peek().litToBoolean)
      step()
      dut.commit.poke(false)
    }
    def full: Boolean = dut.full.peek().litToBoolean

    /** Takes the bytes of `w` one by one, as the frame brings them, and logs the word with the last. */
    def write(w: Write): Unit = {
      val bytes = (0 until lanes).count(l => (w.mask >> l & 1) == 1)
      dut.byteAccepted.poke(true)
      idle(bytes - 1)
      dut.write.valid.poke(true)
      dut.write.bits.address.poke(w.address)
      dut.write.bits.mask.poke(w.mask)
      dut.write.bits.data.poke(w.data)
      step()
      dut.write.valid.poke(false)
      dut.byteAccepted.poke(false)
    }
  }
  private val random = new scala.util.Random(1)
  private def writes(lanes: Int, count: Int): Vector[Write] = Vector.fill(count)(
    Write(random.nextInt(4096 / lanes), 1 + random.nextInt((1 << lanes) - 1), BigInt(8 * lanes, random))
  )
  private def bench(lanes: Int, depth: Int)(run: Bench => Unit): Unit =
    test(new WriteLog(lanes, depth)).withAnnotations(Seq(VerilatorBackendAnnotation))(dut =>
      run(new Bench(dut, lanes))
    )

  for (lanes <- Seq(1, 2, 4)) {
    s"FP-32: the log of $lanes-byte words" should "play back on commit, in order, each write once" in
      bench(lanes, 64) { b =>
        val sent = writes(lanes, 16)
        b.frame()
        sent.foreach(b.write)
        b.idle(100)
        assert(b.replayed.isEmpty, "nothing before the frame has ended")
        b.commit()
        b.idle(20)
        assert(b.replayed == sent)
        b.idle(100)
        assert(b.replayed == sent, "nor again")
      }

    s"FP-33: the log of $lanes-byte words" should "forget a frame that does not end well" in bench(
      lanes,
      64
    ) { b =>
      b.frame()
      writes(lanes, 5).foreach(b.write)
      val sent = writes(lanes, 3)
      b.frame()
      sent.foreach(b.write)
      b.commit()
      b.idle(20)
      assert(b.replayed == sent)
      b.frame()
      b.commit()
      b.idle(20)
      assert(b.replayed == sent, "a frame without register writes")
    }

    // 16 is the smallest depth a parameter set may have, 100 no power of two.
    for (depth <- Seq(16, 100))
      s"B-17: a log of $depth bytes in $lanes-byte words" should "be full after that many bytes, until the next frame" in
        bench(lanes, depth) { b =>
          val all = (1 << lanes) - 1
          // Single bytes need the most entries, whole words the most bytes for each.
          for (mask <- Seq(1, all).distinct) {
            val bytes = Integer.bitCount(mask)
            val sent  = writes(lanes, depth / bytes).map(_.copy(mask = mask))
            b.frame()
            b.replayed = Vector.empty
            for (w <- sent) {
              assert(!b.full)
              b.write(w)
            }
            assert(b.full)
            b.commit()
            // The next frame begins 24 slots behind this one and may write 88 slots behind it.
            b.idle(24)
            b.frame()
            assert(!b.full)
            b.idle(depth)
            assert(b.replayed == sent)
          }
        }
  }

  "The log" should "play on while the next frame starts" in bench(1, 88) { b =>
    val (one, two) = (writes(1, 88), writes(1, 3))
    b.frame()
    one.foreach(b.write)
    b.commit()
    b.idle(24)
    b.frame()
    b.idle(64) // 25 MHz, where a slot is a cycle: the next register write comes no earlier
    two.foreach(b.write)
    b.commit()
    b.idle(20)
    assert(b.replayed == one ++ two)
  }
}

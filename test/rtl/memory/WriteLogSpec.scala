package flyframe.memory

import chiseltest._
import org.scalatest.Assertions
import org.scalatest.flatspec.AnyFlatSpec
import flyframe.SharedSimulation

/** Rules FP-32 and FP-33: register writes wait for the end of the frame. */
class WriteLogSpec extends AnyFlatSpec with SharedSimulation {
  private case class Write(address: Int, mask: Int, data: BigInt)

  private class Bench(dut: WriteLog, lanes: Int) extends Assertions {
    var replayed: Vector[Write] = Vector.empty

    /** Whether the log is held in a cycle. */
    var holds: () => Boolean = () => false
    private var held         = false

    def step(): Unit = {
      if (dut.replay.valid.peekBoolean()) {
        assert(!held, "the cycle behind belongs to others")
        replayed :+= Write(
          dut.replay.bits.address.peekInt().toInt,
          dut.replay.bits.mask.peekInt().toInt,
          dut.replay.bits.data.peekInt()
        )
      }
      held = holds()
      dut.hold.poke(held)
      dut.clock.step()
    }
    def idle(cycles: Int): Unit = (0 until cycles).foreach(_ => step())
    def frame(): Unit           = { dut.frameStart.poke(true); step(); dut.frameStart.poke(false) }
    def commit(): Unit = {
      dut.commit.poke(true)
      assert(dut.replayStarts.peekBoolean())
      step()
      dut.commit.poke(false)
    }
    def full: Boolean = dut.full.peekBoolean()

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

  // 16 is the smallest depth a parameter set may have, 88 the largest at 25 MHz, 100 no power of two.
  for ((lanes, depth) <- Seq(1 -> 16, 1 -> 88, 2 -> 100, 4 -> 16)) {
    def check(name: String)(run: Bench => Unit): (String, WriteLog => Unit) =
      name -> (dut => run(new Bench(dut, lanes)))
    together(s"$depth bytes in $lanes-byte words", new WriteLog(lanes, depth))(
      check("FP-32: the log plays back on commit, in order, each write once") { b =>
        val sent = writes(lanes, depth / lanes)
        b.frame()
        sent.foreach(b.write)
        b.idle(100)
        assert(b.replayed.isEmpty, "nothing before the frame has ended")
        b.commit()
        b.idle(depth + 4)
        assert(b.replayed == sent)
        b.idle(depth + 4)
        assert(b.replayed == sent, "nor again")
      },
      check("B-115: a log that is held plays all of it, later") { b =>
        val random = new scala.util.Random(1)
        val sent   = writes(lanes, depth / lanes)
        b.frame()
        sent.foreach(b.write)
        b.holds = () => random.nextInt(3) == 0
        b.commit()
        b.idle(3 * depth)
        assert(b.replayed == sent)
        b.holds = () => false
        b.idle(depth)
        assert(b.replayed == sent)
      },
      check("FP-33: the log forgets a frame that does not end well") { b =>
        b.frame()
        writes(lanes, 4).foreach(b.write)
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
      },
      check("B-17: the log is full after that many bytes, until the next frame") { b =>
        // Single bytes need the most entries, whole words the most bytes for each.
        for (mask <- Seq(1, (1 << lanes) - 1).distinct) {
          val sent = writes(lanes, depth / Integer.bitCount(mask)).map(_.copy(mask = mask))
          b.frame()
          b.replayed = Vector.empty
          for (w <- sent) {
            assert(!b.full)
            b.write(w)
          }
          assert(b.full)
          b.commit()
          b.idle(24)
          b.frame()
          assert(!b.full)
          b.idle(depth)
          assert(b.replayed == sent)
        }
      },
      check("FP-32: the log plays on while the next frame starts") { b =>
        val (one, two) = (writes(lanes, depth / lanes), writes(lanes, 3))
        b.frame()
        one.foreach(b.write)
        b.commit()
        // The next frame begins 24 slots behind this one and writes 88 slots behind it, at 25 MHz as many
        // cycles.
        b.idle(24)
        b.frame()
        b.idle(64 max depth - 24)
        two.foreach(b.write)
        b.commit()
        b.idle(20)
        assert(b.replayed == one ++ two)
      }
    )
  }
}

package flyframe.can

import chisel3._
import chiseltest._
import flyframe.Simulation
import org.scalatest.flatspec.AnyFlatSpec
import scala.collection.mutable
import scala.util.Random

class ReceiveFifoSpec extends AnyFlatSpec with ChiselScalatestTester {
  "CAN-44: the FIFO" should "keep frames whole and in order, drop what finds it full, and count" in
    test(new ReceiveFifo(16)).withAnnotations(Simulation.annotations(this, "fifo")) { dut =>
      val random = new Random(1)
      val inside = mutable.Queue.empty[Seq[Long]]
      var drops  = 0
      for (s <- Seq(dut.store.valid, dut.accept, dut.releases)) s.poke(false)

      def word() = random.nextLong(1L << 32)
      def pulse(signal: Bool): Unit = {
        signal.poke(true)
        dut.clock.step()
        signal.poke(false)
      }
      for (i <- 1 to 2000) {
        // Longer than it holds is full at one time, empty at another.
        if (random.nextInt(100) < (if (i / 200 % 2 == 0) 70 else 30)) {
          val words = Seq.fill(4)(word())
          // Part of a frame that does not come to its end, then a whole one.
          for (at <- Seq(2, 0).take(random.nextInt(3)) ++ Seq(0, 2, 3)) {
            dut.store.bits.poke(at)
            dut.word.poke(if (at == 2 && random.nextBoolean()) word() else words(at))
            pulse(dut.store.valid)
            dut.store.bits.poke(at)
            dut.word.poke(words(at))
            pulse(dut.store.valid)
          }
          dut.second.poke(words(1))
          dut.accept.poke(true)
          val isDropped = dut.drops.peekBoolean()
          assert(isDropped == (inside.size == 16), i)
          pulse(dut.accept)
          if (isDropped) drops += 1 else inside.enqueue(words)
        } else {
          pulse(dut.releases)
          if (inside.nonEmpty) inside.dequeue()
        }
        dut.level.expect(inside.size)
        for (oldest <- inside.headOption; at <- 0 to 3) {
          dut.read.poke(at)
          dut.clock.step()
          dut.data.expect(oldest(at), s"word $at, step $i")
        }
      }
      assert(drops > 100)
    }
}

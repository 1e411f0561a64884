package flyframe.can

import chisel3._
import chisel3.util.Valid
import chiseltest._
import flyframe.Simulation
import org.scalatest.flatspec.AnyFlatSpec
import scala.util.Random

class WordCountersSpec extends AnyFlatSpec {
  private val counters = Seq(
    WordCounter(word = 0, lane = Some(0), waiting = 1),
    WordCounter(word = 0, lane = Some(3), waiting = 2),
    WordCounter(word = 3, lane = Some(2), waiting = 5),
    WordCounter(word = 4, lane = None, waiting = 2),
    WordCounter(word = 7, lane = None, waiting = 5)
  )

  /** Counters with their memory, and a host that reads it and may write it. */
  private class Bench extends Module {
    val events = IO(Input(Vec(counters.size, Bool())))
    val waits  = IO(Output(Bool()))
    val job    = IO(Input(Valid(new MemoryJob)))
    val done   = IO(Output(Bool()))
    val word   = IO(Output(UInt(32.W)))

    private val memory = Module(new PortMemory(2))
    private val unit   = Module(new WordCounters(counters))
    unit.events         := events
    waits               := unit.waits
    memory.job(0)       := job
    memory.job(1)       := unit.job
    done                := memory.done(0)
    unit.done           := memory.done(1)
    word                := memory.word
    memory.load.valid   := false.B
    memory.load.bits    := 0.U
    memory.order.valid  := false.B
    memory.order.bits   := 0.U
    memory.filter.valid := false.B
    memory.filter.bits  := 0.U
  }

  "FR-14, FR-45: counters in words of a memory" should
    "count each event once, bytes up to 255, words with their carries" in
    RawTester.test(new Bench, Simulation.annotations(this, "counters")) { dut =>
      val random = new Random(5)
      val counts = Array.fill(counters.size)(0L)

      /** A job of the host: reads a word, and writes it if there is something to be written. */
      def access(word: Int, write: Option[Long] = None): Long = {
        val job = dut.job.bits
        for (place <- Seq(job.source, job.target)) place.poke(PortMemory.Counters + word)
        job.write.poke(write.nonEmpty)
        job.counts.poke(false)
        job.wide.poke(false)
        job.bytes.poke(if (write.nonEmpty) 15 else 0)
        job.data.poke(write.getOrElse(0L))
        dut.job.valid.poke(true)
        while (!dut.done.peekBoolean()) dut.clock.step()
        val read = dut.word.peekInt().toLong
        dut.clock.step()
        dut.job.valid.poke(false)
        read
      }
      def settle(): Unit = {
        dut.clock.step() // until it is seen that something waits
        while (dut.waits.peekBoolean()) dut.clock.step()
      }
      def check(): Unit = {
        settle()
        for (word <- 0 until 8) {
          val wanted = counters.zip(counts).filter(_._1.word == word).map { case (c, count) =>
            c.lane.fold(count & 0xffffffffL)(lane => (count min 255) << 8 * lane)
          }
          assert(access(word) == wanted.sum, s"word $word")
        }
      }
      for (e <- dut.events) e.poke(false)
      dut.job.valid.poke(false)
      dut.clock.step(300)
      check()
      // Words near their carries.
      for (
        (c, i) <- counters.zipWithIndex if c.lane.isEmpty;
        start  <- Seq(0xfeL, 0xfffdL, 0xfffffeL, 0xfffffffcL)
      ) {
        access(c.word, Some(start))
        counts(i) = start
        for (_ <- 0 until 6) {
          dut.events(i).poke(true)
          dut.clock.step()
          dut.events(i).poke(false)
          counts(i) += 1
          check()
        }
      }
      // As many at once as may be; then at random.
      for (round <- 0 until 150) {
        val left = counters.map(c => if (c.waiting == 1) 1 else (1 << c.waiting) - 1).toArray
        for (_ <- 0 until random.nextInt(20)) {
          for (i <- counters.indices) {
            val happens = left(i) > 0 && random.nextInt(3) > 0
            dut.events(i).poke(happens)
            if (happens) {
              left(i) -= 1
              counts(i) += 1
            }
          }
          dut.clock.step()
          for (e <- dut.events) e.poke(false)
          if (random.nextInt(4) == 0) access(random.nextInt(8))
        }
        check()
      }
      assert(counts(0) < 255 && counts(2) > 255)
    }
}

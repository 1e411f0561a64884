package flyframe.can

import chiseltest._
import flyframe.Simulation
import org.scalatest.flatspec.AnyFlatSpec
import scala.util.Random

class PortMemorySpec extends AnyFlatSpec {
  private val Jobs = 3

  /** What a job asks for. */
  private case class Job(source: Int, target: Int, write: Boolean, counts: Boolean, bytes: Int, data: Long) {
    def result(word: Long): Long = (0 until 4).map { i =>
      val old    = word >> 8 * i & 255
      val isMine = (bytes >> i & 1) == 1
      val byte   = if (!isMine) old else if (counts) (old + 1) min 255 else data >> 8 * i & 255
      byte << 8 * i
    }.sum
  }

  "CAN-43, CAN-46: the memory of a port" should
    "be clear, do one job after the other, the most urgent first, and let loads pass" in
    RawTester.test(new PortMemory(Jobs), Simulation.annotations(this, "memory")) { dut =>
      val random = new Random(6)
      val words  = Array.fill(PortMemory.Words)(0L)
      val jobs   = Array.fill(Jobs)(Option.empty[Job])
      var done   = 0
      // What has been read, to be seen in the next cycle.
      var wanted = Option.empty[Long]
      // A job that has been begun, and how long ago: its word counts from the third cycle on.
      var under = Option.empty[Int]

      def few          = random.nextInt(12)
      def place(): Int = random.nextInt(4) << 6 | few
      def show(n: Int, job: Option[Job]): Unit = {
        val pin = dut.job(n)
        pin.valid.poke(job.nonEmpty)
        for (j <- job) {
          pin.bits.source.poke(j.source)
          pin.bits.target.poke(j.target)
          pin.bits.write.poke(j.write)
          pin.bits.counts.poke(j.counts)
          pin.bits.wide.poke(false)
          pin.bits.bytes.poke(j.bytes)
          pin.bits.data.poke(j.data)
        }
      }
      for (n <- 0 until Jobs) show(n, None)
      dut.load.valid.poke(false)
      dut.order.valid.poke(false)
      dut.filter.valid.poke(false)
      dut.orderReady.expect(false)
      var clearing = 0
      while (!dut.orderReady.peekBoolean()) {
        dut.clock.step()
        clearing += 1
      }
      assert(clearing == PortMemory.Words)
      for (cycle <- 0 until 60000) {
        for (n <- 0 until Jobs if jobs(n).isEmpty && random.nextInt(6) == 0) {
          val source = place()
          jobs(n) = Some(
            Job(
              source,
              if (random.nextInt(3) == 0) place() else source,
              random.nextInt(4) > 0,
              random.nextInt(3) == 0,
              random.nextInt(16),
              random.nextLong(1L << 32)
            )
          )
          show(n, jobs(n))
        }
        val (load, order, filter)    = (random.nextInt(4) == 0, random.nextBoolean(), random.nextBoolean())
        val (loads, orders, filters) = (few, random.nextInt(4), few)
        dut.load.valid.poke(load)
        dut.load.bits.poke(loads)
        dut.order.valid.poke(order)
        dut.order.bits.poke(orders)
        dut.filter.valid.poke(filter)
        dut.filter.bits.poke(filters)
        for (word <- wanted) dut.data.expect(word, s"cycle $cycle: what was read")
        val finished = dut.done.peekInt().toInt
        assert(Integer.bitCount(finished) <= 1)
        for (n <- 0 until Jobs if (finished >> n & 1) == 1) {
          val job = jobs(n).get
          assert(under.contains(n), s"cycle $cycle: job $n was not begun")
          if (!job.counts) dut.word.expect(job.result(words(job.source)), s"cycle $cycle: job $n")
          done += 1
        }
        val isReady = dut.orderReady.peekBoolean()
        // Whoever may read in this cycle: a load, a job, an identifier, a filter.
        val isFree = under.isEmpty
        wanted =
          if (load) Some(words(loads))
          else if (isFree && jobs.exists(_.nonEmpty)) None
          else if (order) Some(words(orders << 2))
          else if (filter) Some(words(PortMemory.Filters << 6 | filters))
          else None
        assert(isReady == (!load && !(isFree && jobs.exists(_.nonEmpty))), s"cycle $cycle")
        dut.filterReady.expect(isReady && !order)
        if (isFree && !load) under = jobs.indices.find(jobs(_).nonEmpty)
        // A word that is written in this cycle is read as it was.
        dut.clock.step()
        for (n <- 0 until Jobs if (finished >> n & 1) == 1) {
          for (job <- jobs(n) if job.write) words(job.target) = job.result(words(job.source))
          jobs(n) = None
          show(n, None)
          under = None
        }
      }
      assert(done > 5000)
    }
}

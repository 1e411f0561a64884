package flyframe.can

import chiseltest._
import flyframe.Simulation
import flyframe.registers.CanRegisters
import org.scalatest.flatspec.AnyFlatSpec
import scala.util.Random

class EventRecorderSpec extends AnyFlatSpec with ChiselScalatestTester {

  /** The recorder, a memory that is busy at times, and what a port remembers. */
  private class Bench(dut: EventRecorder, random: Random) {
    val records         = new CanRecords
    private val words   = Array.fill(PortMemory.Words)(0L)
    private val places  = Seq(CanRegisters.LastError, CanRegisters.Counters, CanRegisters.Counters + 4)
    private val address = places.map(PortMemory.register(_).litValue.toInt)
    private var left    = 0 // cycles until the job is done; 0: none
    private var stalls  = 0
    private var under   = ""
    private var ordered = false

    private def job = Seq(dut.job.bits.target, dut.job.bits.bytes, dut.job.bits.counts, dut.job.bits.data)
      .map(_.peekInt().toLong)

    private def carryOut(): Unit = {
      val Seq(at, bytes, counts, data) = job
      dut.job.bits.source.expect(at)
      for (i <- 0 until 4 if (bytes >> i & 1) == 1) {
        val old = words(at.toInt) >> 8 * i & 0xff
        val now = if (counts == 1) (old + 1) min 255 else data >> 8 * i & 0xff
        words(at.toInt) += now - old << 8 * i
      }
    }

    /** A cycle; an error, a lost arbitration, an overrun, bus-off, an order to clear. */
    def cycle(
        error: Option[(Int, Boolean, Int, Int)] = None,
        lost: Option[Int] = None,
        overrun: Boolean = false,
        busOff: Boolean = false,
        clear: Boolean = false
    ): Unit = {
      // Another read may come first; or another job, if it was there first.
      if (left == 0 && !dut.job.valid.peekBoolean()) stalls = random.nextInt(4)
      else if (left == 0 && stalls > 0) stalls -= 1
      else if (left == 0) { left = 3; stalls = random.nextInt(8) / 7 }
      dut.error.valid.poke(error.isDefined)
      for ((kind, sender, field, bit) <- error) {
        dut.error.bits.kind.poke(kind)
        dut.error.bits.sender.poke(sender)
        dut.error.bits.field.poke(field)
        dut.error.bits.bit.poke(bit)
        records.error(kind, sender, field, bit)
      }
      dut.lost.valid.poke(lost.isDefined)
      for (bit <- lost) {
        dut.lost.bits.poke(bit)
        records.lost(bit)
      }
      dut.overrun.poke(overrun)
      if (overrun) records.overrun()
      dut.busOff.poke(busOff)
      if (busOff) records.busOff()
      dut.clear.poke(clear)
      if (ordered) records.clear()
      ordered = clear
      if (left == 3) under = job.take(3).toString
      if (left == 1) carryOut()
      dut.done.poke(left == 1)
      if (left > 0) {
        assert(dut.job.valid.peekBoolean() && job.take(3).toString == under, "a job changes")
        left -= 1
      }
      dut.clock.step()
    }

    def settle(): Unit = for (_ <- 1 to 60) cycle()

    /** A host may read: nothing is being cleared. */
    def isReadable: Boolean = !dut.clears.peekBoolean()

    def shown: Seq[Long] = address.map(words(_))
    def meant: Seq[Long] = {
      def counters(from: Int) = (0 until 4).map(i => records.counter(from + i).toLong << 8 * i).sum
      val last = records.errorType | (if (records.asSender) 8 else 0) | records.errorField << 8 |
        records.errorBit << 16 | records.lostBit << 24
      Seq(last.toLong, counters(0), counters(4))
    }
  }

  private def bench(seed: Int)(body: Bench => Unit) =
    test(new EventRecorder).withAnnotations(Simulation.annotations(this, "recorder")) { dut =>
      body(new Bench(dut, new Random(seed)))
    }

  private def anError(random: Random) =
    Some((1 + random.nextInt(5), random.nextBoolean(), random.nextInt(32), random.nextInt(32)))

  // A bit has eight cycles or more, of which a synchronisation may take four away; it needs two bits.
  "CAN-46: errors as close as bits may be" should "all be counted, each by its kind, around a clear" in
    bench(1) { b =>
      val random = new Random(2)
      for (apart <- Seq(Seq(4, 8), Seq(8, 4), Seq(8, 8)); clearAt <- 0 until 48; n <- 1 to 6) {
        val times = (0 until n).scanLeft(0)((t, i) => t + apart(i % 2)).take(n)
        for (t <- 0 until 60)
          b.cycle(if (times.contains(t)) anError(random) else None, clear = t == clearAt)
        b.settle()
        assert(b.shown == b.meant, s"$n errors $apart cycles apart, clear in cycle $clearAt")
      }
    }

  "CAN-46: events at random" should "be counted, and the last of them recorded" in bench(3) { b =>
    val random  = new Random(4)
    var largest = 0
    for (round <- 1 to 400) {
      val since = Array.fill(4)(100) // cycles since an error, a lost arbitration, an overrun, bus-off
      val busy  = 1 + random.nextInt(20)
      for (_ <- 1 to 150) {
        def happens(which: Int, apart: Int) = {
          val so = since(which) >= apart && random.nextInt(busy) == 0
          since(which) = if (so) 1 else since(which) + 1
          so
        }
        b.cycle(
          if (happens(0, 8)) anError(random) else None,
          if (happens(1, 60)) Some(random.nextInt(64)) else None,
          happens(2, 60),
          happens(3, 60),
          b.isReadable && random.nextInt(100) == 0 // else the host's order waits
        )
      }
      b.settle()
      assert(b.isReadable && b.shown == b.meant, s"round $round")
      largest = largest max (0 to 7).map(b.records.counter).max
    }
    assert(largest > 10)
  }
}

package flyframe.relay.model

import flyframe.Tier
import flyframe.relay._
import org.scalatest.flatspec.AnyFlatSpec
import scala.util.Random

/** Relay mode bit by bit at full load, with clocks that are off. */
class RelayClocksSpec extends AnyFlatSpec {
  private val bits =
    Tier("Relay mode bit by bit with clocks that are off", "bits", test = 8000, soak = 1000000)
  private val Count = 6

  private def fullLoad(periods: IndexedSeq[Long]): RingLoad = {
    val setting = RelayRingSetting(IndexedSeq.fill(Count)(400000L), periods)
    val l       = new RingLoad(new RelayBitRing(setting), seed = 1, confirmUs = 2000, upUs = 500)
    val start   = l.ring.now
    l.saturate()
    // Frames that follow a confirmation are requested between two steps.
    while (l.ring.now < start + bits.size / 2 * RingLoad.Us) l.ring.runUs(10) // 2 Mbit/s
    l
  }
  private def errors(l: RingLoad): Long = {
    import RelayCounter._
    Seq(BadHeader, BadHeader + 1, BadFrame, BadFrame + 1, Aborted).map(l.total).sum
  }
  private def isRight(l: RingLoad): Unit = {
    l.stop()
    l.finish()
    assert(l.wrong.isEmpty, l.wrong.take(5).mkString("\n", "\n", ""))
    assert(errors(l) == 0 && l.failed == 0 && l.confirmed > bits.size / 300)
    assert(l.received == l.confirmed.toLong * (Count - 1))
  }

  "FR-40: nodes with clocks within 100 ppm" should "send all they can without an error" in
    bits.run("100 ppm", bits.size, Some(1)) {
      val random = new Random(1)
      isRight(fullLoad(IndexedSeq.fill(Count)(20000L + random.nextInt(5) - 2)))
    }

  "FR-40: neighbours 1,000 ppm apart" should "send all they can without an error" in
    bits.run("1,000 ppm between neighbours", bits.size, Some(1)) {
      isRight(fullLoad(IndexedSeq.tabulate(Count)(n => if (n % 2 == 0) 20010L else 19990L)))
    }

  "FR-40: neighbours 30,000 ppm apart" should "have errors" in
    assert(errors(fullLoad(IndexedSeq.tabulate(Count)(n => if (n % 2 == 0) 20300L else 19700L))) > 0)
}

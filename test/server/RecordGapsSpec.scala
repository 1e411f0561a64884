package flyframe.server

import org.scalatest.flatspec.AnyFlatSpec
import flyframe.protocol.EventKind
import scala.util.Random

class RecordGapsSpec extends AnyFlatSpec {
  private def record(node: Int, sequence: Int, time: Long = 0, epoch: Int = 1) =
    Event(EventKind.Detector, 0, node, sequence & 0xffff, 1, epoch, if (time == 0) 1000L * sequence else time)
  private def gaps(records: Event*): RecordGaps = {
    val gaps = new RecordGaps
    records.foreach(gaps.seen)
    gaps
  }

  /** When no slave has anything to tell any more. */
  private def missing(records: Event*): Map[Int, Int] = {
    val g = gaps(records: _*)
    records.map(_.node).distinct.foreach(g.settled(_, 0))
    g.missing
  }

  "SRV-21: a gap in a slave's numbers" should "be counted per slave, also where its epoch changes" in {
    assert(missing(record(1, 1), record(1, 2), record(2, 1), record(2, 5)) == Map(2 -> 3))
    assert(missing(record(1, 3), record(1, 5, epoch = 2), record(1, 6, epoch = 2)) == Map(1 -> 1))
    assert(missing(record(1, 7)) == Map.empty, "where the log begins is no gap")
  }

  it should "not count before the slave has nothing to tell any more, and be forgotten when it is filled" in {
    val g = gaps(record(1, 1), record(1, 4))
    assert(g.missing.isEmpty)
    g.settled(2, 0)
    g.settled(1, 1)
    assert(g.missing.isEmpty)
    g.settled(1, 0)
    assert(g.missing == Map(1 -> 2))
    g.seen(record(1, 6))
    assert(g.missing == Map(1 -> 2), "the next one")
    g.seen(record(1, 3))
    assert(g.missing == Map(1 -> 1))
    g.settled(1, 0)
    assert(g.missing == Map(1 -> 2))
  }

  it should "be none of two slaves with one ID" in {
    val g = gaps(
      (1 to 9).flatMap(n =>
        Seq(record(1, n), record(1, 3 * n, 7000L * n).copy(position = 1), record(2, n).copy(position = 1))
      ): _*
    )
    for (node <- 1 to 2; position <- 0 to 1) g.settled(node, position)
    assert(g.missing == Map(1 -> 16), "those of the second one")
  }

  it should "be none when records come out of order (seeds 1 to 50)" in {
    for (seed <- 1 to 50) {
      val random  = new Random(seed)
      val numbers = (1 to 200).sortBy(n => n + random.nextInt(16))
      assert(missing(numbers.map(record(1, _)): _*) == Map.empty, s"seed $seed")
      val lost = Set.fill(5)(20 + random.nextInt(100))
      assert(missing(numbers.filterNot(lost).map(record(1, _)): _*) == Map(1 -> lost.size), s"seed $seed")
    }
  }

  it should "be none where numbers wrap, whether 0 is left out or not" in {
    assert(missing((65530 to 65540).map(record(1, _)): _*) == Map.empty)
    assert(missing((65530 to 65540).filter(_ != 65536).map(record(1, _)): _*) == Map.empty)
    assert(missing((65530 to 65540).filter(_ != 65538).map(record(1, _)): _*) == Map(1 -> 1))
  }

  "SRV-21: after a restart of the slave" should "number 1 be expected" in {
    for (before <- Seq(5, 500, 40000)) {
      val run = (before - 3 to before).map(n => record(1, n, 1000000L + n))
      assert(missing(run ++ Seq(record(1, 1, 10), record(1, 2, 20)): _*).isEmpty, before)
      assert(missing(run ++ Seq(record(1, 3, 10), record(1, 2, 5)): _*) == Map(1 -> 1), before)
      assert(missing(run ++ Seq(record(1, 1, 2000000), record(1, 2, 2000001)): _*).isEmpty, "late")
    }
    def sameBegin(epoch: Int) = Seq(record(1, 1, 10, epoch), record(1, 2, 500L * (4 - epoch), epoch))
    assert(missing((1 to 3).flatMap(sameBegin): _*).isEmpty, "what each start tells first has the same time")
    val before = gaps(record(1, 25, 900), record(1, 27, 1000), record(1, 1, 10))
    assert(before.missing == Map(1 -> 1), "what it has not told before does not come any more")
    assert(missing((1 to 300).map(record(1, _)) ++ (1 to 9).map(n => record(1, n, n.toLong)): _*).isEmpty)
  }
}

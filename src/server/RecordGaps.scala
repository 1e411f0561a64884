package flyframe.server

import scala.collection.mutable

/** Which alarm records of a master's slaves the log does not have: gaps in their numbers, per node ID and
  * position, since two slaves may have one ID, in the order of the slave's time (SRV-21). Records may come
  * out of order, an alarm first, so a gap counts only when its slave has nothing to tell any more, and is
  * forgotten when it is filled.
  */
final class RecordGaps {
  import RecordGaps._
  private val nodes = mutable.Map.empty[(Int, Int), Node]

  /** A record is in the log. */
  def seen(e: Event): Unit = nodes.get((e.node, e.position)) match {
    case None       => nodes((e.node, e.position)) = new Node(new Run(e))
    case Some(node) => node.seen(e)
  }

  /** A slave has no records left that the log could still get. */
  def settled(node: Int, position: Int): Unit = nodes.get((node, position)).foreach(_.settle())

  /** How many records are missing, by node ID. */
  def missing: Map[Int, Int] =
    nodes.toSeq.groupMapReduce(_._1._1)(_._2.counted)(_ + _).filter(_._2 > 0)
}

object RecordGaps {

  /** Missing numbers that are known one by one, and records by which it is seen whether one came before. */
  private val MostKept = 4096
  private val Nearby   = 64

  /** By so many records one is overtaken at most: a slave holds no more. */
  private val Overtaken = 16

  /** Records from one start of a slave to the next, after the first that is known. */
  private final class Run(first: Event) {
    val missing      = mutable.TreeSet.empty[Int] // not wrapped: a number counts on from that of the first
    private val near = mutable.TreeMap(first.sequence -> first.slaveTime)

    /** The record's number, counted on from the latest one. */
    private def number(e: Event): Int = {
      val latest = near.lastKey
      latest + (e.sequence - latest).toShort
    }

    /** The record is of this run: numbers rise with the slave's time, and each comes once. */
    def has(e: Event): Boolean = {
      val n      = number(e)
      val before = first.sequence - Overtaken until first.sequence
      def fits =
        near.maxBefore(n).forall(_._2 <= e.slaveTime) && near.minAfter(n).forall(_._2 >= e.slaveTime)
      if (near.contains(n)) near(n) == e.slaveTime
      // One that is ahead by more than that is a low number after a restart.
      else
        ((near.lastKey + 1 to near.lastKey + MostKept).contains(n) || missing(n) || before.contains(
          n
        )) && fits
    }

    /** Records older than the first, or that came again: late ones, or, as a restart shows, those of the next
      * run. After each reset a slave may tell the same at the same time.
      */
    val older = mutable.Map.empty[Int, Long]

    def add(e: Event): Unit = {
      val n = number(e)
      if (n < first.sequence || near.contains(n)) older(n) = e.slaveTime
      for (i <- near.lastKey + 1 until n if missing.size < MostKept && (i & 0xffff) != 0) missing += i
      missing -= n
      near(n) = e.slaveTime
      if (near.size > Nearby) near -= near.firstKey
    }

    def startsAt1(known: Run): Unit =
      for (i <- 1 until first.sequence.min(MostKept) if !known.older.get(i).exists(_ <= first.slaveTime))
        missing += i
  }

  /** @param run
    *   the present one
    */
  private final class Node(private var run: Run) {
    private var former  = 0 // missing ones of runs before
    private var settled = mutable.Set.empty[Int]

    def counted: Int = former + settled.count(run.missing)

    def seen(e: Event): Unit =
      if (run.has(e)) run.add(e)
      else {
        // What has not come before a restart does not come any more.
        former += run.missing.size
        settled = mutable.Set.empty
        val next = new Run(e)
        next.startsAt1(run)
        run = next
      }

    def settle(): Unit = settled ++= run.missing
  }
}

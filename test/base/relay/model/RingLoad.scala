package flyframe.relay.model

import flyframe.can.CanFrame
import flyframe.relay._
import scala.collection.mutable
import scala.util.Random

/** A ring at load, and what becomes of each frame: the oracle of relay mode.
  *
  * @param confirmUs
  *   as in the register
  */
class RingLoad(val ring: RelayRing, seed: Long, confirmUs: Int = 10000, upUs: Int = 1000) {
  import RingLoad._
  private val setting = ring.setting
  private val count   = setting.count
  val random          = new Random(seed)
  val faults          = new RingFaults(ring, upUs, heldUs = 3 * upUs)

  /** A frame that is on its way, or has been for not longer than copies of it may be. */
  private class Sent(val number: Int, val source: Int, val slot: Int, val time: Long) {
    val got       = mutable.BitSet.empty
    var settled   = Option.empty[Boolean]
    var last      = time  // when it was received by the last node
    var isTouched = false // by a break
    var isUrgent  = false
  }
  private val sent    = mutable.LongMap.empty[Sent]
  private val bySlot  = Array.fill(count, 16)(Option.empty[Sent])
  private val joined  = Array.fill(count)(0L) // since when a node has been reachable
  private val lives   = Array.fill(count)(1)
  private var numbers = 0

  /** What went wrong. */
  val wrong: mutable.ArrayBuffer[String] = mutable.ArrayBuffer.empty

  var confirmed = 0
  var received  = 0L
  var failed    = 0

  /** The longest time from request to the last reception, in ps: of frames that no break touched, of others.
    */
  var longest      = 0L
  var longestBreak = 0L

  for (n <- 0 until count) {
    RingHost.start(ring, n, n + 1, confirmUs)
    ring.node(n).delivers = (header, frame) => delivered(n, header, frame)
    ring.node(n).slots.settles = (slot, isSent) => settles(n, slot, isSent)
  }
  faults.start()
  ring.runUs(upUs + 3.0 * confirmUs + 3000) // all have told their lives
  assert(faults.isWhole)

  private def number(frame: CanFrame) = frame.data.take(4).foldLeft(0)(_ << 8 | _)

  private def delivered(n: Int, header: LinkHeader, frame: CanFrame): Unit = {
    received += 1
    sent.get(number(frame)) match {
      case Some(f) =>
        if (f.source != header.source - 1) wrong += s"frame ${f.number} came with source ${header.source}"
        if (f.got(n) && joined(n) < f.time) wrong += s"frame ${f.number} of ${f.source} came twice to $n"
        f.got += n
        f.last = ring.now
      case None => wrong += s"$n received a frame of ${header.source} that nobody sent, or long ago"
    }
  }

  private var fill  = 0
  private var quiet = Set.empty[Int]

  private def settles(n: Int, slot: Int, isSent: Boolean): Unit = for (f <- bySlot(n)(slot)) {
    bySlot(n)(slot) = None
    if (fill > 0) ring.at(ring.now + Us)(fillUp(n))
    f.settled = Some(isSent)
    if (isSent) {
      confirmed += 1
      val missing =
        (0 until count).filter(m => m != n && faults.isAlive(m) && joined(m) < f.time && !f.got(m))
      if (missing.nonEmpty) wrong += s"frame ${f.number} of $n is confirmed, but not received by $missing"
      val took = f.last - f.time
      if (f.isUrgent) urgent += took
      if (keepsWays) ways += took
      // A node that starts listens first: FR-61.
      if (joined(n) > 0 && f.time < joined(n) + 3 * confirmUs * Us) ()
      else if (f.isTouched) longestBreak = longestBreak max took
      else longest = longest max took
    } else if (faults.isAlive(n) && joined(n) != Long.MaxValue) { // else it may be alone: FR-15
      failed += 1
      wrong += s"frame ${f.number} of $n failed"
    }
    ring.at(ring.now + Kept)(sent.remove(f.number))
  }

  /** The identifier of the next frame of a node that is not urgent; it must contain both, as this one does.
    */
  var identifier: (Int, Int) => Int = (n, number) =>
    (random.nextInt(0x3ff) + 1) << 19 | (n + 1) << 12 | number & 0xfff

  /** A frame of 8 bytes is requested, with a random priority if nothing else has been set, if the node has a
    * slot for it.
    */
  def request(n: Int, urgent: Boolean = false): Option[Int] =
    bySlot(n).indexWhere(_.isEmpty) match {
      case slot if slot >= 0 && faults.isAlive(n) =>
        numbers += 1
        val number = numbers
        val id     = if (urgent) (n + 1) << 12 | number & 0xfff else identifier(n, number)
        val f      = new Sent(number, n, slot, ring.now)
        f.isTouched = ring.now < touchedTill
        f.isUrgent = urgent
        sent(number) = f
        bySlot(n)(slot) = Some(f)
        val data = LinkFrame
          .bits(number, 32)
          .grouped(8)
          .map(bytes => bytes.foldLeft(0)((b, x) => b << 1 | (if (x) 1 else 0)))
        val frame = CanFrame(id & 0x1fffffff, true, false, 8, data.toSeq ++ Seq.fill(4)(random.nextInt(256)))
        ring.access(n)(RingHost.request(_, slot, frame))
        Some(number)
      case _ => None
    }

  private def fillUp(n: Int): Unit =
    if (!quiet(n)) while (bySlot(n).count(_.nonEmpty) < fill) request(n)

  /** All nodes but those of `quiet` send all that they can from so many slots. */
  def saturate(quiet: Set[Int] = Set.empty, slots: Int = 16): Unit = {
    this.quiet = quiet
    fill = slots
    for (n <- 0 until count) fillUp(n)
  }

  /** The time from request to last reception of the urgent frames, in ps. */
  val urgent: mutable.ArrayBuffer[Long] = mutable.ArrayBuffer.empty

  /** The same of all frames, if they are to be kept. */
  val ways: mutable.ArrayBuffer[Long] = mutable.ArrayBuffer.empty
  var keepsWays                       = false

  private var touchedTill = 0L

  /** Something breaks, or is mended: it touches what is on its way. */
  def touches(): Unit = {
    touchedTill = ring.now + Us * 50
    for (f <- sent.values if f.settled.isEmpty) f.isTouched = true
  }

  /** Frames at `perSecond` of the whole ring, at random times of random nodes, until `end`. */
  def load(perSecond: Int, end: Long): Unit = if (ring.now < end && !isStopped) {
    request(random.nextInt(count))
    ring.at(ring.now + (-math.log(1 - random.nextDouble()) * 1e12 / perSecond).toLong)(load(perSecond, end))
  }

  private var isStopped = false

  /** Nobody requests anything any more. */
  def stop(): Unit = {
    isStopped = true
    fill = 0
  }

  /** A node goes, or comes back with its next life. */
  def kill(n: Int): Unit = {
    faults.kill(n)
    for (slot <- 0 until 16; f <- bySlot(n)(slot)) {
      f.settled = Some(false)
      bySlot(n)(slot) = None
      ring.at(ring.now + Kept)(sent.remove(f.number))
    }
    ring.access(n)(RingHost.stop(_))
    joined(n) = Long.MaxValue
  }
  def revive(n: Int): Unit = {
    lives(n) = (lives(n) + 1) % 128
    ring.access(n)(RingHost.restart(_, lives(n)))
    faults.kill(n, isDead = false)
  }

  /** Nodes count from now on that have come back. */
  def join(): Unit = for (n <- 0 until count)
    if (joined(n) == Long.MaxValue && faults.isAlive(n)) joined(n) = ring.now

  /** Runs until every frame is settled. */
  def finish(): Unit = {
    val end = ring.now + 2000000 * Us
    while (sent.values.exists(_.settled.isEmpty) && ring.now < end) ring.runUs(1000)
    val left = sent.values.filter(_.settled.isEmpty)
    if (left.nonEmpty) wrong += s"${left.size} frames are neither confirmed nor failed"
  }

  def pendingFrames: Int                = sent.values.count(_.settled.isEmpty)
  def counter(n: Int, which: Int): Long = ring.node(n).counters(which)
  def total(which: Int): Long           = (0 until count).map(counter(_, which)).sum
  def most: Int                         = (0 until count).flatMap(ring.node(_).transits.map(_.most)).max
}

object RingLoad {
  val Us = 1000000L

  /** How long a frame is remembered after it has been settled. */
  private val Kept = 300000 * Us

  /** 51 nodes on 10 km, with clocks within `ppm`. */
  def setting(
      seed: Long,
      count: Int = 51,
      km: Double = 10,
      ppm: Int = 100,
      linkBit: Int = 25
  ): RelayRingSetting = {
    val random = new Random(seed)
    RelayRingSetting(
      IndexedSeq.fill(count)((km * 5000000 / count).toLong + 200000),
      IndexedSeq.fill(count)(20000L + (random.nextInt(2 * ppm + 1) - ppm) * 20000L / 1000000),
      linkBit
    )
  }
}

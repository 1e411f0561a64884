package flyframe.system

import scala.util.Random

/** The cables of a line or ring, and the slaves between them. A slave without power is a gap: the ones beside
  * it close their ports.
  *
  * Cable i leads to slave i; in a ring the last one leads back to the master. A frame from the far end of an
  * open ring passes slaves without being read, is turned round behind the cut, and is read on its way back.
  *
  * @param slaves
  *   the first one is next to the master
  */
class AlarmLineModel(
    val slaves: Array[SlaveModel],
    val ring: Boolean,
    random: Random,
    changed: () => Unit
) extends Bus {
  private val size   = slaves.length
  private val whole  = Array.fill(size + 1)(true)
  private val errors = Array.fill(size + 1)(0.0)
  private var noisy  = false

  // Slaves that each end reaches, and whether frames come round.
  private var near   = 0
  private var far    = 0
  private var closed = false

  /** Until then ports are being closed or opened: what passes is lost. */
  private var unstable = 0L

  /** Time in us; whoever drives the line sets it. */
  var now = 0L

  look()

  /** A cable is cut or mended. */
  def cable(number: Int, isWhole: Boolean): Unit = {
    whole(number) = isWhole
    look()
  }

  /** The bit error rate of a cable. */
  def noise(cable: Int, rate: Double): Unit = {
    errors(cable) = rate
    noisy = errors.exists(_ > 0)
    changed()
  }

  def power(slave: SlaveModel, on: Boolean): Unit = {
    slave.powered(on)
    look()
  }

  /** Two slaves take each other's place. */
  def swap(a: Int, b: Int): Unit = {
    val moved = slaves(a)
    slaves(a) = slaves(b)
    slaves(b) = moved
    look()
  }

  def isNoisy: Boolean = noisy

  /** Frames of a master come to this slave. */
  def reaches(position: Int): Boolean = position < near || position >= size - far

  private def look(): Unit = {
    def passes(cable: Int) =
      whole(cable) && (cable == 0 || slaves(cable - 1).isPowered) && (cable == size || slaves(
        cable
      ).isPowered)
    near = (0 until size).takeWhile(passes).size
    closed = ring && near == size && passes(size)
    far = if (ring && !closed) (0 until size).map(size - _).takeWhile(passes).size else 0
    unstable = now + random.nextInt(AlarmLineModel.Settling)
    changed()
  }

  /** A frame of this many bits is broken on a cable. */
  private def breaks(cable: Int, bits: Int) =
    errors(cable) > 0 && random.nextDouble() < 1 - math.exp(-errors(cable) * bits)

  override def exchange(end: Int, frame: BusFrame): Option[BusAnswer] = {
    // Where it is read, and over which cables it comes there.
    val first = if (end == 0) 0 else size - far
    val last  = if (end == 0) near else size
    var bits  = 8 * frame.bytes + BusFrame.OtherBits
    var good  = now >= unstable
    var bytes = frame.bytes
    val before =
      if (end == 1) {
        if (closed) {
          // Nobody reads what goes the wrong way round.
          for (c <- size to 0 by -1) if (noisy && breaks(c, bits)) good = false
          return if (good)
            Some(BusAnswer(0, 0, 0, 0, frame.reads.map(_ => None), frame.orders.map(_ => false), Nil))
          else None
        }
        if (noisy) for (c <- size until first by -1) if (breaks(c, bits)) good = false
        first + 1
      } else 0
    if (first >= last) return None
    // An unstable port loses the frame behind some of the slaves.
    val lost     = if (now >= unstable) Int.MaxValue else random.nextInt(size + 1)
    var count    = 0
    var or       = 0
    var taken    = List.empty[Appended]
    val blocks   = new Array[Option[SlaveBlock]](frame.reads.size)
    val executed = new Array[Boolean](frame.orders.size)
    var i        = first
    while (i < last) {
      if (noisy && i >= before && breaks(i, bits)) good = false
      if (i >= lost) good = false
      val slave = slaves(i)
      count += 1
      or |= slave.status
      if (bytes + BusFrame.RecordBytes <= BusFrame.Most) {
        val record = slave.appended()
        if (record.nonEmpty) {
          taken ::= Appended(count, slave.block.node, record.get)
          bytes += BusFrame.RecordBytes
          bits += 8 * BusFrame.RecordBytes
        }
      }
      i += 1
    }
    // What was to be read is read before what is written counts.
    for (r <- frame.reads.indices) {
      val place = first + frame.reads(r)
      blocks(r) = if (place < last) Some(slaves(place).block) else None
    }
    val reached = if (now < unstable) lost min last else last
    if (good || reached > first) write(frame, first, if (good) last else goodUpTo(first, reached), executed)
    if (noisy) {
      // Back from the last slave, or on to the other end of the ring.
      val back = if (end == 1) (last to last) else if (closed) (size to size) else (near - 1 to 0 by -1)
      for (c <- back) if (breaks(c, bits)) good = false
    }
    if (good)
      Some(
        BusAnswer(
          if (end == 0 && closed) 1 else end,
          count,
          count,
          or,
          blocks.toSeq,
          executed.toSeq,
          taken.reverse
        )
      )
    else None
  }

  /** Some slaves before the place where it broke have had a good frame. */
  private def goodUpTo(first: Int, last: Int): Int = first + random.nextInt(last - first + 1)

  private def write(frame: BusFrame, first: Int, last: Int, executed: Array[Boolean]): Unit = {
    for (a <- frame.acknowledges if first + a.position < last)
      slaves(first + a.position).acknowledge(a.sequence, a.guard, a.tag)
    var i = first
    while (i < last) {
      slaves(i).confirm(frame.number, frame.life)
      i += 1
    }
    for (o <- frame.orders.indices) {
      val place = first + frame.orders(o).position
      if (place < last) {
        slaves(place).command(frame.orders(o).bits)
        executed(o) = true
      }
    }
  }

  /** Cycles have been left out in which nothing happened. */
  def skip(cycles: Long): Unit = for (s <- slaves) s.skip(cycles)
}

object AlarmLineModel {

  /** A port needs up to this long, in us, to notice that its cable has changed. */
  val Settling = 3000
}

package flyframe.can.model

import flyframe.Tier
import flyframe.can._
import org.scalatest.flatspec.AnyFlatSpec
import scala.util.Random

/** Golden models on one bus, each with a clock of its own.
  *
  * @param periods
  *   of their core clocks, in units of time that are all the same
  * @param hears
  *   the level that a node hears: of the node's number, the time and the level of the bus
  */
class ModelBus(nodes: Seq[CanPortModel], periods: Seq[Int], hears: (Int, Long, Boolean) => Boolean) {
  private val next = Array.fill(nodes.size)(0L)

  /** The time up to which all is done. */
  var now: Long = 0

  /** Runs up to time `end`. */
  def run(end: Long): Unit = while (now < end) {
    var first = 0
    for (i <- 1 until next.length) if (next(i) < next(first)) first = i
    now = next(first)
    var level = true
    for (node <- nodes) level &= node.driven
    nodes(first).step(hears(first, now, level))
    next(first) += periods(first)
  }
}

/** Random buses: whatever is disturbed, no frame is received that was not sent, and none is forgotten. */
class RandomBusSpec extends AnyFlatSpec {
  private val tier   = Tier("CAN models on random buses", "frames", 1500, 300000)
  private val Frames = 24 // on each bus

  /** A frame that tells its sender, and is unlike all others. */
  private def frame(random: Random, node: Int, number: Int): CanFrame = {
    val extended = random.nextBoolean()
    val low      = number << 3 | node
    val id       = if (extended) random.nextInt(1 << 18) << 11 | low else low
    if (random.nextInt(6) == 0) CanFrame(id, extended, remote = true, random.nextInt(9), Nil)
    else {
      val dlc = random.nextInt(9)
      CanFrame(id, extended, remote = false, dlc, Seq.fill(dlc)(random.nextInt(256)))
    }
  }

  private val settings = Seq(
    1 -> BitSetting(38, 10, 4), // 49 tq
    2 -> BitSetting(18, 5, 4),
    4 -> BitSetting(9, 3, 2),
    5 -> BitSetting(6, 3, 2)
  )

  /** A bus of 2 to 4 nodes, each of which has frames to send. */
  private class Bus(seed: Long, disturbances: Int) {
    private val random          = new Random(seed)
    private val count           = 2 + random.nextInt(3)
    private val (prescaler, s0) = settings(random.nextInt(settings.size))
    private val setting         = s0.copy(threeSamples = random.nextInt(4) == 0)
    private val models          = Seq.fill(count)(new CanPortModel)
    val nodes: Seq[LowerTester] = models.map(m => new LowerTester(m, Rate("", prescaler, setting)))
    private val oneShot         = Seq.fill(count)(random.nextInt(4) == 0)

    // Clocks within 4,000 ppm.
    private val periods = Seq.fill(count)(10000 + random.between(-40, 41))
    val bit: Long       = setting.length * prescaler * 10000L

    // Times within which single nodes hear the wrong level, sorted by node.
    private val span = 130L * Frames * bit
    private val wrong = Seq.fill(count)(
      Seq
        .fill(disturbances)(random.nextLong(span))
        .sorted
        .map(t => t -> (t + random.nextInt((2 * bit).toInt)))
        .toArray
    )
    private val at = Array.fill(count)(0)
    private def hears(node: Int, time: Long, level: Boolean) = {
      val all = wrong(node)
      while (at(node) < all.length && all(at(node))._2 < time) at(node) += 1
      level ^ (at(node) < all.length && all(at(node))._1 <= time)
    }
    private val bus = new ModelBus(models, periods, hears)

    val frames: Seq[Seq[CanFrame]] =
      Seq.tabulate(count)(n => Seq.tabulate(Frames / count min 16)(i => frame(random, n, 1 + i)))

    for ((node, n) <- nodes.zipWithIndex) {
      node.setTiming(prescaler, setting)
      node.setFilter(0, CanFiltersModel.InUse, 0)
      val modes = CanCases.RecoversItself | (if (oneShot(n)) CanCases.OneShot else 0) |
        (if (setting.threeSamples) CanCases.ThreeSamples else 0)
      node.setControl(1 | modes)
      for ((frame, slot) <- frames(n).zipWithIndex) node.setSlot(slot, frame)
    }
    // Requests come one after the other.
    private val requests =
      random.shuffle(for (n <- frames.indices; slot <- frames(n).indices) yield (n, slot))
    for ((n, slot) <- requests) {
      nodes(n).requestAt(slot -> frames(n)(slot))
      bus.run(bus.now + random.nextInt(200) * bit)
    }
    // The disturbances are over; a recovery takes 1,408 bits.
    private val longest = span + 20000 * bit
    while (nodes.exists(_.pending != 0) && bus.now < longest) bus.run(bus.now + 100 * bit)
    bus.run(bus.now + 20 * bit)

    /** What each node has received. */
    val received: Seq[Seq[CanFrame]] = nodes.map(_.received())
    def isOneShot(n: Int): Boolean   = oneShot(n)
    val what = s"seed $seed, $count nodes, prescaler $prescaler, $setting, clocks $periods"
  }

  private def buses(part: String, seed: Long, disturbances: Int)(check: Bus => Unit): Unit =
    tier.run(part, tier.size / 2, Some(seed)) {
      for (n <- 0L until tier.size / 2 / Frames) check(new Bus(seed + n, disturbances))
    }

  "CAN-01 to CAN-06: nodes with clocks up to 4,000 ppm off" should
    "exchange frames without an error" in buses("clocks", 1000, 0) { bus =>
      for ((node, n) <- bus.nodes.zipWithIndex) {
        assert(node.counters.take(5) == Seq.fill(5)(0), bus.what)
        val sent = bus.frames(n).indices.map(1 << _).sum
        assert(if (bus.isOneShot(n)) (node.sent | node.failed) == sent else node.sent == sent, bus.what)
        val others = for {
          (frames, m) <- bus.frames.zipWithIndex if m != n
          (f, slot)   <- frames.zipWithIndex if (bus.nodes(m).sent >> slot & 1) == 1
        } yield f
        assert(bus.received(n).toSet == others.toSet && bus.received(n).size == others.size, bus.what)
      }
    }

  "CAN-20 to CAN-40: disturbed nodes" should "receive nothing that was not sent, and forget no frame" in {
    var errors = 0
    var busOff = 0
    buses("disturbed", 2000, 30) { bus =>
      for ((node, n) <- bus.nodes.zipWithIndex) {
        val all = bus.frames(n).indices.map(1 << _).sum
        assert((node.pending, node.sent ^ node.failed) == (0, all), bus.what)
        if (!bus.isOneShot(n)) assert(node.failed == 0, bus.what)
        val others = bus.frames.zipWithIndex.filter(_._2 != n).flatMap(_._1).toSet
        assert(bus.received(n).toSet.subsetOf(others), bus.what)
        errors += node.counters.take(5).sum
        busOff += node.counter("bus_offs")
      }
    }
    assert(errors > 1000, "the disturbances do nothing")
    info(s"$errors errors, $busOff times bus-off")
  }
}

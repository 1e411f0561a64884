package flyframe.can

import flyframe.can.model.ModelBus
import scala.util.Random

/** A bus of 2 to 4 golden models at random, with clocks up to 4,000 ppm off, each of which has frames to
  * send.
  *
  * @param disturbances
  *   how often each node hears the wrong level for up to two bits
  */
class RandomBus(seed: Long, disturbances: Int) {
  import RandomBus._
  private val random          = new Random(seed)
  private val count           = 2 + random.nextInt(3)
  private val (prescaler, s0) = Settings(random.nextInt(Settings.size))
  private val setting         = s0.copy(threeSamples = random.nextInt(4) == 0)
  private val periods         = Seq.fill(count)(10000 + random.between(-40, 41))
  private val bit             = setting.length * prescaler * 10000L

  private val rate   = Rate(s"prescaler $prescaler, $setting", prescaler, setting)
  private val models = Seq.fill(count)(new CanPortModel)

  val nodes: Seq[LowerTester] = models.map(new LowerTester(_, rate))
  val isOneShot: Seq[Boolean] = Seq.fill(count)(random.nextInt(4) == 0)
  val what: String            = s"seed $seed, $count nodes, ${rate.name}, clocks $periods"
  val frames: Seq[Seq[CanFrame]] =
    Seq.tabulate(count)(n => Seq.tabulate(Frames / count min 16)(i => frame(random, n, 1 + i)))

  // The times within which single nodes hear the wrong level.
  private val span = 130L * Frames * bit
  private val wrong = Seq.fill(count)(
    Seq.fill(disturbances)(random.nextLong(span)).sorted.map(t => t -> (t + random.nextLong(2 * bit))).toArray
  )
  private val at = Array.fill(count)(0)
  private def hears(node: Int, time: Long, level: Boolean) = {
    val all = wrong(node)
    while (at(node) < all.length && all(at(node))._2 < time) at(node) += 1
    level ^ (at(node) < all.length && all(at(node))._1 <= time)
  }
  private val bus = new ModelBus(models, periods, hears)

  for ((node, n) <- nodes.zipWithIndex) {
    node.setTiming(prescaler, setting)
    node.setFilter(0, CanFiltersModel.InUse, 0)
    node.setControl(
      1 | CanCases.RecoversItself | (if (isOneShot(n)) CanCases.OneShot else 0) |
        (if (setting.threeSamples) CanCases.ThreeSamples else 0)
    )
  }
  for ((n, slot) <- random.shuffle(for (n <- frames.indices; slot <- frames(n).indices) yield (n, slot))) {
    nodes(n).requestAt(slot -> frames(n)(slot))
    bus.run(bus.now + random.nextInt(200) * bit)
  }
  // When the disturbances are over all frames get through; a recovery takes 1,408 bits.
  while (nodes.exists(_.pending != 0) && bus.now < span + 20000 * bit) bus.run(bus.now + 100 * bit)
  bus.run(bus.now + 20 * bit)
}

object RandomBus {

  /** Frames of all nodes of a bus together. */
  val Frames = 24

  /** Prescalers and bits of 49, 24, 13 and 10 tq. */
  private val Settings = Seq(
    1 -> BitSetting(38, 10, 4),
    2 -> BitSetting(18, 5, 4),
    4 -> BitSetting(9, 3, 2),
    5 -> BitSetting(6, 3, 2)
  )

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
}

package flyframe.system

import scala.util.Random
import flyframe.protocol.DetectorState.Open
import flyframe.protocol.{DetectorMode, Order}

/** A fault of the matrix.
  *
  * @param acts
  *   what happens: by size, whether the line is a ring, begin, end, slave that is hit, random choices
  * @param ring
  *   Some: only rings, or only lines, can have it
  */
final case class Fault(
    name: String,
    acts: Fault.Place => Seq[(Long, Act)],
    ring: Option[Boolean] = None
)

object Fault {

  /** Where and when a fault is. Times in us. */
  final case class Place(size: Int, ring: Boolean, from: Long, to: Long, slave: Int, random: Random) {
    def cables: Int = if (ring) size + 1 else size

    /** One more slave. */
    def other: Int = (slave + 1 + random.nextInt(size - 1)) % size
  }

  private def during(begin: Place => Act, end: Place => Act): Place => Seq[(Long, Act)] =
    p => Seq(p.from -> begin(p), p.to -> end(p))

  private def every(p: Place, period: Long)(acts: Long => Seq[(Long, Act)]): Seq[(Long, Act)] =
    (p.from until (p.to - period) by period).flatMap(acts)

  private def server(state: ServerState) = during(_ => Act.Server(state), _ => Act.Server(ServerState.Works))

  private def cut(p: Place, number: Int) = {
    val cables = p.random.shuffle((0 until p.cables).toList).take(number)
    cables.flatMap(c => Seq(p.from -> Act.Cable(c, isWhole = false), p.to -> Act.Cable(c, isWhole = true)))
  }

  /** Those of issue 12. */
  val all: Seq[Fault] = Seq(
    Fault("server down", server(ServerState.Down)),
    Fault("server refuses", server(ServerState.Refuses)),
    Fault("log locked", server(ServerState.Locked)),
    Fault("disk full", server(ServerState.DiskFull)),
    Fault("cable cut", cut(_, 1)),
    Fault("ring cut twice", cut(_, 2), ring = Some(true)),
    Fault("slave dead", during(p => Act.Power(p.slave, on = false), p => Act.Power(p.slave, on = true))),
    Fault("host dead", during(p => Act.Host(p.slave, SlaveModel.Never), p => Act.Host(p.slave, 0))),
    // It has just started, and needs a minute.
    Fault(
      "host slow",
      p =>
        Seq(
          p.from           -> Act.Boot(p.slave, 60000000L),
          p.from           -> Act.Power(p.slave, on = false),
          (p.from + 50000) -> Act.Power(p.slave, on = true),
          p.to             -> Act.Boot(p.slave, SlaveModel.BootTime)
        )
    ),
    Fault(
      "host restarting",
      p => every(p, 5000000)(t => Seq(t -> Act.Host(p.slave, p.random.nextInt(4500000).toLong)))
    ),
    Fault("chatter at 1 kHz", during(p => Act.Flap(p.slave, Open, 500), p => Act.Flap(p.slave, Open, 0))),
    Fault(
      "equal IDs",
      { p =>
        val q = p.other
        Seq(p.from -> Act.Node(p.slave, 101 + q), p.to -> Act.Node(p.slave, 101 + p.slave))
      }
    ),
    Fault(
      "swapped slaves",
      { p =>
        val q = p.other
        Seq(p.from -> Act.Swap(p.slave, q), p.to -> Act.Swap(p.slave, q))
      }
    ),
    // A loose contact: each state lasts just long enough to be an event.
    Fault(
      "queue full",
      { p =>
        val q = p.other
        Seq(
          p.from -> Act.Flap(p.slave, Open, 12000),
          p.from -> Act.Flap(q, Open, 10500),
          p.to   -> Act.Flap(p.slave, Open, 0),
          p.to   -> Act.Flap(q, Open, 0)
        )
      }
    ),
    Fault(
      "master restarted",
      p => every(p, 6000000)(t => Seq((t + p.random.nextInt(4000000)) -> Act.Restart(300000)))
    ),
    Fault(
      "brown-out of half the line",
      { p =>
        val half  = p.size / 2
        val first = p.random.nextInt(p.size - half)
        every(p, 9000000)(t =>
          (first until first + half).flatMap(s =>
            Seq(
              t                                      -> Act.Power(s, on = false),
              (t + 1000000 + p.random.nextInt(2000)) -> Act.Power(s, on = true)
            )
          )
        )
      }
    ),
    // With 64 slaves on one cable: on each of them no frame at all would get through.
    Fault(
      "bit errors 1 in 10,000",
      { p =>
        val cables = if (p.size <= 8) 0 until p.cables else Seq(p.random.nextInt(p.cables))
        cables.flatMap(c => Seq(p.from -> Act.Noise(c, 1e-4), p.to -> Act.Noise(c, 0)))
      }
    ),
    Fault("forged traffic at wire speed", during(_ => Act.Forge(0.5), _ => Act.Forge(0)))
  )

  private val Second = 1000000L

  /** Faults, then fire at each position while they last, then their end. Bounds see [[Monitor]].
    *
    * @param faults
    *   one or two
    * @param wait
    *   us from the first fault to the first fire
    * @param after
    *   us from the last fault's end until all must be normal again: a slow host needs a minute of it
    */
  def plan(
      faults: Seq[Fault],
      size: Int,
      ring: Boolean,
      seed: Long,
      wait: Long = 8 * Second,
      after: Long = 75 * Second
  ): Plan = {
    val random = new Random(seed)
    val acts   = Seq.newBuilder[(Long, Act)]
    var t      = 3 * Second
    val begins = faults.indices.map(i => t + i * random.nextInt(3000000))
    t += wait
    var burning = Set.empty[Int]
    for ((s, i) <- random.shuffle((0 until size).toList).zipWithIndex) {
      if (i > 0 && i % (if (size > 8) 12 else 2) == 0) {
        burning.foreach(b => acts += t -> Act.Smoke(b, on = false))
        burning = Set.empty
        acts += (t + 200000) -> Act.Reset
        t += 4 * Second + random.nextInt(1000000)
      }
      t += random.nextInt(50000)
      acts += t -> Act.Smoke(s, on = true)
      burning += s
      if (random.nextInt(4) == 0) acts += (t + 1200000) -> Act.Page(Order.Silence)
      t += 1300000
      acts += t -> Act.Silence
      if (random.nextInt(3) == 0) {
        // The same smoke again, after silence: a new alarm.
        acts += (t + 300000) -> Act.Smoke(s, on = false)
        t += 700000
        acts += t -> Act.Smoke(s, on = true)
        t += 1300000
        acts += t -> Act.Silence
      }
      if (random.nextInt(2) == 0) {
        acts += t -> Act.Smoke(s, on = false)
        burning -= s
      }
      t += 400000
    }
    // Smoke that is still there after a reset is a new alarm.
    acts += t -> Act.Reset
    t += 6 * Second
    val ends = faults.map(_ => t + random.nextInt(3000000))
    t += 9 * Second
    burning.foreach(s => acts += t -> Act.Smoke(s, on = false))
    acts += (t + 100000) -> Act.Silence
    t += 4 * Second
    for (s <- random.shuffle((0 until size).toList).take(3)) {
      acts += t             -> Act.Smoke(s, on = true)
      acts += (t + 1300000) -> Act.Silence
      acts += (t + 1400000) -> Act.Smoke(s, on = false)
      t += 5 * Second
    }
    val normal = ends.max + after
    acts += (normal - 12 * Second) -> Act.Reset
    // Two faults often hit the same slave.
    val slave = random.nextInt(size)
    for ((f, i) <- faults.zipWithIndex) {
      val hit = if (random.nextInt(2) == 0) slave else random.nextInt(size)
      acts ++= f.acts(Place(size, ring, begins(i), ends(i), hit, random))
    }
    val name =
      s"${faults.map(_.name).mkString(" and ")}, $size slaves, ${if (ring) "ring" else "line"}, seed $seed"
    Plan(name, size, ring, seed, acts.result().sortBy(_._1), begins.min, normal)
  }

  private def directed(name: String, size: Int, acts: (Double, Act)*) = {
    val times = acts.map { case (t, act) => (t * Second).toLong -> act }
    Plan(name, size, ring = false, seed = 1, times, times.last._1, times.last._1 + 10 * Second)
  }

  private def smoke(time: Double, slaves: Range, on: Boolean) = slaves.map(time -> Act.Smoke(_, on))

  /** The last slave comes back, with its sounder on, while silence is carried to all others. */
  def backMeanwhile(size: Int): Plan = directed(
    "back while silence is carried",
    size,
    smoke(5, 0 until size, on = true) ++ Seq(
      6.0  -> Act.Cable(size - 1, isWhole = false),
      7.0  -> Act.Silence,
      7.02 -> Act.Cable(size - 1, isWhole = true),
      12.0 -> Act.Silence
    ) ++ smoke(17, 0 until size, on = false) :+ (18.0 -> Act.Reset): _*
  )

  /** The last slave, at which there is no smoke, goes while silence is carried to all others. */
  def goneMeanwhile(size: Int): Plan = directed(
    "gone while silence is carried",
    size,
    smoke(5, 0 until size - 1, on = true) ++ Seq(
      7.0  -> Act.Silence,
      7.02 -> Act.Cable(size - 1, isWhole = false),
      12.0 -> Act.Silence,
      13.0 -> Act.Cable(size - 1, isWhole = true)
    ) ++ smoke(17, 0 until size - 1, on = false) :+ (18.0 -> Act.Reset): _*
  )

  /** The same in a ring that is cut: a slave of the other end goes. */
  def goneAtOtherEnd(size: Int): Plan = directed(
    "gone at the other end while silence is carried",
    size,
    Seq(3.0 -> Act.Cable(size / 2, isWhole = false)) ++ smoke(5, 0 until size / 2, on = true) ++ Seq(
      7.0  -> Act.Silence,
      7.02 -> Act.Cable(size / 2 + 1, isWhole = false),
      12.0 -> Act.Silence,
      13.0 -> Act.Cable(size / 2, isWhole = true),
      13.0 -> Act.Cable(size / 2 + 1, isWhole = true)
    ) ++ smoke(17, 0 until size / 2, on = false) :+ (18.0 -> Act.Reset): _*
  ).copy(ring = true)

  /** There is smoke again at slaves that have just been silenced. */
  def againAtOnce(size: Int): Plan = {
    val slaves = 1 until size by 16
    directed(
      "smoke again at once",
      size,
      smoke(5, slaves, on = true) ++ smoke(6.95, slaves, on = false) ++ Seq(7.0 -> Act.Silence) ++
        smoke(7.01, slaves, on = true) ++ Seq(12.0 -> Act.Silence) ++ smoke(17, slaves, on = false) :+
        (18.0 -> Act.Reset): _*
    )
  }

  /** The last slave comes back while a reset is carried to all others, so that not all get it. Then there is
    * smoke at one more, and all that have an alarm are cut off.
    */
  def cutAfterReset(size: Int): Plan = directed(
    "cut off after a reset that did not reach all",
    size,
    smoke(5, 2 until size, on = true) ++ Seq(
      6.0  -> Act.Cable(size - 1, isWhole = false),
      7.0  -> Act.Reset,
      7.02 -> Act.Cable(size - 1, isWhole = true),
      7.2  -> Act.Smoke(1, on = true),
      7.5  -> Act.Cable(1, isWhole = false),
      12.0 -> Act.Cable(1, isWhole = true)
    ) ++ smoke(17, 1 until size, on = false) :+ (18.0 -> Act.Reset): _*
  )

  /** The master starts anew in a fire that has been silenced, and whose records the server could not store.
    */
  def toldAgain(size: Int): Plan = directed(
    "told again after silence",
    size,
    3.0  -> Act.Server(ServerState.DiskFull),
    5.0  -> Act.Smoke(1, on = true),
    7.0  -> Act.Silence,
    12.0 -> Act.Restart(300000),
    17.0 -> Act.Server(ServerState.Works),
    18.0 -> Act.Smoke(1, on = false),
    19.0 -> Act.Reset
  )

  /** A slave without a host is in smoke, and its power fails: it tells the same as before, of another fire.
    */
  def smokeTwice(size: Int): Plan = directed(
    "the same record twice",
    size,
    3.0  -> Act.Host(1, SlaveModel.Never),
    4.0  -> Act.Power(1, on = false),
    5.0  -> Act.Smoke(1, on = true),
    6.0  -> Act.Power(1, on = true),
    8.0  -> Act.Power(1, on = false),
    9.0  -> Act.Power(1, on = true),
    12.0 -> Act.Smoke(1, on = false),
    13.0 -> Act.Host(1, 0),
    14.0 -> Act.Reset
  )

  /** Cables, supplies, smoke, silence and reset at random within milliseconds of each other, in bursts with
    * time to judge behind each.
    */
  def hectic(size: Int, ring: Boolean, seed: Long): Plan = {
    val random = new Random(seed)
    val acts   = Seq.newBuilder[(Long, Act)]
    val cables = if (ring) size + 1 else size
    val bursts = 8
    // Nothing that has lost its supply is back within a few cycles.
    val off = Array.fill(size)(0L)
    for (b <- 0 until bursts) {
      val from = (3 + 9 * b) * Second
      // Some last for some milliseconds, some until the next burst.
      def length = if (random.nextInt(8) == 0) 9 * Second else 3000L + random.nextInt(400000)
      val span   = 20000 + random.nextInt(2000000)
      for (_ <- 0 until 6 + random.nextInt(12)) {
        val t = from + random.nextInt(span)
        val c = random.nextInt(cables)
        val s = random.nextInt(size)
        random.nextInt(28) match {
          case 0 | 1 | 2 | 3 =>
            acts += t            -> Act.Cable(c, isWhole = false)
            acts += (t + length) -> Act.Cable(c, isWhole = true)
          case 4 | 5 =>
            if (t >= off(s)) {
              val on = t + 100000 + length
              acts += t  -> Act.Power(s, on = false)
              acts += on -> Act.Power(s, on = true)
              off(s) = on + 100000
            }
          case 6                 => acts += t -> Act.Restart(length min Second)
          case 7 | 8 | 9         => acts += t -> Act.Smoke(s, on = false)
          case 10 | 11 | 12 | 13 => acts += t -> Act.Silence
          case 14 | 15 | 16      => acts += t -> Act.Reset
          case 24                => acts += t -> Act.Mode(s, DetectorMode.Disable, 1 + random.nextInt(3))
          case 25                => acts += t -> Act.Mode(s, DetectorMode.Test, 1 + random.nextInt(3))
          case 26 =>
            acts += t            -> Act.Noise(c, 1e-4)
            acts += (t + length) -> Act.Noise(c, 0)
          case 27 =>
            acts += t            -> Act.Server(ServerState.DiskFull)
            acts += (t + length) -> Act.Server(ServerState.Works)
          case _ => acts += t -> Act.Smoke(s, on = true)
        }
      }
    }
    val calm = (3 + 9 * bursts + 9) * Second
    val mended =
      (0 until cables).flatMap(c => Seq(calm -> Act.Cable(c, isWhole = true), calm -> Act.Noise(c, 0))) ++
        Seq(calm -> Act.Server(ServerState.Works)) ++
        (0 until size).flatMap(s => Seq(calm -> Act.Power(s, on = true), calm -> Act.Smoke(s, on = false)))
    val last = Seq((calm + 5 * Second) -> Act.Silence, (calm + 6 * Second) -> Act.Reset)
    Plan(
      s"hectic, $size slaves, ${if (ring) "ring" else "line"}, seed $seed",
      size,
      ring,
      seed,
      acts.result().filter(_._1 < calm).sortBy(_._1) ++ mended ++ last,
      3 * Second,
      calm + 50 * Second
    )
  }

  /** Random faults and fires, then some minutes for all to be normal again.
    *
    * @param from
    *   us; the first fault is after that
    * @param length
    *   us in which faults begin
    */
  def storm(size: Int, ring: Boolean, seed: Long, from: Long, length: Long): Plan = {
    val random                    = new Random(seed)
    val acts                      = Seq.newBuilder[(Long, Act)]
    val kinds                     = all.filter(_.ring.forall(_ == ring))
    def exponential(mean: Double) = (-math.log(1 - random.nextDouble()) * mean).toLong
    val end                       = from + length
    // Slaves swapped twice are not where they belong when each swap has ended.
    var swapped = 0L
    var t       = from + exponential(60e6)
    while (t < end) {
      val fault = kinds(random.nextInt(kinds.size))
      // A loose contact makes 180 events a second.
      val mean = if (fault.name == "queue full") 10e6 else 50e6
      val to   = (t + 2 * Second + exponential(mean)) min (end + 5 * Second)
      if (fault.name != "swapped slaves" || t > swapped) {
        if (fault.name == "swapped slaves") swapped = to
        acts ++= fault.acts(Place(size, ring, t, to, random.nextInt(size), random))
      }
      t += exponential(60e6)
    }
    t = from + exponential(200e6)
    while (t < end) {
      val s       = random.nextInt(size)
      val length  = Second + exponential(60e6)
      val silence = t + Second + exponential(15e6)
      acts += t            -> Act.Smoke(s, on = true)
      acts += silence      -> (if (random.nextInt(3) == 0) Act.Page(Order.Silence) else Act.Silence)
      acts += (t + length) -> Act.Smoke(s, on = false)
      acts += (t + length + exponential(60e6)) -> (if (random.nextInt(3) == 0) Act.Page(Order.Reset)
                                                   else Act.Reset)
      t += exponential(200e6)
    }
    t = from + exponential(600e6)
    while (t < end) {
      val mode = if (random.nextInt(2) == 0) DetectorMode.Disable else DetectorMode.Test
      acts += t -> Act.Mode(random.nextInt(size), mode, 1 + random.nextInt(60))
      t += exponential(600e6)
    }
    // Fires end late, too.
    val calm = end + 70 * Second
    val kept = acts.result().map { case (at, act) => (at min calm, act) }.sortBy(_._1)
    val last = Seq((calm + 1000) -> Act.Silence, (calm + 4 * Second) -> Act.Reset)
    Plan(s"storm, $size slaves, seed $seed", size, ring, seed, kept ++ last, from, calm + 16 * Second)
  }

  /** All faults alone, and all pairs, on lines and rings of a size. */
  def matrix(size: Int, seed: Long): Seq[Plan] =
    for {
      faults <- all.map(Seq(_)) ++ all.combinations(2)
      ring   <- Seq(false, true)
      if faults.forall(_.ring.forall(_ == ring))
    } yield plan(faults, size, ring, seed, wait = if (faults.size == 1) 102 * Second else 8 * Second)
}

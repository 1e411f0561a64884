package flyframe.model

import scala.util.Random

/** What becomes of the clocks of a line: crystals that are wrong and drift, cables, and a frame per cycle
  * that brings the time of the first slave to all others, each with a [[TimeLoop]] (DC-16 to DC-23). It knows
  * what no slave knows: how far they really are apart.
  *
  * No two frames take the same time from slave to slave: each slave sends with the edges of its own transmit
  * clock. The delays of DC-10 come from one frame, as masters measure them.
  *
  * @param slaves
  *   2 or more
  * @param cycleUs
  *   from one frame to the next, us
  * @param ppm
  *   errors of crystals, up to so much
  * @param driftPpm
  *   which go up and down by so much, each in 2 to 8 s
  * @param seed
  *   of all that is random
  */
class ClockLine(slaves: Int, cycleUs: Int, ppm: Double = 100, driftPpm: Double = 1, seed: Long = 1) {
  import ClockLine._
  private val random                         = new Random(seed)
  private def upTo(most: Double): Double     = random.nextDouble() * most
  private def within(limits: Double): Double = (2 * random.nextDouble() - 1) * limits

  private class Slave {
    private val error             = within(ppm)
    private val (seconds, phase)  = (2 + upTo(6), upTo(2 * math.Pi))
    private def wrong(at: Double) = error + driftPpm * math.sin(2 * math.Pi * at / seconds + phase)
    private val loop              = new TimeLoop
    private var slew              = 0.0
    private var transmits         = upTo(NibbleNs) // an edge of its transmit clock
    loop.reset(SpeedStart)

    /** How far its time is from that of the first slave at the beginning, ns. */
    var offset: Double = within(1000)

    /** Of the cable to the next slave, ns. */
    val cable: Double = 5 + upTo(495)

    /** Lets `ns` pass until the second `at`. */
    def advance(at: Double, ns: Double): Unit = {
      val most  = ns / ClockModel.SlewNs
      val falls = math.max(-most, math.min(most, slew))
      slew -= falls
      val wins = ns * wrong(at) * 1e-6
      transmits -= wins
      offset += wins + ns / CoreCycleNs * loop.winsPerCycle - falls
    }

    /** When a nibble that comes at `time` is at the other end of a cable. */
    def passes(time: Double, cable: Double): Double = {
      val waits = (transmits - time - LatencyNs) % NibbleNs
      time + LatencyNs + (if (waits < 0) waits + NibbleNs else waits) + cable
    }

    def sample(late: Double): Unit =
      for (falls <- loop.sample(math.round(late).toInt, SpeedStart, TimeDepth, SpeedDepth)) slew = falls
  }
  private val all = Seq.fill(slaves)(new Slave)
  all.head.offset = 0

  /** When a frame comes to each slave, and when it comes back to all but the last. */
  private def passage(): (Seq[Double], Seq[Double]) = {
    val there = all.init.scanLeft(upTo(NibbleNs))((time, slave) => slave.passes(time, slave.cable))
    val back = all.zip(all.tail).reverse.scanLeft(there.last) { case (time, (before, slave)) =>
      slave.passes(time, before.cable)
    }
    (there, back.tail.reverse)
  }

  /** A time as a slave sees it: that of a core cycle before. */
  private def stamp(time: Double): Double = time - upTo(CoreCycleNs)

  // Delays as a master gets them: half of what a frame is away longer at the first slave than at this one.
  private val delays = {
    val (there, back) = passage()
    val away          = back.zip(there).map { case (b, t) => stamp(b) - stamp(t) } :+ 0.0
    away.map(ns => (away.head - ns) / 2)
  }

  /** How far the pulses of SYNC signals of all slaves are apart, ns, cycle by cycle, just before the clocks
    * are compared.
    */
  def apart(cycles: Int): Seq[Double] = (1 to cycles).map { cycle =>
    all.foreach(_.advance(cycle * cycleUs * 1e-6, cycleUs * 1000.0))
    val pulses     = all.map(slave => upTo(CoreCycleNs) - slave.offset)
    val (there, _) = passage()
    val reference  = stamp(there.head) + all.head.offset
    for (((slave, time), delay) <- all.zip(there).zip(delays).tail)
      slave.sample(stamp(time) + slave.offset - delay - reference)
    pulses.max - pulses.min
  }
}

object ClockLine {
  private val CoreCycleNs = 10.0
  private val NibbleNs    = 40.0
  private val LatencyNs   = 60.0 // of a slave, at least

  // Registers as after a reset.
  private val SpeedStart = 0x1000
  private val TimeDepth  = 4
  private val SpeedDepth = 12

  /** The first cycle from which on no value is above `within`; None: there is none. */
  def settled(apart: Seq[Double], within: Double): Option[Int] = {
    val first = apart.lastIndexWhere(_ > within) + 1
    Option.when(first < apart.size)(first)
  }
}

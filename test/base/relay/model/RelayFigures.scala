package flyframe.relay.model

import flyframe.Numbers
import flyframe.relay._

/** Latency and throughput of 51 nodes on 10 km, measured in the engine; ms, and frames a second. */
class RelayFigures(linkBit: Int, seed: Long) {
  import RingLoad.Us
  private val confirmUs = if (linkBit == 25) 10000 else 50000
  private val Senders   = Set(3, 20, 37)
  private val PauseUs   = 8000
  private val slower    = linkBit / 25

  private def load() =
    new RingLoad(new RelayEngine(RingLoad.setting(seed, linkBit = linkBit)), seed, confirmUs, upUs = 1000)

  private def isRight(l: RingLoad) = assert(l.wrong.isEmpty, l.wrong.take(5).mkString("\n"))

  /** The longest way of single frames at an idle ring. */
  def idle(frames: Int): Double = {
    val l = load()
    for (_ <- 0 until frames) {
      l.request(l.random.nextInt(51), urgent = true)
      l.ring.runUs(2000 * slower)
    }
    isRight(l)
    assert(l.urgent.size == frames)
    l.urgent.max / 1e9
  }

  /** The ways of all frames of random nodes at so many frames a second, shortest first. */
  def atLoad(perSecond: Int, isBroken: Boolean, us: Int): Seq[Double] = {
    val l = load()
    if (isBroken) breaks(l)
    l.keepsWays = true
    l.load(perSecond, l.ring.now + us * Us)
    l.ring.runUs(us)
    l.finish()
    isRight(l)
    l.ways.map(_ / 1e9).sorted.toSeq
  }

  private def breaks(l: RingLoad): Unit = {
    l.faults.cut(20, 1)
    l.faults.cut(21, 0)
    l.touches()
    l.ring.runUs(30000 * slower)
  }

  /** All nodes but a few send all they can; frames a second, and the longest way of urgent frames of those
    * few.
    */
  def full(frames: Int, isBroken: Boolean): (Double, Double, RingLoad) = {
    val l = load()
    l.saturate(Senders)
    l.ring.runUs(40000 * slower)
    if (isBroken) breaks(l)
    val before = l.confirmed
    l.urgent.clear()
    for (_ <- 0 until frames) { // one after the other
      l.request(Senders.toSeq(l.random.nextInt(Senders.size)), urgent = true)
      l.ring.runUs(PauseUs * slower)
    }
    isRight(l)
    ((l.confirmed - before) / (frames * PauseUs * slower / 1e6), l.urgent.max / 1e9, l)
  }
}

/** Prints them. */
object RelayFigures {
  private val Seed = 1L

  def main(arguments: Array[String]): Unit = for (bit <- Seq(25, 125)) {
    val Seq(frames) = Numbers.of(arguments.toSeq, "FRAMES")
    val f           = new RelayFigures(bit, Seed)
    val t           = System.nanoTime
    println(f"bit of $bit cycles, seed $Seed: idle ${f.idle(20)}%.2f ms")
    for (isBroken <- Seq(false, true)) {
      val (perSecond, urgent, l) = f.full(frames.toInt, isBroken)
      println(
        f"broken $isBroken: $perSecond%.0f frames/s, urgent $urgent%.2f ms, most ${l.most}, repeats " +
          f"${l.total(RelayCounter.Repeated)}, strays ${l.total(RelayCounter.Stray)}, " +
          f"${(System.nanoTime - t) / 1e9}%.0f s"
      )
    }
  }
}

package flyframe.relay.model

import flyframe.Numbers
import flyframe.relay._

/** Breaks and mends of a ring of 51 nodes at half load, at random bit positions (FR-63). */
class RelayBreaks(seed: Long, confirmUs: Int = 10000) {
  import RingLoad.Us
  val load: RingLoad    = new RingLoad(new RelayEngine(RingLoad.setting(seed)), seed, confirmUs)
  private val ring      = load.ring
  private val random    = load.random
  private val count     = ring.setting.count
  val kinds: Array[Int] = Array(0, 0, 0, 0)

  private def pause(us: Int): Unit = ring.runTo(ring.now + us * Us + random.nextInt(1000000))

  /** One break, and its mend. */
  private def one(): Unit = {
    val n        = random.nextInt(count)
    val port     = random.nextInt(2)
    val kind     = random.nextInt(4)
    val (to, in) = ring.setting.target(n, port)
    kinds(kind) += 1
    load.touches()
    kind match {
      case 0 => load.faults.cut(n, port)
      case 1 =>
        load.faults.cut(n, port)
        load.faults.cut(to, in)
      case 2 => load.kill(n)
      case _ => // it flaps within frames
        for (_ <- 0 to random.nextInt(5)) {
          load.faults.cut(n, port)
          pause(1 + random.nextInt(60))
          load.faults.cut(n, port, isCut = false)
          pause(1 + random.nextInt(60))
          load.touches()
        }
    }
    pause(500 + random.nextInt(12000))
    load.touches()
    load.faults.cut(n, port, isCut = false)
    load.faults.cut(to, in, isCut = false)
    if (!load.faults.isAlive(n)) load.revive(n)
    while (!load.faults.isWhole) {
      pause(100)
      load.touches()
    }
    load.join()
    // What a break has delayed is over before the next one.
    pause(confirmUs + 3000 + random.nextInt(2000))
  }

  def run(breaks: Int): Unit = {
    load.load(4200, Long.MaxValue)
    pause(20000)
    for (i <- 1 to breaks) {
      one()
      if (i % 100 == 0) println(s"$i breaks, ${load.confirmed} frames, ${load.wrong.size} wrong")
    }
    load.stop()
    load.finish()
    assert(load.wrong.isEmpty, load.wrong.take(10).mkString("\n", "\n", ""))
    assert(load.longestBreak <= load.longest + confirmUs * Us, "a break has delayed a frame for longer")
  }
}

/** `make relay-campaign`: how many breaks, and the seed. */
object RelayCampaign {
  def main(arguments: Array[String]): Unit = {
    val Seq(breaks, seed) = Numbers.of(arguments.toSeq, "BREAKS", "SEED")
    val start             = System.nanoTime
    val b                 = new RelayBreaks(seed)
    b.run(breaks.toInt)
    val seconds = (System.nanoTime - start) / 1e9
    val load    = b.load
    println(
      f"$breaks breaks, seed $seed: ${load.confirmed} frames confirmed, ${load.received} received; " +
        f"longest way ${load.longest / 1e9}%.2f ms, with a break ${load.longestBreak / 1e9}%.2f ms; " +
        f"${load.total(RelayCounter.Repeated)} repeats; " +
        f"${load.ring.now / 1e12}%.1f s of ring in $seconds%.0f s; " +
        s"kinds ${b.kinds.mkString(" ")}; most in transit ${load.most}"
    )
  }
}

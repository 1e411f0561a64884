package flyframe.relay.model

import java.lang.management.ManagementFactory
import flyframe.Tier
import flyframe.can.CanFrame
import flyframe.relay._
import org.scalatest.flatspec.AnyFlatSpec

/** Rings in relay mode, in the engine. */
class RingSpec extends AnyFlatSpec {
  private val seed   = 15L
  private val breaks = Tier("Breaks of a ring in relay mode, 51 nodes", "breaks", test = 4, soak = 10000)
  private val errors =
    Tier("Bit errors on a ring in relay mode, 51 nodes", "frames", test = 100, soak = 100000)
  private val limits = Tier("A full ring in relay mode, clocks at the limits", "ms", test = 20, soak = 3000)

  private def isRight(l: RingLoad) = assert(l.wrong.isEmpty, l.wrong.take(5).mkString("\n", "\n", ""))

  "FR-48: the transit buffers" should "never overflow, with all links full and clocks at the limits" in
    limits.run("12 nodes, a fast half and a slow one", limits.size, Some(seed)) {
      val s = RelayRingSetting(
        IndexedSeq.fill(12)(1000000L),
        IndexedSeq.tabulate(12)(n => if (n < 6) 19990L else 20010L)
      )
      val l = new RingLoad(new RelayEngine(s), seed)
      l.saturate()
      l.ring.runUs(1000.0 * limits.size)
      isRight(l)
      assert(l.most > 3 && l.most <= TransitModel.Size && l.total(RelayCounter.Stray) == 0)
      info(s"at most ${l.most} frames waited")
    }

  "FR-63: 51 nodes at half load" should "lose and double nothing by breaks and mends, and delay little" in
    breaks.run("51 nodes", breaks.size, Some(seed)) {
      val b = new RelayBreaks(seed)
      b.run(breaks.size.toInt)
      info(
        f"${b.load.confirmed} frames, at most ${b.load.longest / 1e9}%.1f ms, " +
          f"with breaks ${b.load.longestBreak / 1e9}%.1f ms"
      )
    }

  for ((count, every) <- Seq(51 -> 100000, 5 -> 10000))
    s"FR-63: $count nodes with a bit of $every wrong on each link" should "lose and double nothing" in
      errors.run(s"$count nodes", errors.size, Some(seed)) {
        val l      = new RingLoad(new RelayEngine(RingLoad.setting(seed, count)), seed)
        def next() = l.ring.now + (-math.log(1 - l.random.nextDouble()) * every * 500000).toLong
        def errorsOf(n: Int, port: Int): Unit = l.ring.at(next()) {
          l.ring.flip(n, port)
          errorsOf(n, port)
        }
        for (n <- 0 until count; port <- 0 to 1) errorsOf(n, port)
        l.load(4000, Long.MaxValue)
        while (l.confirmed < errors.size) l.ring.runUs(5000)
        l.stop()
        l.finish()
        isRight(l)
        assert(l.total(RelayCounter.BadFrame) + l.total(RelayCounter.BadFrame + 1) > 0)
      }

  "FR-63: one bad link" should "be named by the counters" in {
    val l = new RingLoad(new RelayEngine(RingLoad.setting(seed, 8)), seed)
    l.load(4000, Long.MaxValue)
    for (_ <- 0 until 60) {
      l.ring.runUs(300)
      l.ring.flip(3, 1)
    }
    val bad =
      for (n <- 0 until 8; port <- 0 to 1)
        yield l.counter(n, RelayCounter.BadFrame + port) + l.counter(n, RelayCounter.BadHeader + port)
    assert(bad(2 * 4) > 20 && bad.sum == bad(2 * 4), bad)
  }

  "FR-63: a second break and its mend" should "leave two pieces that work, then one ring" in {
    val l           = new RingLoad(new RelayEngine(RingLoad.setting(seed, 8)), seed)
    def got(n: Int) = l.ring.node(n).counters(RelayCounter.Confirmed)
    for (n <- Seq(1, 5)) {
      l.faults.cut(n, 1)
      l.faults.cut(n + 1, 0)
    }
    l.ring.runUs(500)
    var heard = Set.empty[Int]
    for (n <- 0 until 8) l.ring.node(n).delivers = (_, _) => heard += n
    val frame  = CanFrame(1, extended = false, remote = false, 0, Nil)
    val before = got(3)
    l.ring.access(3)(RingHost.request(_, 0, frame))
    l.ring.runUs(2000)
    assert(heard == Set(2, 4, 5) && got(3) == before + 1)
    for (n <- Seq(1, 5)) {
      l.faults.cut(n, 1, isCut = false)
      l.faults.cut(n + 1, 0, isCut = false)
    }
    l.ring.runUs(5000)
    heard = Set.empty
    l.ring.access(3)(RingHost.request(_, 0, frame))
    l.ring.runUs(2000)
    assert(heard == (0 until 8).toSet - 3)
  }

  "FR-62: two nodes with one address" should "find out, and disturb nobody else" in {
    val ring = new RelayEngine(RingLoad.setting(seed, 6))
    for (n <- 0 until 6) RingHost.start(ring, n, if (n == 4) 2 else n + 1, life = n + 1)
    val faults = new RingFaults(ring, upUs = 1000)
    faults.start()
    ring.runUs(60000)
    def conflict(n: Int) = ring.node(n).isConflict
    assert(conflict(1) || conflict(4))
    var got = 0
    ring.node(3).delivers = (_, _) => got += 1
    ring.access(0)(RingHost.request(_, 0, CanFrame(1, extended = false, remote = false, 0, Nil)))
    ring.runUs(5000)
    assert(got == 1 && ring.node(0).slots.sent == 1)
  }

  "Section 14 of the specification: latency and throughput" should "be as it says, at 2 Mbit/s" in {
    val f    = new RelayFigures(25, seed)
    val idle = f.idle(5)
    assert(idle <= 0.9)
    val threads = ManagementFactory.getThreadMXBean

    // Picoseconds of the ring for nanoseconds of a processor, or milliseconds for a second.
    def full(isBroken: Boolean): (Double, Double, Double) = {
      val start               = threads.getCurrentThreadCpuTime
      val (frames, urgent, l) = f.full(2, isBroken)
      (frames, urgent, l.ring.now.toDouble / (threads.getCurrentThreadCpuTime - start))
    }
    val (frames, urgent, first) = full(isBroken = false)
    assert(frames >= 0.85 * LinkTiming.FullLoad && urgent <= 4.0)
    val (whenBroken, late, second) = full(isBroken = true)
    assert(whenBroken >= 0.75 * LinkTiming.FullLoad && late <= 7.8)
    val speed = first max second // the first one is being compiled meanwhile
    info(
      f"idle $idle%.2f ms; full $frames%.0f/s, urgent $urgent%.2f ms; " +
        f"broken $whenBroken%.0f/s, $late%.2f ms; " +
        f"$first%.0f and $second%.0f ms of ring per second of a processor"
    )
    // In `make test` other suites have a share of its caches and cores.
    assert(speed >= (if (Tier.isSoak) 20 else 10))
  }
}

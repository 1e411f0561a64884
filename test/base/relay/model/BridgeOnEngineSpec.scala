package flyframe.relay.model

import flyframe.Tier
import flyframe.can._
import flyframe.can.model.ModelBus
import flyframe.params.CanParams
import flyframe.registers.CanRegisters
import flyframe.relay._
import org.scalatest.flatspec.AnyFlatSpec
import scala.collection.mutable
import scala.util.Random

/** Two twisted pairs of 1 Mbit/s at opposite ends of a ring of 10 nodes and 10 km in relay mode, with a load
  * of 30 %, all of golden models. A few frames of that are shown in RTL, too (BridgeOnRingSpec).
  */
class BridgeOnEngineSpec extends AnyFlatSpec {
  import BridgeOnEngineSpec._
  private val Seed = 1L
  private val tier =
    Tier("A bridge over a fibre ring of golden models", "frames each way", test = 60, soak = 10000)

  "BR-01, BR-02: two pairs" should "exchange frames once and in order, through breaks" in
    tier.run("10 nodes, 10 km", tier.size, Some(Seed)) {
      val bench = new BridgeOnEngine(Seed, tier.size.toInt)
      bench.run()
      val Seq(a, b) = bench.pairs
      for ((from, to) <- Seq(a -> b, b -> a)) {
        val times = to.came.groupMapReduce(_._2)(_ => 1)(_ + _).withDefaultValue(0)
        for (frame <- from.frames) assert(times(frame) == 1, s"times that $frame came")
        assert(to.came.size == from.frames.size, "frames that nobody sent")
        for ((id, ofOne) <- from.frames.groupBy(_.word))
          assert(to.came.map(_._2).filter(_.word == id) == ofOne, f"in order: 0x$id%x")
      }
      assert(bench.dropped == 0)
      val delays = bench.delays.sorted.map(_ / Us)
      val whole  = bench.undisturbed.sorted.map(_ / Us)
      assert(whole.nonEmpty && bench.breaks >= 4)
      info(
        s"added delay: ${whole.head} to ${whole.last} us, on average ${whole.sum / whole.size}; " +
          s"with ${bench.breaks} breaks up to ${delays.last} us"
      )
      // Half of the ring, behind the frames that the nodes have under way; a repeat with a break.
      assert(whole.last < ConfirmUs && delays.last < 2 * ConfirmUs)
    }
}

object BridgeOnEngineSpec {
  val Us              = 1000000L // of ps
  val ConfirmUs       = 2000
  private val Nodes   = 10
  private val KmPs    = 5 * Us   // of light in a fibre
  private val EveryUs = 860      // from each side: 30 % of a pair, which has the frames of both
  private val UpUs    = 1000
  private val p       = CanParams(bridge = true)

  // Controllers on the pairs have a core cycle for each quantum, which is all that a model needs.
  private val onPair = p.copy(coreClockMhz = 10)
  private val rate   = Rate.Fast.copy(prescaler = 1)

  private val Joins     = 1 << 6
  private val everybody = Seq(0, 0, 0, CanFiltersModel.InUse >>> 24) ++ Seq.fill(4)(0)

  /** Port T of a node, and a controller, on a pair of their own.
    *
    * @param frames
    *   of the controller, in the order in which it sends them
    */
  final class Pair(ring: RelayRing, node: Int, val frames: Vector[CanFrame], random: Random) {

    /** What came to the controller, and when; when its own frames had left. */
    val came: mutable.ArrayBuffer[(Long, CanFrame)] = mutable.ArrayBuffer.empty
    val left: mutable.Map[CanFrame, Long]           = mutable.Map.empty

    private val start = ring.now
    private val port  = new CanPortModel(onPair)
    private val controller = new CanPortModel(onPair) {
      override def received(frame: CanFrame, time: Int): Unit = {
        came += ring.now -> frame
        super.received(frame, time)
      }
    }
    private val bus = new ModelBus(
      Seq(port, controller),
      Seq.fill(2)(100000 + random.between(-10, 11)),
      (_, _, level) => level
    )
    private val (ofPort, ofHost) = (new LowerTester(port, rate), new LowerTester(controller, rate))
    private val due = mutable.Queue.from(
      frames.zipWithIndex.map { case (f, n) => start + (n * EveryUs + random.nextInt(400)) * Us -> f }
    )

    ofHost.start()
    ofPort.start(Joins)
    ofPort.setFilter(0, 0, 0)
    ofPort.setFilter(8, CanFiltersModel.InUse, 0)
    port.bridges = frame => {
      left(frame) = ring.now
      ring.access(node)(_.bridged(frame))
    }
    ring.node(node).bridges = port.bridged(_)
    ring.access(node) { h =>
      h.write(CanRegisters.FilterStarts(0), Seq.fill(8)(0))
      h.write(CanRegisters.FilterStarts(0) + 8 * CanRegisters.FilterBytes, everybody)
      h.write(CanRegisters.PortStarts(0) + CanRegisters.Control, Seq(Joins))
    }

    /** Up to the ring's time. */
    def run(): Unit = {
      if (due.headOption.exists(_._1 <= ring.now)) {
        val free = (0 until p.slots).find(slot => (ofHost.pending >> slot & 1) == 0)
        for (slot <- free) ofHost.requestAt(slot -> due.dequeue()._2)
      }
      bus.run(ring.now - start)
    }
    def dropped: Int = port.read(CanRegisters.PortStarts.head + CanRegisters.BridgeDropped, 1).head
  }

  /** Microseconds that bridge and ring add: on average and at most without a break, and at most with one. */
  def delays(seed: Long, frames: Int): (Double, Double, Double) = {
    val bench = new BridgeOnEngine(seed, frames)
    bench.run()
    val whole = bench.undisturbed.map(_ / Us.toDouble)
    (whole.sum / whole.size, whole.max, bench.delays.max / Us.toDouble)
  }

  /** The ring and its pairs. */
  final class BridgeOnEngine(seed: Long, count: Int) {
    private val random  = new Random(seed)
    private val periods = IndexedSeq.fill(Nodes)(20000L + random.between(-2, 3))
    private val ring: RelayRing =
      new RelayEngine(RelayRingSetting(IndexedSeq.fill(Nodes)(KmPs), periods, p = p))
    private val faults = new RingFaults(ring, UpUs, heldUs = 3 * UpUs)
    for (n <- 0 until Nodes) RingHost.start(ring, n, n + 1, ConfirmUs)
    faults.start()
    ring.runUs(UpUs + 3.0 * ConfirmUs + 3000) // all have told their lives
    assert(faults.isWhole)

    /** Few identifiers, so that many frames have the same; the first two bytes tell one from another. */
    private def frames(from: Int) = Vector.tabulate(count) { n =>
      val id   = random.nextInt(4) << 4 | from
      val data = Seq(n & 0xff, n >> 8) ++ Seq.fill(6)(random.nextInt(256))
      if (random.nextBoolean()) CanFrame(id | 126 << 21, extended = true, remote = false, 8, data)
      else CanFrame(id, extended = false, remote = false, 8, data)
    }
    val pairs: Seq[Pair] =
      Seq(0 -> 1, Nodes / 2 -> 2).map { case (n, from) => new Pair(ring, n, frames(from), random) }

    var breaks       = 0
    private val cuts = mutable.ArrayBuffer.empty[(Long, Long)] // from the cut until ports are up again
    private def cut(link: Int, isCut: Boolean): Unit = {
      faults.cut(link, 1, isCut)
      faults.cut((link + 1) % Nodes, 0, isCut)
    }

    def run(): Unit = {
      val end    = ring.now + (count * EveryUs + 50000) * Us
      val part   = (count / 5 * EveryUs min 200000) * Us // a break, and its mend behind half of it
      val first  = ring.now + part / 4
      def broken = cuts.nonEmpty && cuts.last._2 == Long.MaxValue
      var link   = 0
      while (
        ring.now < end && pairs.zip(pairs.reverse).exists { case (a, b) => a.came.size < b.frames.size }
      ) {
        val time    = ring.now - first
        val isBreak = time >= 0 && time % part < part / 2
        if (isBreak && !broken) {
          link = random.nextInt(Nodes)
          breaks += 1
          cuts += ring.now -> Long.MaxValue
          cut(link, isCut = true)
        } else if (!isBreak && broken) {
          cuts(cuts.size - 1) = cuts.last._1 -> (ring.now + UpUs * Us)
          cut(link, isCut = false)
        }
        ring.runTo(ring.now + Us)
        pairs.foreach(_.run())
      }
      ring.runUs(3.0 * ConfirmUs)
      pairs.foreach(_.run()) // what came twice would come now
    }

    /** What frames were on their way that no break touched, in ps. */
    def undisturbed: Seq[Long] = for {
      (from, to)    <- pairs.zip(pairs.reverse)
      (time, frame) <- to.came.toSeq
      left = from.left(frame)
      if !cuts.exists { case (since, until) => left < until && time > since }
    } yield time - left

    /** What all frames were on their way, in ps. */
    def delays: Seq[Long] =
      for ((from, to) <- pairs.zip(pairs.reverse); (time, frame) <- to.came.toSeq)
        yield time - from.left(frame)

    def dropped: Int =
      pairs.map(_.dropped).sum + Seq(0, Nodes / 2).map(ring.node(_).records.bridgeDropped).sum
  }
}

package flyframe.fibre.model

import flyframe.Tier
import flyframe.can._
import flyframe.fibre._
import org.scalatest.exceptions.TestFailedException
import org.scalatest.flatspec.AnyFlatSpec
import scala.collection.mutable
import scala.util.Random

/** Bus mode as long as it may be, with all nodes sending all the time, and clocks that are off. */
class CanClocksSpec extends AnyFlatSpec {
  private val bits = Tier("Bus mode with clocks that are off", "bits", test = 3000, soak = 1000000)

  /** A frame of a node; its bits are often equal for long. */
  private def any(random: Random, node: Int, number: Int): CanFrame = {
    val id   = random.nextInt(1 << 10) << 19 | (number & 0xffff) << 3 | node
    val data = Seq.fill(random.nextInt(9))(Seq(0, 0xff, random.nextInt(256))(random.nextInt(3)))
    CanFrame(id, extended = true, remote = false, data.size, data)
  }

  private def fullLoad(kbps: Int, nodes: Int, ppm: Seq[Int], seed: Long): Unit = {
    val random   = new Random(seed)
    val metres   = Reach.metres(kbps, nodes).toDouble
    val r        = new CanRing(nodes, Some(0), CanRing.spread(nodes, metres), 4000 / kbps, 100, ppm = ppm)
    var (n, all) = (0L, 0)

    /** Takes what has come: each frame of a node comes to every other one, in the order of sending. */
    val ways = Seq.tabulate(nodes, nodes)((_, _) => mutable.Queue.empty[CanFrame])
    def take(): Unit = for (to <- 0 until nodes; f <- r.hosts(to).received())
      assert(ways(f.id & 7)(to).dequeue() == f, s"node $to")

    while (n < bits.size) {
      for (from <- 0 until nodes if r.hosts(from).pending == 0) {
        val f = any(random, from, all)
        for (to <- 0 until nodes if to != from) ways(from)(to).enqueue(f)
        r.hosts(from).request(f)
        all += 1
      }
      r.run(25)
      n += 25
      take()
      assert(r.errors.forall(_ == 0), s"after $n bits: ${r.errors}")
    }
    r.finish(200 * nodes)
    take()
    assert(ways.flatten.forall(_.isEmpty) && all > n / 200)
    assert(r.hosts.forall(h => h.tec == 0 && h.rec == 0 && h.state == CanState.Active))
  }

  for ((kbps, nodes) <- Seq(1000 -> 2, 400 -> 5)) {
    s"FR-38: $nodes nodes at $kbps kbit/s, clocks within 100 ppm" should
      "send all they can without an error" in
      bits.run(s"$kbps kbit/s, 100 ppm", bits.size, Some(kbps)) {
        val random = new Random(kbps)
        fullLoad(kbps, nodes, Seq.fill(nodes)(random.nextInt(201) - 100), kbps)
      }

    s"FR-38: $nodes nodes at $kbps kbit/s, clocks at their limits" should
      "send all they can without an error" in
      bits.run(s"$kbps kbit/s, 4,000 ppm", bits.size, Some(kbps)) {
        fullLoad(kbps, nodes, Seq.tabulate(nodes)(n => if (n % 2 == 0) 4000 else -4000), kbps)
      }
  }

  "FR-38: clocks far beyond their limits" should "be seen" in {
    val failure = intercept[TestFailedException](fullLoad(400, 5, Seq(0, 15000, -15000), 1))
    assert(failure.getMessage.contains(" bits: "), "the errors are counted")
  }
}

package flyframe.ring

import org.scalatest.flatspec.AnyFlatSpec
import scala.util.Random
import flyframe.Tier

/** Two twisted pairs of 1 Mbit/s at opposite ends of a ring of 10 km in relay mode, all in RTL. */
class BridgeOnRingSpec extends AnyFlatSpec {
  private val Seed = 1L
  private val tier = Tier("A bridge over a fibre ring", "frames each way", test = 10, soak = 200)

  private def network(nodes: Int) = {
    def bridge(pair: String) = ujson.Obj("preset" -> RingProcess.pairNode, "pair" -> pair, "bridge" -> true)
    val all = Seq.tabulate(nodes) {
      case 0                   => bridge("a")
      case n if n == nodes / 2 => bridge("b")
      case _                   => ujson.Obj()
    }
    ujson.Obj(
      "mode"        -> "relay",
      "confirm_us"  -> 2000,
      "up_ms"       -> 1,
      "each"        -> ujson.Obj("fibre_km" -> 10.0 / nodes),
      "nodes"       -> all,
      "controllers" -> Seq("a", "b").map(p => ujson.Obj("preset" -> RingProcess.pairNode, "pair" -> p))
    )
  }

  "BR-01, BR-02: two pairs" should "exchange frames once and in order, through a break" in {
    val nodes   = if (Tier.isSoak) 10 else 3
    val frames  = tier.size.toInt
    val random  = new Random(Seed)
    val start   = 5000L
    val everyUs = 860 // from each side: 30 % of the pair
    // Few identifiers, which the transport of the ring does not know: to address 126, or of 11 bits.
    def sent(from: Int) = Seq.tabulate(frames) { n =>
      val id   = random.nextInt(4) << 4 | from
      val name = if (random.nextBoolean()) f"${id | 126 << 21}%08X" else f"$id%03X"
      s"$name#" + (n.toByte +: Seq.fill(7)(random.nextInt().toByte)).map(b => f"$b%02X").mkString
    }
    val (there, back) = (sent(1), sent(2))
    val (onA, onB)    = (nodes + 1, nodes + 2)
    def at(n: Int)    = start + n * everyUs + random.nextInt(400)
    val lines = Seq(onA -> there, onB -> back).flatMap { case (node, all) =>
      all.zipWithIndex.map { case (f, n) => at(n) -> s"frame $node $f" }
    }
    val breaks = Seq(start + frames * everyUs / 4 -> "cut 1", start + frames * everyUs * 3 / 4 -> "mend 1")
    val end    = start + (frames + 10) * everyUs
    val passed = tier.run(s"$nodes nodes", frames, Some(Seed))(
      RingProcess.script(network(nodes), lines ++ breaks, end, Seq(onA, onB))
    )
    def id(frame: String) = frame.takeWhile(_ != '#')
    for ((here, far, all) <- Seq((onA, onB, there), (onB, onA, back))) {
      val came = passed(far).map(_.frame).filter(all.contains)
      assert(came.sorted == all.sorted, s"each once, from $here to $far")
      for ((i, ofOne) <- all.groupBy(id)) assert(came.filter(id(_) == i) == ofOne, s"in order: $i")
    }
    // From the beginning of a frame on one pair to that of its copy on the other.
    val began  = (for (n <- Seq(onA, onB); l <- passed(n)) yield l).groupBy(_.frame).values.map(_.map(_.us))
    val delays = began.filter(_.size == 2).map(t => t.max - t.min).toSeq.sorted
    assert(delays.size == 2 * frames)
    info(s"added delay: ${delays.head} to ${delays.last} us, on average ${delays.sum / delays.size}")
    assert(delays.last < 4000, "no frame waits for longer than a repeat")
  }
}

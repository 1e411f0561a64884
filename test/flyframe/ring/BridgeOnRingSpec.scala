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
      case _                   => ujson.Obj("host" -> "can")
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

  /** Frames of 11 bits, each another one: `from` so that no two nodes send the same. */
  private def frames(from: Int, count: Int) =
    Seq.tabulate(count)(n => f"${n << 3 | from}%03X#" + f"$from%02X$n%02X")

  "BR-01: a pair that is stuck dominant" should "stop nobody elsewhere, and go on when it is free" in {
    val (onA, onB, third) = (4, 5, 3)
    val stuckUs           = 8000L to 14000L
    def every(us: Long, node: Int, all: Seq[String]) =
      all.zipWithIndex.map { case (f, n) => us + n * 700L -> s"frame $node $f" }
    val (meanwhile, toB, toA) = (frames(1, 6), frames(2, 6), frames(3, 6))
    val lines = every(9000, third, meanwhile) ++ every(16000, onA, toB) ++ every(16000, onB, toA) ++
      Seq(stuckUs.head -> "pair a dominant", stuckUs.last -> "pair a free")
    val passed               = RingProcess.script(network(3), lines, 24000, Seq(onA, onB))
    def came(at: Int)        = passed(at).map(_.frame)
    def all(of: Seq[String]) = of.toSet
    // On the other pair in time, on this one when it is free.
    for (l  <- passed(onB) if meanwhile.contains(l.frame)) assert(l.us < stuckUs.last)
    for (at <- Seq(onA, onB)) assert(came(at).filter(meanwhile.contains).sorted == meanwhile.sorted, at)
    assert(came(onB).filter(all(toB)) == toB && came(onA).filter(all(toA)) == toA)
  }

  "BR-02: a node on a pair that babbles" should "keep nobody elsewhere from sending" in {
    val (onA, onB, third) = (4, 5, 3)
    val babble            = frames(0, 200)
    val others            = frames(1, 10)
    val lines = babble.map(f => 6000L -> s"frame $onA $f") ++
      others.zipWithIndex.map { case (f, n) => 7000 + n * 1500L -> s"frame $third $f" }
    val passed = RingProcess.script(network(3), lines, 40000, Seq(onA, onB))
    for (at <- Seq(onA, onB)) {
      val came = passed(at).filter(l => others.contains(l.frame))
      assert(came.map(_.frame) == others, s"at node $at")
    }
    val late = passed(onB).filter(l => others.contains(l.frame)).zipWithIndex.map { case (l, n) =>
      l.us - (7000 + n * 1500L)
    }
    assert(late.max < 4000, late)
    // It babbles faster than a ring carries.
    val arrived = passed(onB).map(_.frame).filter(babble.toSet)
    assert(
      arrived == babble.filter(arrived.toSet) && arrived.size > babble.size / 2 && arrived.size < babble.size
    )
  }
}

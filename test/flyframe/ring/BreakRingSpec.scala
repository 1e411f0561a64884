package flyframe.ring

import org.scalatest.flatspec.AnyFlatSpec
import scala.collection.mutable.{ArrayBuffer, Queue}
import scala.util.Random
import flyframe.Tier
import flyframe.can.CanFrame
import flyframe.relay.model.RingLoad
import flyframe.relay.{RelayEngine, RingFaults, RingHost}

/** A ring of twelve nodes in RTL, pins and tones included, at half load, while one thing after the other
  * breaks: what `make relay-campaign` shows with the golden model holds there, too, and the model says the
  * same of the same script.
  */
class BreakRingSpec extends AnyFlatSpec {
  import BreakRingSpec._
  private val tier =
    Tier("Breaks and mends of a fibre ring of 12 nodes in RTL", "breaks", test = 2, soak = 100)

  /** What breaks, and what mends it; a node that is not there meanwhile. */
  private final case class Break(begin: Seq[(Long, String)], end: Seq[(Long, String)], dead: Option[Int])

  private def breakAt(us: Long, link: Int, random: Random): Break = {
    def cut(way: String) = Break(Seq(us -> s"cut $link$way"), Seq(us + BrokenUs -> s"mend $link$way"), None)
    random.nextInt(5) match {
      case 0 => cut("")
      case 1 => cut(" there")
      case 2 => cut(" back")
      case 3 => Break(Seq(us -> s"off $link"), Seq(us + BrokenUs -> s"on $link"), Some(link))
      case _ => // it flaps
        val flaps = Seq(us -> s"cut $link", us + 40 -> s"mend $link", us + 90 -> s"cut $link")
        Break(flaps, Seq(us + BrokenUs -> s"mend $link"), None)
    }
  }

  private def run(seed: Long): Unit = {
    val random = new Random(seed)
    // No link breaks twice, so that no port stays down for a second (FR-14).
    val links = random.shuffle((1 to Nodes).toList).grouped(3).map(_.head).toSeq.take(BreaksInRun)
    val breaks = links.zipWithIndex.map { case (l, i) =>
      breakAt(StartUs + i * EveryUs + random.nextInt(500), l, random)
    }
    val steady = (1 to Nodes).filterNot(breaks.flatMap(_.dead).toSet)
    val endUs  = StartUs + BreaksInRun * EveryUs
    val frames = (StartUs until endUs by HalfLoadUs).zipWithIndex.map { case (us, n) =>
      val node = steady(random.nextInt(steady.size))
      // No node of the ring has a transport: any identifier will do, if it is another one each time.
      (
        us + random.nextInt(HalfLoadUs.toInt),
        node,
        f"${n << 13 | random.nextInt(1 << 13)}%08X#${random.nextLong()}%016X"
      )
    }
    val lines  = frames.map { case (us, node, frame) => us -> s"frame $node $frame" }
    val faults = breaks.flatMap(b => b.begin ++ b.end)
    val passed = RingProcess.script(network(seed), lines ++ faults, endUs + 3 * ConfirmUs, steady)
    // A host hands one frame over behind the other: each has its turn when the one before is confirmed.
    val turns = frames.groupBy(_._2).flatMap { case (sender, all) =>
      val sorted = all.sortBy(_._1)
      val done   = sorted.map { case (_, _, f) => passed(sender).find(_.frame == f).fold(0L)(_.us) + RoundUs }
      sorted.zip(0L +: done).map { case ((us, _, frame), before) => frame -> (us max before) }
    }
    for (node <- steady) {
      val seen = passed(node).groupBy(_.frame)
      for ((_, sender, frame) <- frames) {
        val times = seen.getOrElse(frame, Nil)
        // At its sender it is there when it is confirmed.
        assert(
          times.size == 1,
          s"seed $seed: frame $frame of node $sender at node $node: ${times.size} times"
        )
        val late = times.head.us - turns(frame)
        assert(late < ConfirmUs + RoundUs, s"seed $seed: frame $frame of node $sender is late")
      }
      assert(passed(node).size == frames.size, s"seed $seed: nothing else at node $node")
    }
    val modelled = inModel(seed, frames, faults, endUs + 3 * ConfirmUs)
    for (node <- steady)
      assert(
        modelled(node).sorted == passed(node).map(_.frame).sorted,
        s"seed $seed: node $node, model and RTL"
      )
  }

  /** The same script in a ring of golden models: what has been confirmed to each node, and what it got. */
  private def inModel(
      seed: Long,
      frames: Seq[(Long, Int, String)],
      script: Seq[(Long, String)],
      endUs: Long
  ): IndexedSeq[Seq[String]] = {
    val ring   = new RelayEngine(RingLoad.setting(seed, Nodes, km = Nodes * FibreKm))
    val faults = new RingFaults(ring, upUs = 1000, heldUs = 1000000)
    val passed = IndexedSeq.fill(Nodes + 1)(ArrayBuffer.empty[String])
    val lives  = Array.fill(Nodes)(1)
    // Of each node what its slots hold, and what waits for one.
    val slots   = Array.fill(Nodes)(Map.empty[Int, String])
    val waiting = Array.fill(Nodes)(Queue.empty[String])
    def request(n: Int): Unit = for (slot <- (0 until 16).find(!slots(n).contains(_)))
      if (waiting(n).nonEmpty) {
        val frame = waiting(n).dequeue()
        slots(n) += slot -> frame
        ring.access(n)(RingHost.request(_, slot, parsed(frame)))
      }
    for (n <- 0 until Nodes) {
      RingHost.start(ring, n, n + 1, ConfirmUs.toInt)
      ring.node(n).delivers = (_, frame) => passed(n + 1) += text(frame)
      ring.node(n).slots.settles = (slot, isSent) => {
        if (isSent) passed(n + 1) += slots(n)(slot)
        slots(n) -= slot
        ring.at(ring.now + Us)(request(n))
      }
    }
    faults.start()
    for ((us, node, frame) <- frames) ring.at(us * Us) {
      waiting(node - 1) += frame
      request(node - 1)
    }
    for ((us, line) <- script) ring.at(us * Us) {
      val words      = line.split(' ').toSeq
      val n          = words(1).toInt - 1
      val (next, in) = ring.setting.target(n, 1)
      val isBreak    = Seq("cut", "off").contains(words.head)
      if (Seq("cut", "mend").contains(words.head)) {
        if (!words.contains("back")) faults.cut(n, 1, isBreak)
        if (!words.contains("there")) faults.cut(next, in, isBreak)
      } else if (isBreak) {
        ring.access(n)(RingHost.stop(_))
        faults.kill(n)
      } else {
        lives(n) += 1
        ring.access(n)(RingHost.restart(_, lives(n)))
        faults.kill(n, isDead = false)
      }
    }
    ring.runTo(endUs * Us)
    passed.map(_.toSeq)
  }

  private def parsed(frame: String) = {
    val Array(id, data) = frame.split('#')
    val bytes           = data.grouped(2).map(Integer.parseInt(_, 16)).toSeq
    CanFrame(Integer.parseInt(id, 16), extended = true, remote = false, bytes.size, bytes)
  }
  private def text(frame: CanFrame) = f"${frame.id}%08X#" + frame.data.map(b => f"$b%02X").mkString

  "FR-58, FR-63: frames at half load" should "be confirmed, and come once and in time, whatever breaks" in
    tier.run("12 nodes, some breaks a run", tier.size, Some(1)) {
      for (seed <- 1L to tier.size / BreaksInRun) run(seed)
    }
}

object BreakRingSpec {
  private val Nodes       = 12
  private val BreaksInRun = if (Tier.isSoak) 4 else 2
  private val ConfirmUs   = 1500L
  private val StartUs     = 7000L
  private val BrokenUs    = 1100L
  private val FibreKm     = 0.2
  private val Us          = RingLoad.Us

  // The next break comes when ports are up again, and what was lost is confirmed: of two ports the one that
  // is up first, by up to a millisecond, sends what the other one does not hear yet.
  private val EveryUs    = 7000L
  private val HalfLoadUs = 240L  // half of what a ring of 51 nodes carries (section 14)
  private val RoundUs    = 1000L // the way round, behind all others

  private def network(seed: Long) = ujson.Obj(
    "mode"       -> "relay",
    "confirm_us" -> ConfirmUs.toInt,
    "up_ms"      -> 1,
    "seed"       -> seed.toInt,
    "nodes"      -> Nodes,
    "each"       -> ujson.Obj("host" -> "can", "fibre_km" -> FibreKm)
  )
}

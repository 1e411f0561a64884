package flyframe.relay.model

import flyframe.Tier
import flyframe.relay._
import org.scalatest.flatspec.AnyFlatSpec

/** Rings at full load, with identifiers of the transport: no node is kept from sending (FR-48, RB-28). */
class FullRingSpec extends AnyFlatSpec {
  private val time =
    Tier("A full ring in relay mode, identifiers of the transport", "ms", test = 200, soak = 2000)

  /** All nodes but those of `quiet` send all that they can, as normal messages. */
  private def full(count: Int, seed: Long, quiet: Set[Int] = Set.empty): RingLoad = {
    val l = new RingLoad(new RelayEngine(RingLoad.setting(seed, count)), seed, upUs = 10000)
    l.identifier = (n, number) => {
      val to = l.random.nextInt(count) + 1
      1 << 28 | to << 21 | 1 << 20 | (n + 1) << 13 | (number & 0xfff) << 1
    }
    l.saturate(quiet, slots = 15)
    l.ring.runUs(20000)
    l
  }

  private def isRight(l: RingLoad) = assert(l.wrong.isEmpty, l.wrong.take(5).mkString("\n", "\n", ""))

  private def sent(l: RingLoad) =
    (0 until l.ring.setting.count).map(l.counter(_, RelayCounter.Confirmed))

  private val rings = Seq((16, 1L, false), (16, 2L, true)) ++
    (if (Tier.isSoak) Seq((16, 3L, false), (51, 4L, false), (51, 5L, true)) else Nil)
  private val breaks = if (Tier.isSoak) 10 else 3

  /** Within which a node sends, and an urgent frame arrives: behind 16 frames of its node, too (RB-16); ms.
    */
  private val Patience = 40

  for ((count, seed, isOpen) <- rings)
    s"RB-28: $count nodes that all send what they can, seed $seed" should
      s"all get on, behind breaks${if (isOpen) ", with one" else ""}" in
      time.run(s"$count nodes, seed $seed", time.size, Some(seed)) {
        val l = full(count, seed)
        for (_ <- 0 until breaks) {
          val n = l.random.nextInt(count)
          l.faults.cut(n, 1)
          l.touches()
          l.ring.runUs(5000)
          l.faults.cut(n, 1, isCut = false)
          l.touches()
          l.ring.runUs(60000) // longer than the ways of all that is on its way: RB-18
        }
        if (isOpen) {
          l.faults.cut(1, 1)
          l.touches()
          l.ring.runUs(60000)
        }
        val last    = Array.fill(count)(0) // ms in which a frame was confirmed
        val longest = Array.fill(count)(0)
        val first   = sent(l)
        var before  = first
        var urgents = 0
        for (ms <- 1 to time.size.toInt) {
          // As long as there is time for it to arrive.
          if (ms % 5 == 0 && ms <= time.size - Patience)
            urgents += l.request(l.random.nextInt(count), urgent = true).size
          l.ring.runUs(1000)
          val now = sent(l)
          for (n <- 0 until count) {
            longest(n) = longest(n) max (ms - last(n))
            if (now(n) > before(n)) last(n) = ms
          }
          before = now
        }
        val each   = before.zip(first).map { case (a, b) => a - b }
        val urgent = l.urgent.map(_ / 1e9)
        info(
          f"least ${each.min}, mean ${each.sum / count}, longest pause ${longest.max} ms, " +
            f"urgent at most ${urgent.max}%.1f ms"
        )
        assert(longest.max < Patience && each.min > time.size / 20, longest.toSeq)
        assert(urgents > 0 && urgent.size == urgents && urgent.max < Patience)
        isRight(l)
      }

  for ((count, seed) <- Seq(16 -> 6L, 51 -> 7L))
    s"RB-28: a quiet node of $count" should "send a normal frame soon, and so should one that joins" in
      time.run(s"quiet of $count, seed $seed", time.size, Some(seed)) {
        val quiet  = count - 1 // and last in CAN order
        val l      = full(count, seed, Set(quiet))
        val normal = l.identifier
        l.identifier = (n, number) =>
          if (n == quiet) 0x1ff << 20 | (n + 1) << 13 | (number & 0xfff) << 1 else normal(n, number)
        def sends(): Int = {
          l.request(quiet)
          val before = l.counter(quiet, RelayCounter.Confirmed)
          (1 to 100)
            .find { _ =>
              l.ring.runUs(1000)
              l.counter(quiet, RelayCounter.Confirmed) > before
            }
            .getOrElse(fail("nothing came home"))
        }
        val ms = Seq.fill((time.size / 20).toInt)(sends())
        l.kill(quiet)
        l.ring.runUs(10000)
        l.revive(quiet)
        l.ring.runUs(60000)
        val joined = sends()
        info(s"at most ${ms.max} ms, $joined ms behind a start")
        assert(ms.max <= 25 && joined <= 25)
        isRight(l)
      }
}

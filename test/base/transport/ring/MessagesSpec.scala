package flyframe.transport.ring

import flyframe.Tier
import flyframe.can.CanState
import flyframe.relay.model.RingLoad
import flyframe.transport.{Faults, TransportParams}
import org.scalatest.flatspec.AnyFlatSpec
import scala.util.Random

/** Messages over rings of golden models, in both modes, C and model as sender and as receiver. */
class MessagesSpec extends AnyFlatSpec {
  private val inBus = Tier("Messages over a ring in bus mode", "messages", test = 6, soak = 900)
  private val part  = inBus.share(1, 3)
  // In bus mode: bytes, and looks of a host between two messages: the ring carries twice as much.
  private val (longest, pause) = if (Tier.isSoak) (2048, 800) else (100, 10)
  private val inRelay = Tier("Messages over a ring in relay mode", "messages", test = 16, soak = 8000)
  private val faulty =
    Tier(
      "Messages over a ring of whose frames many are lost, doubled or late",
      "messages",
      test = 6,
      soak = 1200
    )
  private val faults = Faults(lost = 0.3, doubled = 0.1, late = 0.1)

  /** Within the run, so that none is on record as passed that was not. */
  private def checked(text: String): String = {
    assert(text.contains(" 0 not confirmed, 0 lost by a restart, 0 repeats"), text)
    text
  }

  "TP-30, FR-31: messages in bus mode, one bit in 100,000 wrong on every fibre" should
    "be delivered exactly once" in info(inBus.run("bit errors", part, Some(1)) {
      val r = new BusModeRing(5)
      r.disturb(100000, new Random(1))
      val text = new Messages(r, 1, _ % 2 == 0, 400).run(part.toInt, longest, pause)()
      assert(r.ring.hosts.forall(_.state == CanState.Active))
      if (Tier.isSoak) assert(r.ring.errors.sum > 0)
      s"${checked(text)}; errors ${r.ring.errors.mkString(", ")}"
    })

  "TP-30, FR-33: messages in bus mode" should "be delivered exactly once through a break" in
    info(inBus.run("breaks", part, Some(2)) {
      val r      = new BusModeRing(5)
      val random = new Random(2)
      checked(new Messages(r, 2, _ % 2 == 1, 400).run(part.toInt, longest, pause) { n =>
        if (n % 3 == 1) r.ring.cut(random.nextInt(5))
        else if (n % 3 == 0) for (i <- 0 until 5) r.ring.cut(i, false)
      })
    })

  they should "be delivered once, or be not confirmed, while hosts start anew" in
    info(inBus.run("restarts of hosts", part, Some(7)) {
      new Messages(new BusModeRing(5), 7, _ % 2 == 1, 400).run(part.toInt, longest, pause, restarts = 0.3)()
    })

  they should "be delivered once, or be not confirmed, where half of all frames are lost, double or late" in {
    val part = faulty.share(1, 3)
    info(faulty.run("bus mode", part, Some(8)) {
      val r      = new BusModeRing(5)
      val random = new Random(8)
      new Messages(r, 8, _ % 2 == 1, 400, faults = faults).run(part.toInt, longest, pause, restarts = 0.02) {
        n =>
          if (n % 3 == 1) r.ring.cut(random.nextInt(5))
          else if (n % 3 == 0) for (i <- 0 until 5) r.ring.cut(i, false)
      }
    })
  }

  "Section 14, FR-33: a message in bus mode through a break" should
    "be delivered within two T_answer behind it" in {
      val r       = new BusModeRing(5)
      val m       = new Messages(r, 4, _ => false, 400, pollUs = 50)
      val answer  = TransportParams(1, 0, 400).answerUs(None, tries = 0)
      var longest = 0L
      for (link <- 0 until 5; at <- Seq(500L, 2500L)) {
        var cutAt = Option.empty[Long]
        val (came, _) = m.single(0, 3, 100) { us =>
          if (us >= at && cutAt.isEmpty) {
            r.ring.cut(link)
            cutAt = Some(us)
          }
        }
        longest = longest max came - cutAt.get
        r.ring.cut(link, false)
        r.runUs(5000)
      }
      info(f"at most ${longest / 1e3}%.1f ms behind the break")
      assert(longest > 0 && longest <= 2 * answer)
    }

  // On average 1 KiB each 40 ms, half of what a broken ring carries.
  "TP-30, FR-63: messages in relay mode" should "be delivered exactly once through breaks and bit errors" in
    info(inRelay.run("breaks and bit errors", inRelay.share(3, 8), Some(3)) {
      checked(inRelayMode(3, inRelay.share(3, 8), pause = 400))
    })

  they should "be delivered once, or be not confirmed, where hosts send more than the ring carries" in
    info(inRelay.run("more than the ring carries", inRelay.share(1, 8), Some(5)) {
      val text = inRelayMode(5, inRelay.share(1, 8), pause = 10)
      assert(text.contains(" 0 lost by a restart, 0 repeats"), text)
      text
    })

  they should "be delivered once, or be not confirmed, while hosts start anew" in
    info(inRelay.run("restarts of hosts", inRelay.share(1, 2), Some(6)) {
      inRelayMode(6, inRelay.share(1, 2), pause = 400, restarts = 0.3)
    })

  they should "be delivered once, or be not confirmed, where half of all frames are lost, double or late" in {
    val part = faulty.share(2, 3)
    info(faulty.run("relay mode", part, Some(9))(inRelayMode(9, part, pause = 400, restarts = 0.02, faults)))
  }

  private def inRelayMode(
      seed: Long,
      messages: Long,
      pause: Int,
      restarts: Double = 0,
      faults: Faults = Faults()
  ): String = {
    val r = new RelayModeRing(RingLoad.setting(seed, 16))
    val m = new Messages(r, seed, _ % 2 == 0, 2000, faults = faults)
    m.run(messages.toInt, 2048, pause, restarts) { n =>
      val node = m.random.nextInt(16)
      r.ring.flip(node, m.random.nextInt(2))
      if (n % 4 == 1) r.faults.cut(node, 1)
      else if (n % 4 == 3) for (i <- 0 until 16) r.faults.cut(i, 1, isCut = false)
    }
  }

  "Section 14: a message of 2 KiB at an idle ring of 51 nodes and 10 km" should "take at most 33 ms" in {
    val r             = new RelayModeRing(RingLoad.setting(4))
    val (came, known) = new Messages(r, 4, _ => false, 2000, pollUs = 50).single(0, 25, 2048)()
    info(f"${came / 1e3}%.1f ms, and ${known / 1e3}%.1f ms until its sender knew")
    assert(came <= 33000)
  }
}

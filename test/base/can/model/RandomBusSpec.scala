package flyframe.can.model

import flyframe.Tier
import flyframe.can._
import org.scalatest.flatspec.AnyFlatSpec

/** Random buses of golden models: whatever is disturbed, no frame is received that was not sent, and none is
  * forgotten.
  */
class RandomBusSpec extends AnyFlatSpec {
  private val tier = Tier("CAN models on random buses", "frames", test = 1000, soak = 40000)

  private def buses(part: String, seed: Long, disturbances: Int)(check: RandomBus => Unit): Unit =
    tier.run(part, tier.size / 2, Some(seed)) {
      for (n <- 0L until tier.size / 2 / RandomBus.Frames)
        check(new RandomBus(seed + n, disturbances))
    }

  "CAN-01 to CAN-06: nodes with clocks up to 4,000 ppm off" should
    "exchange frames without an error" in buses("clocks", 1000, 0) { bus =>
      for ((node, n) <- bus.nodes.zipWithIndex) {
        assert(node.counters.take(5) == Seq.fill(5)(0), bus.what)
        val all = bus.frames(n).indices.map(1 << _).sum
        assert(if (bus.isOneShot(n)) (node.sent | node.failed) == all else node.sent == all, bus.what)
        val others = for {
          (frames, m) <- bus.frames.zipWithIndex if m != n
          (f, slot)   <- frames.zipWithIndex if (bus.nodes(m).sent >> slot & 1) == 1
        } yield f
        val received = node.received()
        assert(received.toSet == others.toSet && received.size == others.size, bus.what)
      }
    }

  "CAN-20 to CAN-40: disturbed nodes" should "receive nothing that was not sent, and forget no frame" in {
    var errors = 0
    var busOff = 0
    buses("disturbed", 2000, 30) { bus =>
      for ((node, n) <- bus.nodes.zipWithIndex) {
        val all = bus.frames(n).indices.map(1 << _).sum
        assert((node.pending, node.sent ^ node.failed) == (0, all), bus.what)
        if (!bus.isOneShot(n)) assert(node.failed == 0, bus.what)
        val others = bus.frames.zipWithIndex.filter(_._2 != n).flatMap(_._1).toSet
        assert(node.received().toSet.subsetOf(others), bus.what)
        errors += node.counters.take(5).sum
        busOff += node.counter("bus_offs")
      }
    }
    assert(errors > 1000, "the disturbances do nothing")
    info(s"$errors errors, $busOff times bus-off")
  }
}

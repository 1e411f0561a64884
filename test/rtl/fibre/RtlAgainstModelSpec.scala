package flyframe.fibre

import flyframe.Tier
import flyframe.params.FibreParams
import org.scalatest.flatspec.AnyFlatSpec
import scala.collection.mutable

/** A node in RTL against the golden model, on random light. */
class RtlAgainstModelSpec extends AnyFlatSpec {
  private val tier =
    Tier("Ports and bus mode in RTL against the model", "core cycles", test = 500000, soak = 100000000)

  // Beside the published tones the slowest and nearly the fastest search that there may be.
  private val all = (for (clock <- Seq(100, 50); demodulator <- 0 to 1)
    yield FibreParams(coreClockMhz = clock, demodulator = demodulator, usPerMs = 1)) ++
    Seq((100, 6400, 1600, 400), (50, 20800, 5200, 1300)).map { case (clock, dominant, search, recessive) =>
      FibreParams(clock, dominant, search, recessive, usPerMs = 1)
    }

  private val happened = mutable.Map.empty[String, Int].withDefaultValue(0)

  for (p <- all) {
    val name = s"${p.coreClockMhz} MHz, demodulator ${p.demodulator}, search ${p.toneSearchKhz} kHz"
    s"FR-10 to FR-37, FB-01 to FB-18: a node at $name" should "do what the model does, in each cycle" in {
      val size = tier.size / all.size
      val seed = 10L * p.coreClockMhz + p.demodulator + (if (p.toneSearchKhz == 5000) 0 else 5)
      tier.run(name, size, Some(seed)) {
        FibreSimulation(p, 1) { nodes =>
          for ((what, times) <- RandomNode.run(p, nodes.head, size, seed)) happened(what) += times
        }
      }
    }
  }

  "FR-10 to FR-37: the random light" should "make happen everything that can" in {
    info(happened.toSeq.sorted.map { case (what, times) => s"$what: $times" }.mkString(", "))
    val atPorts =
      for (port <- 1 to 2; what <- Seq("port # up", "search at #", "noise at #", "stuck at #"))
        yield what.replace("#", port.toString)
    val others = Seq("guard", "closing", "latch", "cut off", "alone", "mode 1", "mode 2", "mode 3", "held")
    for (what <- atPorts ++ others) assert(happened(what) >= 1, s"$what: never")
  }
}

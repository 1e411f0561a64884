package flyframe.ring

import java.nio.file.{Files, Paths}
import scala.collection.mutable.ArrayBuffer
import scala.jdk.CollectionConverters._
import scala.util.Random
import org.scalatest.flatspec.AnyFlatSpec
import flyframe.fibre.model.CanRing
import flyframe.fibre.{DemodulatorModel, ModulatorModel, Reach, Tone}
import flyframe.params.FibreParams
import flyframe.report.Plots

/** The plots of docs/ring.md are measured here, on the golden models, whose levels are those of the RTL
  * sample by sample (ModemRules). `make pictures` writes them.
  */
class RingPicturesSpec extends AnyFlatSpec {
  private val writes = sys.env.contains("FLYFRAME_PICTURES")

  private def keep(name: String, text: String): Unit = {
    val file = Paths.get("docs", name)
    if (writes) Files.writeString(file, text)
    assert(Files.readString(file) == text, "make pictures")
    ()
  }

  // ---- the modem ----

  /** What happens to light: edges early or late by up to `jitterNs`, pulses that are longer or shorter so
    * that a dominant tone has this duty cycle, pulses that are missing, a receiver whose clock is slow.
    */
  private case class Light(jitterNs: Double = 0, duty: Double = 50, lost: Double = 0, ppm: Double = 0)

  /** A modem at a bit rate. */
  private case class Modem(title: String, demodulator: Int, kbps: Int) {
    private val p        = FibreParams(demodulator = demodulator)
    private val CycleNs  = 10.0
    private val periodNs = 1000000.0 / p.toneDominantKhz
    private val bit      = p.coreClockMhz * 1000 / kbps // cycles

    /** When levels are taken: as links do above 1 Mbit/s (FR-40), else as CAN does (FR-38). */
    private val samplePoint = if (kbps > 1000) 0.65 else 0.88

    /** Times at which the light of these symbols changes. */
    private def edges(symbols: Seq[Boolean]): Seq[Double] = {
      val modulator = new ModulatorModel(p)
      val times     = ArrayBuffer.empty[Double]
      var before    = false
      for ((symbol, i) <- symbols.zipWithIndex; c <- 0 until bit) {
        modulator.step(Tone.of(symbol))
        if (modulator.light != before) {
          before = modulator.light
          times += (i * bit + c + 1) * CycleNs
        }
      }
      times.toSeq
    }

    /** Part of `count` random symbols that are heard wrongly. */
    def errors(light: Light, count: Int): Double = {
      val random  = new Random(title.hashCode ^ light.hashCode)
      val symbols = Seq.fill(count)(random.nextBoolean())
      val moved = edges(symbols)
        .grouped(2) // a pulse
        .filter(_ => random.nextDouble() >= light.lost)
        .flatMap(_.zipWithIndex.map { case (at, i) =>
          at + (random.nextDouble() * 2 - 1) * light.jitterNs + i * (light.duty - 50) / 100 * periodNs
        })
        .toArray
      // The order stays, whatever the jitter.
      for (i <- 1 until moved.length) moved(i) = moved(i) max moved(i - 1)
      val demodulator = DemodulatorModel(p)
      val step        = CycleNs * (1 + light.ppm / 1000000)
      var now         = random.nextDouble() * step
      var next        = 0
      var wrong       = 0
      for ((symbol, i) <- symbols.zipWithIndex) {
        val sampleAt = (i + samplePoint) * bit * CycleNs
        while (now < sampleAt) {
          while (next < moved.length && moved(next) <= now) next += 1
          demodulator.sample(next % 2 == 1)
          now += step
        }
        if (i > 8 && demodulator.level != symbol) wrong += 1
      }
      wrong.toDouble / (count - 9)
    }
  }

  private val Symbols = 1500
  private val Fast    = Seq(Modem("fast, 2 Mbit/s", 0, 2000), Modem("fast, 400 kbit/s", 0, 400))
  private val Counted = Seq(Modem("counting, 400 kbit/s", 1, 400), Modem("counting, 100 kbit/s", 1, 100))

  "FR-04: the counting demodulator" should "fail at 400 kbit/s over one hop, and the fast one not" in {
    assert(Fast.forall(_.errors(Light(), Symbols) == 0))
    assert(Counted.head.errors(Light(), Symbols) > 0.02)
    assert(Counted.last.errors(Light(), Symbols) == 0)
  }

  "FR-05: the fast demodulator" should "take light as bad as it may be" in
    assert(Fast.forall(m => m.errors(Light(jitterNs = 2, duty = 40), Symbols) == 0))

  "Picture docs/ring-modem.svg" should "show what light a modem takes" in {
    val panels = Seq[(String, Seq[Double], Double => Light)](
      ("jitter, ± ns", Seq(0, 2, 4, 6, 8, 10, 12, 14), v => Light(jitterNs = v)),
      ("duty cycle, %", Seq(5, 10, 20, 30, 40, 50, 60, 70, 80, 90, 95), v => Light(duty = v)),
      ("pulses lost, %", Seq(0, 1, 2, 5, 10, 15, 20, 30), v => Light(lost = v / 100)),
      ("clock error, %", Seq(0, 0.4, 1, 2, 3, 4, 5), v => Light(ppm = v * 10000))
    ).map { case (axis, values, light) =>
      axis -> (Fast ++ Counted).map(m =>
        m.title -> values.map(v => v -> m.errors(light(v), Symbols).max(1.0 / (2 * Symbols)))
      )
    }
    keep("ring-modem.svg", Plots.panels("ring-modem", "wrong symbols", panels))
  }

  // ---- how far bus mode reaches ----

  private case class Reached(kbps: Int, nodes: Int, metres: Int)
  private val table = Paths.get("docs", "ring-reach.csv")

  private def arbitrates(kbps: Int, nodes: Int, metres: Double, frames: Int): Boolean =
    new CanRing(nodes, Some(nodes - 1), CanRing.spread(nodes, metres), 4000 / kbps, coreClockMhz = 100)
      .arbitrate(frames)

  /** The greatest length at which frames get through, within 4 %. */
  private def measure(kbps: Int, nodes: Int): Reached = {
    var (good, bad) = (Reach.metres(kbps, nodes).toDouble, 0.0)
    bad = good + Reach.nodeNs(100) * (nodes - 1) / Reach.NsPerMetre.toDouble
    while (arbitrates(kbps, nodes, bad, 4)) bad *= 1.5
    while (bad - good > 0.04 * good) {
      val middle = (good + bad) / 2
      if (arbitrates(kbps, nodes, middle, 4)) good = middle else bad = middle
    }
    Reached(kbps, nodes, good.toInt)
  }

  "Picture docs/ring-reach.svg" should "show how far bus mode reaches, by rule and by measurement" in {
    if (writes) {
      val rows = for {
        (nodes, least) <- Seq(2 -> 50, 5 -> 50, 10 -> 100)
        kbps           <- Reach.Rates if kbps >= least && Reach.metres(kbps, nodes) > 0
      } yield measure(kbps, nodes)
      Files.write(table, ("kbps,nodes,metres" +: rows.map(r => s"${r.kbps},${r.nodes},${r.metres}")).asJava)
    }
    val rows = Files.readAllLines(table).asScala.toSeq.drop(1).map(_.split(',').map(_.toInt)).map {
      case Array(kbps, nodes, metres) => Reached(kbps, nodes, metres)
    }
    for (r <- rows) assert(r.metres >= Reach.metres(r.kbps, r.nodes), r)
    // One of them again.
    val r = rows.find(r => r.kbps == 400 && r.nodes == 5).get
    assert(arbitrates(r.kbps, r.nodes, r.metres.toDouble, 4))
    assert(!arbitrates(r.kbps, r.nodes, 1.1 * r.metres, 4))
    val rates = Seq(5.0, 7, 10, 14, 20, 30, 50, 70, 100, 125, 170, 250, 330, 400, 500, 700, 1000)
    val curves = Reach.Nodes.map { n =>
      s"$n nodes" -> rates.map(k => k -> Reach.metres(k.toInt, n) / 1000.0).filter(_._2 >= 0.01)
    }
    val points = Reach.Nodes.map(n =>
      s"$n nodes, measured" -> rows.filter(_.nodes == n).map(r => r.kbps.toDouble -> r.metres / 1000.0)
    )
    keep(
      "ring-reach.svg",
      Plots.curves("ring-reach", "bit rate, kbit/s", "length, km", curves, points.filter(_._2.nonEmpty))
    )
  }
}

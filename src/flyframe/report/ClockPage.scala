package flyframe.report

import java.nio.file.{Files, Path, Paths}
import scala.jdk.CollectionConverters._
import flyframe.model.ClockLine

/** `docs/clocks.md`: how far pulses of SYNC0 are apart, in a network that a real master has set up and in the
  * model of a long line. Run from the root of the repository behind `make interop`; exit code 2 with one
  * sentence if there is nothing to show.
  */
object ClockPage {
  private val LimitNs = 40.0

  /** How far pulses are apart, by the time since the first. */
  private type Series = Seq[(Double, Double)]

  private val masters     = Seq("soem" -> "SOEM", "ethercrab" -> "ethercrab")
  private val modelSlaves = 64
  private val modelCycles = Seq(250, 1000, 4000) // us
  private val modelTime   = 10                   // s

  private def measured(name: String): Option[Series] = {
    val file = Paths.get(s"build/interop/$name/clocks-5/apart.txt")
    Option.when(Files.exists(file)) {
      Files.readAllLines(file).asScala.toSeq.map(_.split(' ')).map { case Array(s, ns) =>
        s.toDouble -> ns.toDouble
      }
    }
  }

  private def modelled(cycleUs: Int): Series =
    new ClockLine(modelSlaves, cycleUs).apart(modelTime * 1000000 / cycleUs).zipWithIndex.map {
      case (ns, i) => i * cycleUs * 1e-6 -> ns
    }

  private def row(name: String, series: Series): String = {
    val apart   = series.map(_._2)
    val settled = ClockLine.settled(apart, LimitNs).map(n => f"${series(n)._1 - series.head._1}%.2f s")
    val cells = Seq(
      name,
      f"${series.last._1 - series.head._1}%.1f s",
      f"${apart.max}%.0f ns",
      settled.getOrElse("-"),
      f"${apart.drop(apart.size / 2).max}%.0f ns"
    )
    cells.mkString("| ", " | ", " |")
  }

  /** Rows of a table within a text with margins, which takes a line's first `|` away. */
  private def rows(of: Seq[String]): String = of.mkString("\n|")

  private def page(real: Seq[(String, Series)], model: Seq[(Int, Series)]): String = {
    val head = s"|  | time | at most apart | within ${LimitNs.toInt} ns after | at most in the second half |"
    val line = "|---|---:|---:|---:|---:|"
    s"""# Distributed clocks: how far pulses are apart
       |
       |Written by `make clocks`; do not edit. Each value is the difference between the first and the last of
       |the pulses of SYNC0 that all slaves should have at the same time.
       |
       |## Set up by real masters
       |
       |Five slaves, Verilated RTL, with crystals within 100 ppm that go up and down by 1 ppm in 3 s, and
       |cables of 1 to 100 m; see `test/interop/make_network.py`. The master measures delays, sets the
       |clocks and starts SYNC0 with a cycle of 1 ms. Then its frame is repeated every ms. The first pulse
       |comes 100 ms later. The slaves have `meanWays` (B-100).
       |
       |No neighbours among them have crystals that are apart by a multiple of 40 ppm. Of such a pair the
       |first one lets every frame wait for the same time, up to 40 ns, until the crystals have drifted on:
       |what comes behind them is so much late or early, for seconds, and no slave can see that.
       |
       |$head
       |$line
       |${rows(real.map { case (name, series) => row(name, series) })}
       |
       |![Pulses of five slaves](clocks-rtl.svg)
       |
       |## In a long line
       |
       |$modelSlaves slaves in the model of the clocks (`ClockLine`), with crystals within 100 ppm that go
       |up and down by 1 ppm in 2 to 8 s, one frame per cycle. In each slave a nibble waits up to 40 ns for
       |the transmit clock, so no two frames take the same time, and each more slave makes it worse.
       |
       |$head
       |$line
       |${rows(model.map { case (us, series) => row(s"a frame in $us us", series) })}
       |
       |![Pulses of a long line](clocks-model.svg)
       |""".stripMargin
  }

  private def write(path: Path, text: String): Unit = {
    Files.writeString(path, text)
    println(s"wrote $path")
  }

  def main(args: Array[String]): Unit = {
    System.setProperty("java.awt.headless", "true")
    val real = masters.flatMap { case (name, title) => measured(name).filter(_.nonEmpty).map(title -> _) }
    if (real.isEmpty) {
      Console.err.println(
        "There are no pulses in build/interop: `make interop ARGS=\"--only clocks\"` makes some."
      )
      sys.exit(2)
    }
    val model = modelCycles.map(us => us -> modelled(us))
    val docs  = Paths.get("docs")
    write(docs.resolve("clocks.md"), page(real, model))
    write(
      docs.resolve("clocks-rtl.svg"),
      Plots.apart("clocks-rtl", real, LimitNs)
    )
    write(
      docs.resolve("clocks-model.svg"),
      Plots.apart("clocks-model", model.map { case (us, s) => s"$us us" -> s }, LimitNs)
    )
  }
}

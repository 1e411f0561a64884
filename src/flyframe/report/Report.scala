package flyframe.report

import java.nio.file.{Files, Path, Paths}
import flyframe.{BuildInfo, HostPinSets}

/** Measures area, clock and latency and writes `docs/report.md`, `report.json`, the plots, a history line for
  * each preset, and the [[Blocks]] of figures in other pages. Run from the repository root; exit code 2 with
  * one sentence if it cannot be made.
  */
object Report {
  private val workDir = "build/report"
  private val docs    = Paths.get("docs")

  /** The commit that is measured. */
  private def sources: String = Tools.output(Seq("git", "describe", "--always", "--dirty")).trim

  private def measure(): Results = {
    val alarm                   = AlarmResults.read(Paths.get("build"), docs.resolve("report.json"), sources)
    val m                       = Measure.in(workDir)
    val started                 = System.nanoTime
    def say(what: String): Unit = println(f"[${(System.nanoTime - started) / 1e9}%4.0f s] $what")

    val pins = HostPinSets.measured.map(_._2)

    (Points.all ++ Points.hosts.map(_.params) ++ pins).distinctBy(_.preset).foreach { p =>
      say(s"${p.preset}: elaborating")
      m.emit(p)
    }
    say("building the latency meter and measuring")
    val latency = m.latencies((Points.slaves ++ Points.clocks).distinctBy(_.preset))
    say("building hosts and measuring them at their pins")
    val hostTimes = m.hostTimes(pins)
    val area = Tools.parallel(Points.all) { p =>
      say(s"${p.preset}: mapping to Cyclone IV")
      p.preset -> m.area(p)
    }
    val hosts = Tools.parallel(Points.hosts) { h =>
      say(s"${h.module}: mapping to Cyclone IV")
      h.module -> m.areaOf(h.params, h.module)
    }
    val withCarry = Tools.parallel(Points.presets) { p =>
      say(s"${p.preset}: mapping with carry chains")
      p.preset -> m.areaWithCarry(p)
    }
    val units = Tools.parallel(Points.presets) { p =>
      say(s"${p.preset}: mapping unit by unit")
      p.preset -> m.areaByUnit(p)
    }
    val speed = Tools.parallel(Points.presets :+ Points.ring) { p =>
      say(s"${p.preset}: placing and routing for ECP5")
      p.preset -> m.speed(p)
    }
    say("done")
    Results(
      BuildInfo.version,
      m.tools,
      area.toMap,
      hosts.toMap,
      hostTimes,
      withCarry.toMap,
      units.toMap,
      speed.toMap,
      latency,
      alarm
    )
  }

  private def write(path: Path, text: String): Unit = {
    Files.writeString(path, text)
    println(s"wrote $path")
  }

  private def publish(r: Results, docs: Path): Unit = {
    Files.createDirectories(docs)
    write(docs.resolve("report.md"), Page(r))
    write(docs.resolve("report.json"), Figures.json(r))
    write(docs.resolve("report-latency.svg"), Plots.latency(r))
    write(docs.resolve("report-features.svg"), Plots.features(r))
    write(docs.resolve("report-units.svg"), Plots.units(r))
    Blocks.write(docs).foreach(page => println(s"wrote $page"))
    val lines = Figures.remember(docs.resolve("report-history.csv"), Figures.lines(r))
    println(s"report-history.csv: $lines new line(s)")
    Goals(r).foreach(g =>
      println(s"${if (g.reached) "reached" else "MISSED "}  ${g.title}: ${g.measured}, wanted ${g.goal}")
    )
  }

  def main(args: Array[String]): Unit = {
    System.setProperty("java.awt.headless", "true")
    try {
      if (!Files.exists(Paths.get("src/sim/sim.mk")))
        throw new ReportError("The report must be run from the root of the repository.")
      publish(measure(), docs)
    } catch {
      case e: ReportError =>
        Console.err.println(e.getMessage)
        sys.exit(2)
      case e: java.io.IOException =>
        Console.err.println(s"The report cannot be written or a tool cannot be started (${e.getMessage}).")
        sys.exit(2)
    }
  }
}

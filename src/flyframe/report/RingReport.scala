package flyframe.report

import java.nio.file.{Files, Path, Paths}
import flyframe.BuildInfo

/** Measures area and clock of a fibre ring and writes `docs/ring-report.md`, `ring-report.json`, history
  * lines and the [[Blocks]] of other pages. With the argument `times` it measures nothing: it takes areas and
  * clocks as `ring-report.json` has them, and the times that `make pictures` has measured. Run from the
  * repository root; exit code 2 with one sentence if it cannot be made.
  */
object RingReport {
  private val docs = Paths.get("docs")

  private def measure(): RingResults = {
    val m                       = Measure.in("build/report")
    val started                 = System.nanoTime
    def say(what: String): Unit = println(f"[${(System.nanoTime - started) / 1e9}%4.0f s] $what")
    RingPoints.all.foreach { p =>
      say(s"${p.preset}: elaborating")
      m.emit(p)
    }
    val area = Tools.parallel(RingPoints.all) { p =>
      say(s"${p.preset}: mapping to Cyclone IV")
      p.preset -> m.area(p)
    }
    val withCarry = Tools.parallel(RingPoints.presets) { p =>
      say(s"${p.preset}: mapping with carry chains")
      p.preset -> m.areaWithCarry(p)
    }
    val units = Tools.parallel(RingPoints.presets) { p =>
      say(s"${p.preset}: mapping unit by unit")
      p.preset -> m.areaByUnit(p, RingPoints.rest(p), RingPoints.unitOf)
    }
    val speed = Tools.parallel(RingPoints.presets) { p =>
      say(s"${p.preset}: placing and routing for ECP5")
      p.preset -> m.speed(p)
    }
    say("done")
    RingResults(
      BuildInfo.version,
      m.tools,
      area.toMap,
      withCarry.toMap,
      units.toMap,
      speed.toMap,
      RingFigure.read(docs)
    )
  }

  private def write(path: Path, text: String): Unit = {
    Files.writeString(path, text)
    println(s"wrote $path")
  }

  private def publish(r: RingResults): Unit = {
    write(docs.resolve("ring-report.md"), RingFigures.page(r))
    write(docs.resolve(RingFigures.Json), RingFigures.json(r))
    println(
      s"report-history.csv: ${Figures.remember(docs.resolve("report-history.csv"), r.lines)} new line(s)"
    )
    Blocks.write(docs).foreach(page => println(s"wrote $page"))
  }

  def main(arguments: Array[String]): Unit =
    try
      publish(
        if (arguments.headOption.contains("times"))
          RingFigures.read(Files.readString(docs.resolve(RingFigures.Json)), RingFigure.read(docs))
        else measure()
      )
    catch {
      case e: ReportError =>
        Console.err.println(e.getMessage)
        sys.exit(2)
      case e: java.io.IOException =>
        Console.err.println(s"The report cannot be written or a tool cannot be started (${e.getMessage}).")
        sys.exit(2)
    }
}

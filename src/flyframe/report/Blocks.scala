package flyframe.report

import java.nio.file.{Files, Path, Paths}
import scala.util.matching.Regex

/** Figures in pages that people write: each stands between two marks,
  * {{{
  * <!-- figures: NAME -->
  * ...
  * <!-- end of figures -->
  * }}}
  * and is made from `docs/report.json` and `docs/ring-report.json`, so that no figure is written by hand.
  * `make report` writes them; a test compares.
  */
object Blocks {
  private type Report = ujson.Value

  /** Pages that have such blocks. */
  val pages: Seq[Path] = Seq("README.md", "docs/demo.md", "fpga/README.md").map(Paths.get(_))

  private def grouped(v: ujson.Value): String = f"${v.num.toInt}%,d"
  private def ns(v: ujson.Value): String      = s"${math.round(v.num)} ns"

  /** What the presets cost; one that is newer than the report has no row yet. */
  private def costs(r: Report): String = {
    val rows =
      (Points.presets ++ RingPoints.presets).filter(p => r("presets").obj.contains(p.preset)).map { p =>
        val preset = r("presets")(p.preset)
        val delays = preset.obj.get("latency_ns") match {
          case Some(l) => Seq("processing", "forwarding").map(d => ns(l(d)))
          case None    => Seq("-", "-")
        }
        val size = Seq("logic_elements", "m9k").map(k => grouped(preset(k)))
        (Seq(s"`${p.preset}`") ++ size ++ delays ++
          Seq(s"${p.coreClockMhz} MHz", f"${preset("fmax_mhz").num}%.0f MHz")).mkString("| ", " | ", " |")
      }
    (Seq(
      "| Preset | Logic elements | M9K | Processing | Forwarding | Core clock | Reached (proxy) |",
      "|---|---:|---:|---:|---:|---:|---:|"
    ) ++ rows).mkString("\n")
  }

  /** From smoke to the page. */
  private def alarm(r: Report): String = {
    val (line, page) = (r("alarm")("rtl"), r("alarm")("page"))
    def spread(v: ujson.Value, unit: String) =
      f"median ${v("median").num}%.0f $unit, worst ${v("worst").num}%.0f $unit"
    s"""From the detector's pin to the report on the wire: ${spread(line("to_first_nibble_us"), "µs")}
       |(${grouped(line("events"))} events, ${line("slaves").num.toInt} slaves in RTL, bus cycle ${line(
        "bus_cycle_us"
      ).num.toInt} µs);
       |from its arrival at the server to the screen: ${spread(page("to_screen_ms"), "ms")}.""".stripMargin
  }

  /** Goals that are not reached. */
  private def open(r: Report): String = {
    val missed = r("goals").arr.filterNot(_("reached").bool)
    if (missed.isEmpty) "Every goal of [docs/report.md](docs/report.md) is reached."
    else
      missed
        .map(g => s"- ${g("title").str}: ${g("measured").str} (goal: ${g("goal").str})")
        .mkString("Goals not reached:\n\n", "\n", "")
  }

  /** What the whole controller's delay is at each core clock. */
  private def clocks(r: Report): String = {
    val rows = r("clocks").obj.map { case (mhz, c) => s"| $mhz MHz | ${ns(c("latency_ns")("processing"))} |" }
    (Seq("| Core clock | Processing, worst phase |", "|---:|---:|") ++ rows).mkString("\n")
  }

  private val makers: Map[String, Report => String] =
    Map("costs" -> costs, "alarm" -> alarm, "open" -> open, "clocks" -> clocks)

  private val Block = "(?s)<!-- figures: ([\\w-]+) -->\n.*?<!-- end of figures -->".r

  /** `text` with its blocks made anew from `report`; fails if it has a block of unknown name. */
  def renew(text: String, report: ujson.Value): String = Block.replaceAllIn(
    text,
    found => {
      val name = found.group(1)
      val make = makers.getOrElse(name, throw new ReportError(s"There is no block of figures named $name."))
      Regex.quoteReplacement(s"<!-- figures: $name -->\n${make(report)}\n<!-- end of figures -->")
    }
  )

  /** What the report says, as `make report` has left it in `docs`, and that of the ring. */
  def report(docs: Path): ujson.Value = {
    val all  = ujson.read(Files.readString(docs.resolve("report.json")))
    val ring = ujson.read(Files.readString(docs.resolve(RingFigures.Json)))
    ring("presets").obj.foreach { case (preset, figures) => all("presets")(preset) = figures }
    all("goals").arr ++= ring("goals").arr
    all
  }

  /** Writes the blocks of all pages anew; the pages it has written. */
  def write(docs: Path): Seq[Path] = {
    val figures = report(docs)
    pages.foreach(page => Files.writeString(page, renew(Files.readString(page), figures)))
    pages
  }

  /** The same alone, without measuring: after a block has been added. */
  def main(args: Array[String]): Unit = write(Paths.get("docs")).foreach(page => println(s"wrote $page"))
}

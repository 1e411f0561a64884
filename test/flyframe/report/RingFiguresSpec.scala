package flyframe.report

import java.nio.file.{Files, Paths}
import org.scalatest.flatspec.AnyFlatSpec

class RingFiguresSpec extends AnyFlatSpec {
  private val docs                                                 = Paths.get("docs")
  private def all[A](of: Seq[flyframe.params.EscParams], value: A) = of.map(_.preset -> value).toMap
  private val figures = Seq(
    RingFigure("way", "ms", 0.71, Some(0.9), isLeast = false),
    RingFigure("frames", "frames/s", 900, Some(1000), isLeast = true),
    RingFigure("delay", "us", 352, None, isLeast = false)
  )

  /** As if everything were of one size: as large as `ring-node-tp` may be. */
  private val results = RingResults(
    "1.2.3",
    Seq("yosys" -> "1"),
    all(RingPoints.all, Area(luts = 3000, ffs = 2000, paired = 1200, m9k = 13)),
    all(RingPoints.presets, Area(luts = 3100)),
    all(RingPoints.presets, RingPoints.units.map { case (unit, _) => unit -> Area(luts = 1) }.toMap),
    all(RingPoints.presets, Speed(60, "a", "b", 1, 2)),
    figures
  )

  "Goals of the ring" should "be reached or missed by size, memory, clock and times" in {
    val reached = results.goals.map(g => g.title -> g.reached).toMap
    for (preset <- Seq("ring-bus", "ring-node")) assert(!reached(s"Size of $preset"))
    for (preset <- Seq("ring-node-tp", "ring-server", "ring-gateway")) assert(reached(s"Size of $preset"))
    assert(!reached("Memory of ring-node") && reached("Memory of ring-node-tp"))
    assert(reached("Core clock of ring-server, on the ECP5"))
    assert(!reached("Core clock of ring-node, on the ECP5"))
    assert(reached("way") && !reached("frames") && !reached.contains("delay"))
  }

  "Its page" should "have all of it" in {
    val page = RingFigures.page(results)
    assert(page.contains("| Size of ring-node | at most 2,800 logic elements | 3,800 | **missed** |"))
    assert(page.contains("| way | at most 0.90 ms | 0.71 ms | reached |"))
    assert(page.contains("| frames | at least 1,000 frames/s | 900 frames/s | **missed** |"))
    assert(page.replaceAll("\\s+", " ").contains("delay: 352 us."))
    assert(page.linesIterator.count(_.startsWith("| `ring-")) == RingPoints.presets.size)
    for (v <- RingPoints.variants) assert(page.contains(s"| ${v.info.name} ${v.value} (was "))
  }

  "A figure" should "survive its row" in {
    assert(figures.map(f => RingFigure.of(f.row)) == figures)
  }

  "Its data" should "tell all that the page does" in {
    val read = RingFigures.read(RingFigures.json(results), figures)
    assert(RingFigures.page(read) == RingFigures.page(results))
    assert(RingFigures.json(read) == RingFigures.json(results))
    assert(read.lines == results.lines)
  }

  "docs/ring-report.json" should "have the figures that make pictures has measured last" in {
    val told = ujson.read(Files.readString(docs.resolve(RingFigures.Json)))("figures").arr.toSeq
    assert(
      told.map(f => (f("title").str, f("measured").num)) ==
        RingFigure.read(docs).map(f => (f.title, f.measured)),
      "make pictures"
    )
  }

  "Its history" should "have a line for each preset" in {
    val lines = Figures.newLines(Nil, "2026-01-01", results.lines)
    assert(lines.size == RingPoints.presets.size)
    assert(lines.forall(_.split(",", -1).length == Figures.head.split(",").length))
  }
}

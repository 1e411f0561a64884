package flyframe.report

import java.nio.file.{Files, Path}
import scala.jdk.CollectionConverters._
import flyframe.params.EscParams

/** A figure of a ring at work (section 14 of its specification), measured by `make pictures`.
  *
  * @param limit
  *   what it should be at most, or `isLeast`: at least; none: nothing is promised
  */
final case class RingFigure(
    title: String,
    unit: String,
    measured: Double,
    limit: Option[Double],
    isLeast: Boolean
) {
  def row: String = {
    val bound = limit.fold("")(_.toString)
    f"$title;$unit;$measured%.2f;$bound;${if (isLeast) "least" else "most"}"
  }
  private def shown(v: Double) = if (v >= 100) f"$v%,.0f $unit" else f"$v%.2f $unit"
  def goal: Option[Goal] = limit.map { l =>
    val reached = if (isLeast) measured >= l else measured <= l
    Goal(title, s"at ${if (isLeast) "least" else "most"} ${shown(l)}", shown(measured), reached)
  }
}

object RingFigure {

  /** The head of the file of figures. */
  val Head = "figure;unit;measured;limit;bound"

  def of(row: String): RingFigure = row.split(";", -1) match {
    case Array(title, unit, measured, limit, bound) =>
      RingFigure(title, unit, measured.toDouble, limit.toDoubleOption, bound == "least")
  }

  /** Those that `make pictures` has left. */
  def read(docs: Path): Seq[RingFigure] =
    Files.readAllLines(docs.resolve("ring-figures.csv")).asScala.toSeq.drop(1).map(of)
}

/** What was measured of a ring: see [[Results]]. */
final case class RingResults(
    version: String,
    tools: Seq[(String, String)],
    area: Map[String, Area],
    withCarry: Map[String, Area],
    units: Map[String, Map[String, Area]],
    speed: Map[String, Speed],
    figures: Seq[RingFigure]
) {
  def goals: Seq[Goal] = RingPoints.goals.flatMap { case (p, elements, blocks) =>
    val a   = area(p.preset)
    val mhz = speed(p.preset).mhz
    Seq(
      Goal(
        s"Size of ${p.preset}",
        f"at most $elements%,d logic elements",
        f"${a.logicElements}%,d",
        a.logicElements <= elements
      ),
      Goal(s"Memory of ${p.preset}", s"at most $blocks M9K", s"${a.m9k}", a.m9k <= blocks),
      Goal(
        s"Core clock of ${p.preset}, on the ECP5",
        s"at least ${p.coreClockMhz} MHz",
        f"$mhz%.1f MHz",
        mhz >= p.coreClockMhz
      )
    )
  } ++ figures.flatMap(_.goal)

  /** Lines of the history, see [[Figures.line]]. */
  def lines: Seq[String] = RingPoints.presets.map { p =>
    Figures.line(version, p.preset, None, area(p.preset), speed(p.preset), withCarry(p.preset))
  }
}

/** `docs/ring-report.md` and the same as data. */
object RingFigures {
  import Tables._

  val Json = "ring-report.json"

  def json(r: RingResults): String = {
    val presets = RingPoints.presets.map { p =>
      val entry = Figures.areaJson(r.area(p.preset))
      entry("logic_elements_with_carry") = r.withCarry(p.preset).logicElements
      val speed = r.speed(p.preset)
      entry("fmax_mhz") = Figures.tenths(speed.mhz)
      entry("slowest_path") = ujson.Obj("from" -> speed.from, "to" -> speed.to)
      p.preset -> entry
    }
    val features = RingPoints.variants.map(v => v.title -> Figures.areaJson(r.area(v.params.preset)))
    val units = RingPoints.presets.map { p =>
      p.preset -> Figures.obj(RingPoints.units.map { case (u, _) =>
        u -> Figures.areaJson(r.units(p.preset).getOrElse(u, Area()))
      })
    }
    val goals = r.goals.map(g =>
      ujson.Obj("title" -> g.title, "goal" -> g.goal, "measured" -> g.measured, "reached" -> g.reached)
    )
    val all = ujson.Obj(
      "version"  -> r.version,
      "tools"    -> Figures.obj(r.tools.map { case (t, v) => t -> ujson.Str(v) }),
      "presets"  -> Figures.obj(presets),
      "features" -> Figures.obj(features),
      "units"    -> Figures.obj(units),
      "figures" -> ujson.Arr.from(
        r.figures.map(f => ujson.Obj("title" -> f.title, "unit" -> f.unit, "measured" -> f.measured))
      ),
      "goals" -> ujson.Arr.from(goals)
    )
    ujson.write(all, indent = 2) + "\n"
  }

  /** What `json` tells, but for what is not told: times of the slowest paths, bits of RAM. */
  def read(json: String, figures: Seq[RingFigure]): RingResults = {
    val all               = ujson.read(json)
    val (presets, titles) = (all("presets"), RingPoints.variants.map(v => v.params.preset -> v.title))
    def entries[A](of: ujson.Value)(value: ujson.Value => A) =
      of.obj.map { case (key, v) => key -> value(v) }.toMap
    RingResults(
      all("version").str,
      all("tools").obj.toSeq.map { case (tool, version) => tool -> version.str },
      entries(presets)(Figures.area) ++ titles.map { case (p, title) =>
        p -> Figures.area(all("features")(title))
      },
      entries(presets)(p => Area(luts = p("logic_elements_with_carry").num.toInt)),
      entries(all("units"))(entries(_)(Figures.area)),
      entries(presets) { p =>
        val path = p("slowest_path")
        Speed(p("fmax_mhz").num, path("from").str, path("to").str, 0, 0)
      },
      figures
    )
  }

  def page(r: RingResults): String = Wrap(text(r))

  private def presets(r: RingResults): String = table(
    Seq(
      "Preset",
      "LUTs",
      "Registers",
      "Logic elements",
      "M9K",
      "Logic elements with carry chains",
      "Core clock",
      "ECP5 MHz"
    ),
    RingPoints.presets.map { p =>
      (s"`${p.preset}`" +: cells(r.area(p.preset))) ++
        Seq(n(r.withCarry(p.preset).logicElements), s"${p.coreClockMhz} MHz", f"${r.speed(p.preset).mhz}%.1f")
    }
  )

  private def devices =
    Device.all.map(d => s"an ${d.name} has ${n(d.logicElements)} and ${d.m9k}").mkString(", ")

  private def fits(r: RingResults, p: EscParams): String =
    s"`${p.preset}` fits " + Device.all
      .find(_.fits(r.area(p.preset)))
      .fold("none of them")(d => s"an ${d.name}")

  private def others(r: RingResults): String = {
    val free = r.figures.filter(_.limit.isEmpty)
    free.map(f => f"${f.title}: ${f.measured}%.0f ${f.unit}").mkString("; ")
  }

  private def slowest(r: RingResults): String = RingPoints.presets
    .map { p =>
      val s = r.speed(p.preset)
      s"`${p.preset}` from `${s.from}` to `${s.to}`"
    }
    .mkString("; ")

  private def text(r: RingResults): String =
    s"""# The fibre ring: measured figures
       |
       |Generated by `make ring-report` from version ${r.version}; do not edit. The same figures as data:
       |[ring-report.json](ring-report.json); earlier ones: [report-history.csv](report-history.csv). How it
       |is measured: [report.md](report.md#how-the-figures-are-made).
       |
       |## Goals
       |
       |${block(goals(r.goals))}
       |The figures of the ring at work are those of 51 nodes on 10 km in relay mode, golden models whose bits
       |are shown to be those of the RTL, by [`make pictures`](ring-figures.csv). Beside them, without a
       |goal: ${others(r)}.
       |
       |## Presets
       |
       |${block(presets(r))}
       |Goals are for the logic elements without carry chains. By logic elements and M9K (${devices}):
       |${RingPoints.presets.map(fits(r, _)).mkString(", ")}.
       |
       |The slowest paths: ${slowest(r)}.
       |
       |## Where the area goes
       |
       |Logic elements, and M9K, when the hierarchy is kept; synthesised as a whole, where synthesis works
       |across units, a preset takes what the table above says.
       |
       |${block(
        units(
          RingPoints.units.map(_._1),
          RingPoints.presets.map(_.preset),
          r.units,
          a => Seq(a.logicElements, a.m9k),
          p => Seq(s"`$p`", "M9K")
        )
      )}
       |## What a feature costs
       |
       |`${RingPoints.base.preset}` with one parameter changed.
       |
       |${block(features(r.area, RingPoints.base, RingPoints.variants))}""".stripMargin
}

package flyframe.report

import java.nio.file.{Files, Path, StandardOpenOption}
import java.time.LocalDate
import scala.jdk.CollectionConverters._
import flyframe.HostPinSets

/** The figures as data: `report.json` and a line per preset in `report-history.csv`. */
object Figures {
  private[report] def tenths(v: Double): Double = math.round(v * 10) / 10.0

  private[report] def areaJson(a: Area) =
    ujson.Obj("luts" -> a.luts, "ffs" -> a.ffs, "logic_elements" -> a.logicElements, "m9k" -> a.m9k)

  /** What [[areaJson]] has told. */
  private[report] def area(json: ujson.Value): Area = {
    val Seq(luts, ffs, elements, m9k) =
      Seq("luts", "ffs", "logic_elements", "m9k").map(json(_).num.toInt): @unchecked
    Area(luts, ffs, luts + ffs - elements, m9k)
  }

  private def latencyJson(l: Latency) =
    ujson.Obj("forwarding" -> l.forwarding.worstNs, "processing" -> l.processing.worstNs)

  /** `report.json`: objects `presets`, `clocks`, `features`, `hosts`, `host_times`, `units`, `alarm` and the
    * list `goals`.
    */
  def json(r: Results): String = {
    val presets = Points.presets.map { p =>
      val entry = ujson.Obj()
      r.latency.get(p.preset).foreach(l => entry("latency_ns") = latencyJson(l))
      areaJson(r.area(p.preset)).value.foreach { case (k, v) => entry(k) = v }
      entry("logic_elements_with_carry") = r.withCarry(p.preset).logicElements
      entry("fmax_mhz") = tenths(r.speed(p.preset).mhz)
      p.preset -> entry
    }
    val clocks = Points.clocks.map(p =>
      p.coreClockMhz.toString -> ujson.Obj("latency_ns" -> latencyJson(r.latency(p.preset)))
    )
    val features =
      Points.allVariants.map(v => v.title -> areaJson(r.area(v.params.preset)))
    val hosts = Points.hosts.map(h => h.title -> areaJson(r.hosts(h.module)))
    val times = HostPinSets.measured.map { case (title, p) =>
      title -> ujson.Arr.from(r.hostTimes(p.preset).map { t =>
        ujson.Obj(
          "frames"      -> t.beside,
          "access"      -> (if (t.isWrite) "write" else "read"),
          "bytes"       -> t.bytes,
          "mean_ns"     -> math.round(t.meanNs).toInt,
          "worst_ns"    -> math.round(t.worstNs).toInt,
          "mbyte_per_s" -> tenths(t.mbytePerS)
        )
      })
    }
    val units = Points.presets.map { p =>
      p.preset -> obj(Points.units.map { case (u, _) =>
        u -> areaJson(r.units(p.preset).getOrElse(u, Area()))
      })
    }
    val goals = Goals(r).map(g =>
      ujson.Obj("title" -> g.title, "goal" -> g.goal, "measured" -> g.measured, "reached" -> g.reached)
    )
    val all = ujson.Obj(
      "version"    -> r.version,
      "tools"      -> obj(r.tools.map { case (t, v) => t -> ujson.Str(v) }),
      "presets"    -> obj(presets),
      "clocks"     -> obj(clocks),
      "features"   -> obj(features),
      "hosts"      -> obj(hosts),
      "host_times" -> obj(times),
      "units"      -> obj(units),
      "alarm"      -> AlarmSection.json(r.alarm),
      "goals"      -> ujson.Arr.from(goals)
    )
    ujson.write(all, indent = 2) + "\n"
  }

  private[report] def obj(entries: Seq[(String, ujson.Value)]): ujson.Obj = {
    val o = ujson.Obj()
    entries.foreach { case (k, v) => o(k) = v }
    o
  }

  private[report] val head = "date,version,preset,forwarding_ns,processing_ns,luts,ffs,logic_elements,m9k," +
    "fmax_mhz,logic_elements_with_carry"

  /** What the history has of a preset, but for the date. */
  private[report] def line(
      version: String,
      preset: String,
      delays: Option[Seq[Double]],
      a: Area,
      speed: Speed,
      withCarry: Area
  ): String = {
    val counts = Seq(a.luts, a.ffs, a.logicElements, a.m9k).map(_.toString)
    val others = Seq(tenths(speed.mhz).toString, withCarry.logicElements.toString)
    (Seq(version, preset) ++ delays.fold(Seq("", ""))(_.map(_.toString)) ++ counts ++ others).mkString(",")
  }

  private[report] def lines(r: Results): Seq[String] = Points.presets.map { p =>
    line(r.version, p.preset, r.delays(p), r.area(p.preset), r.speed(p.preset), r.withCarry(p.preset))
  }

  /** Lines to append to a history whose lines are `old`: one for each preset whose version or figures
    * changed.
    */
  def newLines(old: Seq[String], date: String, lines: Seq[String]): Seq[String] = {
    def preset(line: String) = line.split(",")(1)
    lines.flatMap { line =>
      val last = old
        .map(_.split(",", 2))
        .collect { case Array(_, rest) if rest.split(",").lift(1).contains(preset(line)) => rest }
        .lastOption
      Option.when(!last.contains(line))(s"$date,$line")
    }
  }

  /** Appends to the history file; the result is the number of lines. */
  def remember(path: Path, lines: Seq[String]): Int = {
    val old   = if (Files.exists(path)) Files.readAllLines(path).asScala.toSeq else Nil
    val fresh = newLines(old, LocalDate.now.toString, lines)
    val text  = (if (old.isEmpty) head +: fresh else fresh).map(_ + "\n").mkString
    Files.writeString(path, text, StandardOpenOption.CREATE, StandardOpenOption.APPEND)
    fresh.size
  }
}

package flyframe.report

import java.nio.file.{Files, Path}

/** Median and worst of a time over many events. */
final case class Spread(median: Double, worst: Double)

/** From a detector's pin to the report, us.
  *
  * @param sounder
  *   until the master's sounder is on; not measured in RTL
  * @param first
  *   until the first nibble of the report leaves the master; `last`: until its last one
  * @param goal
  *   for `first` and `sounder`, worst
  * @param sources
  *   the commit they were measured on
  */
final case class ReportTimes(
    slaves: Int,
    busCycle: Double,
    events: Int,
    goal: Double,
    sounder: Option[Spread],
    first: Spread,
    last: Spread,
    sources: String
) {
  def reached: Boolean = (first +: sounder.toSeq).forall(_.worst <= goal)
}

/** From a report's arrival at the server to the page, ms: until the page's document shows the event, and
  * until the browser has drawn it.
  *
  * @param sources
  *   the commit they were measured on
  */
final case class PageTimes(events: Int, document: Spread, screen: Spread, sources: String)

/** How long it takes until smoke is seen: by slaves in RTL and by modelled ones to the report, and from there
  * to the page.
  */
final case class AlarmResults(rtl: ReportTimes, model: ReportTimes, page: PageTimes) {

  /** From detector to screen, ms, with the modelled line; the worst case is that of all parts at once. */
  def whole: Spread =
    Spread(model.last.median / 1000 + page.screen.median, model.last.worst / 1000 + page.screen.worst)
}

object AlarmResults {
  private def spread(v: ujson.Value) = Spread(v("median").num, v("worst").num)

  private def reportTimes(v: ujson.Value) = ReportTimes(
    v("slaves").num.toInt,
    v("bus_cycle_us").num,
    v("events").num.toInt,
    v("goal_us").num,
    v.obj.get("to_sounder_us").map(spread),
    spread(v("to_first_nibble_us")),
    spread(v("to_last_nibble_us")),
    v("sources").str
  )

  private def pageTimes(v: ujson.Value) =
    PageTimes(v("events").num.toInt, spread(v("to_document_ms")), spread(v("to_screen_ms")), v("sources").str)

  /** What `make alarm-latency` and `make page-latency` have left in `build`, with the commit `sources`; what
    * has not been measured here is as in the last report, with its own commit.
    *
    * @param report
    *   `report.json`
    */
  def read(build: Path, report: Path, sources: => String): AlarmResults = {
    def part(name: String, file: String, target: String): ujson.Value = {
      val path = build.resolve(file)
      if (Files.exists(path)) {
        val measured = ujson.read(Files.readString(path))
        measured("sources") = sources
        measured
      } else {
        val last = Option.when(Files.exists(report))(ujson.read(Files.readString(report)))
        last
          .flatMap(_.obj.get("alarm"))
          .map(_(name))
          .getOrElse(throw new ReportError(s"$path is missing: run make $target first."))
      }
    }
    AlarmResults(
      reportTimes(part("rtl", "alarm-latency-rtl.json", "alarm-latency")),
      reportTimes(part("model", "alarm-latency.json", "alarm-latency")),
      pageTimes(part("page", "page-latency.json", "page-latency"))
    )
  }
}

/** What the report says of these times. */
object AlarmSection {
  private def number(v: Double): String = f"$v%,.1f"

  private def rows(t: ReportTimes, how: String): String = {
    val line = f"${t.slaves} slaves $how, bus cycle ${t.busCycle}%.0f µs"
    def row(what: String, s: Spread, goal: String) =
      f"| Detector to $what, $line | ${t.events}%,d | ${number(s.median)} µs " +
        s"| ${number(s.worst)} µs | $goal |\n"
    val goal = f"${t.goal}%,.0f µs"
    t.sounder.fold("")(row("sounder of the master", _, goal)) +
      row("first nibble of the report", t.first, goal) + row("last nibble", t.last, "")
  }

  /** Markdown, without a heading. */
  def text(r: AlarmResults): String = {
    def page(what: String, s: Spread) =
      f"| Report at the server to $what | ${r.page.events}%,d | ${number(s.median)} ms " +
        s"| ${number(s.worst)} ms | |\n"
    "| From, to | Events | Median | Worst | Goal, worst |\n|---|---:|---:|---:|---:|\n" +
      rows(r.rtl, "in RTL") + rows(r.model, "in the model") +
      page("the page's document", r.page.document) + page("the screen", r.page.screen) +
      s"| **Detector to screen**, sum for ${r.model.slaves} slaves | " +
      s"| ${number(r.whole.median)} ms | ${number(r.whole.worst)} ms | |\n" +
      s"\nSources: ${r.rtl.sources} in RTL, ${r.model.sources} in the model, ${r.page.sources} of the page.\n"
  }

  def json(r: AlarmResults): ujson.Obj = {
    def spread(s: Spread) = ujson.Obj("median" -> s.median, "worst" -> s.worst)
    def line(t: ReportTimes) = {
      val times = t.sounder.map("to_sounder_us" -> spread(_)).toSeq ++
        Seq("to_first_nibble_us" -> spread(t.first), "to_last_nibble_us" -> spread(t.last))
      ujson.Obj.from(
        Seq[(String, ujson.Value)](
          "slaves"       -> t.slaves,
          "bus_cycle_us" -> t.busCycle,
          "events"       -> t.events,
          "goal_us"      -> t.goal,
          "sources"      -> t.sources
        ) ++ times
      )
    }
    ujson.Obj(
      "rtl"   -> line(r.rtl),
      "model" -> line(r.model),
      "page" -> ujson.Obj(
        "events"         -> r.page.events,
        "sources"        -> r.page.sources,
        "to_document_ms" -> spread(r.page.document),
        "to_screen_ms"   -> spread(r.page.screen)
      )
    )
  }

  /** Two bus cycles and 10 us until the sounder is on, and until a report leaves. */
  def goals(r: AlarmResults): Seq[Goal] =
    for {
      (t, how)     <- Seq(r.rtl -> "RTL", r.model -> "model")
      (what, time) <- t.sounder.map("the master's sounder" -> _).toSeq :+ ("report" -> t.first)
    } yield Goal(
      s"Detector to $what, ${t.slaves} slaves ($how)",
      f"at most ${t.goal}%.0f µs",
      f"${time.worst}%.1f µs",
      time.worst <= t.goal
    )
}

package flyframe.report

import java.nio.file.{Files, Path}
import org.scalatest.flatspec.AnyFlatSpec
import flyframe.Directory

/** What the report takes from the measurements of the smoke-alarm system. */
class AlarmResultsSpec extends AnyFlatSpec {
  private def line(slaves: Int, worst: Double) =
    s"""{"slaves": $slaves, "bus_cycle_us": 100, "events": 1000, "goal_us": 210,
       | "to_first_nibble_us": {"best": 9, "median": 64.04, "worst": $worst},
       | "to_last_nibble_us": {"best": 16, "median": 1500, "worst": 2500}}""".stripMargin
  private val page =
    """{"events": 900, "to_document_ms": {"median": 17.6, "worst": 44},
      | "to_screen_ms": {"median": 30, "worst": 50}}""".stripMargin

  private def written(d: Path): Path = {
    Files.writeString(d.resolve("alarm-latency-rtl.json"), line(5, 209.9))
    Files.writeString(d.resolve("alarm-latency.json"), line(64, 210.1))
    Files.writeString(d.resolve("page-latency.json"), page)
    d
  }

  private def read(d: Path) = AlarmResults.read(d, d.resolve("report.json"), "abc")

  "The report" should "show the times from detector to report and to the page, and their sum" in Directory {
    d =>
      val text           = AlarmSection.text(read(written(d)))
      val (rows, others) = text.linesIterator.toSeq.partition(_.startsWith("|"))
      assert(rows.map(_.count(_ == '|')).toSet == Set(6), text)
      assert(others == Seq("", "Sources: abc in RTL, abc in the model, abc of the page."))
      assert(
        text.contains(
          "first nibble of the report, 5 slaves in RTL, bus cycle 100 µs " +
            "| 1,000 | 64.0 µs | 209.9 µs | 210 µs |"
        )
      )
      assert(text.contains("Report at the server to the page's document | 900 | 17.6 ms | 44.0 ms | |"))
      assert(text.contains("**Detector to screen**, sum for 64 slaves | | 31.5 ms | 52.5 ms | |"))
  }

  it should "tell whether two bus cycles and 10 us are kept" in Directory { d =>
    val results = read(written(d))
    assert(AlarmSection.goals(results).map(_.reached) == Seq(true, false))
    assert(AlarmSection.json(results)("model")("to_first_nibble_us")("worst").num == 210.1)
  }

  it should "have those of the last report where nothing has been measured since" in Directory { d =>
    val first = read(written(d))
    Files.writeString(d.resolve("report.json"), ujson.write(ujson.Obj("alarm" -> AlarmSection.json(first))))
    for (file <- Seq("alarm-latency-rtl.json", "alarm-latency.json")) Files.delete(d.resolve(file))
    val second = AlarmResults.read(d, d.resolve("report.json"), "def")
    assert(second == first.copy(page = first.page.copy(sources = "def")))
  }

  it should "say in one sentence what has not been measured" in Directory { d =>
    Files.delete(written(d).resolve("page-latency.json"))
    val e = intercept[ReportError](read(d))
    assert(e.getMessage.matches(".*page-latency.json is missing: run make page-latency first\\."))
  }
}

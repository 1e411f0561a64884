package flyframe.report

import java.nio.file.{Files, Path, Paths}
import scala.jdk.CollectionConverters._
import org.scalatest.flatspec.AnyFlatSpec
import flyframe.HostPinSets

/** What the report makes of a run, by figures that are easy to tell apart. */
class FiguresSpec extends AnyFlatSpec {
  private val results = {
    val delay  = Delay(140, 100, 14, 160)
    val spread = Spread(1, 2)
    val times  = ReportTimes(5, 100, 1000, 210, None, spread, spread, "abc")
    def all[A](sets: Seq[flyframe.params.EscParams], value: A) = sets.map(_.preset -> value).toMap
    def accesses(set: Int) =
      for (beside <- Seq(false, true); isWrite <- Seq(false, true); bytes <- Seq(1, 2, 4, 64))
        yield {
          val ns = 1000 * set + 100 * (if (isWrite) 1 else 0) + bytes
          AccessTime(beside, isWrite, bytes, ns + 0.4, ns + 500.4, bytes + 0.26)
        }
    Results(
      version = "1.2.3",
      tools = Seq("yosys" -> "0.23"),
      area = all(Points.all, Area(luts = 4001, ffs = 2002, paired = 1003, m9k = 7)),
      hosts = Points.hosts.map(h => h.module -> Area(luts = h.goal, ffs = 7, paired = 6)).toMap,
      hostTimes = HostPinSets.measured.zipWithIndex.map { case ((_, p), set) =>
        p.preset -> accesses(set)
      }.toMap,
      withCarry = all(Points.presets, Area(luts = 3001, ffs = 2002, paired = 1003, m9k = 7)),
      units = all(Points.presets, Points.units.map { case (unit, _) => unit -> Area(luts = 1) }.toMap),
      speed = all(Points.presets :+ Points.ring, Speed(99.5, "a", "b", 1, 2)),
      latency = all(Points.slaves ++ Points.clocks, Latency(delay, delay)),
      alarm = AlarmResults(times, times, PageTimes(1000, spread, spread, "abc"))
    )
  }

  "The page" should "have a column with carry chains in the table of presets" in {
    val lines = Page(results).linesIterator.toSeq
    val head  = lines.find(_.startsWith("| Preset |")).get.split('|').map(_.trim)
    val row   = lines.find(_.startsWith("| `slave` |")).get.split('|').map(_.trim)
    assert(row(head.indexOf("Logic elements")) == "5,000")
    assert(row(head.indexOf("Logic elements with carry chains")) == "4,000")
    assert(row.last == "99.5" && head.last == "ECP5 MHz")
  }

  it should "have what an access takes at the pins: the mean alone, the longest beside frames" in {
    for (((title, _), set) <- HostPinSets.measured.zipWithIndex) {
      val reads  = Seq(1, 2, 4, 64).map(b => f"${1000 * set + b}%,d / ${1000 * set + b + 500}%,d")
      val writes = Seq(1, 2, 4, 64).map(b => f"${1000 * set + 100 + b}%,d / ${1000 * set + b + 600}%,d")
      val row    = (title +: reads) ++ writes :+ "64.3"
      assert(Page(results).contains(row.mkString("| ", " | ", " |")), title)
      val json = ujson.read(Figures.json(results))("host_times")(title)
      assert(json.arr.size == 16 && json(0)("mean_ns").num == 1000 * set + 1)
    }
  }

  "Goals" should "be for the size without carry chains" in {
    val sizes = Goals(results).filter(_.title.startsWith("Size of "))
    assert(sizes.nonEmpty && sizes.forall(_.measured == "5,000"))
  }

  they should "be for each host interface alone" in {
    for (h <- Points.hosts) {
      val goal = Goals(results).find(_.title == s"${h.title}, alone").get
      assert(goal.measured == s"${h.goal + 1}" && !goal.reached)
      assert(Page(results).contains(f"| ${h.title} | ${h.goal}%,d | 7 | ${h.goal + 1}%,d | ${h.goal}%,d |"))
    }
    assert(Points.hosts.map(_.params.hostInterface).sorted == (1 to 5))
  }

  "report.json" should "have both sizes of a preset" in {
    val preset = ujson.read(Figures.json(results))("presets")("slave")
    assert(preset("logic_elements").num == 5000 && preset("logic_elements_with_carry").num == 4000)
  }

  private def fields(line: String) = line.split(",", -1).toSeq
  private val head                 = fields(Figures.head)

  "The history" should "have both sizes in its lines" in {
    val lines = Figures.newLines(Nil, "2026-01-01", Figures.lines(results))
    assert(lines.size == Points.presets.size)
    for (line <- lines.map(fields)) {
      assert(line.size == head.size)
      assert(line(head.indexOf("logic_elements")) == "5000")
      assert(line(head.indexOf("logic_elements_with_carry")) == "4000")
    }
    assert(Figures.newLines(lines, "2026-01-02", Figures.lines(results)) == Nil)
  }

  it should "have all columns in every line" in {
    val kept: Path = Paths.get("docs/report-history.csv")
    val lines      = Files.readAllLines(kept).asScala.toSeq
    assert(lines.head == Figures.head)
    assert(lines.filter(fields(_).size != head.size) == Nil)
  }
}

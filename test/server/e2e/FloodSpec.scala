package flyframe.e2e

import java.nio.file.Paths
import org.scalatest.flatspec.AnyFlatSpec
import flyframe.Tier
import scala.sys.process.{Process, ProcessLogger}

/** Hostile datagrams at the master's plant port, back to back, through its RTL and its host program. */
class FloodSpec extends AnyFlatSpec {
  private val tier =
    Tier("hostile datagrams at the master", "datagrams of each kind", test = 500, soak = 10000)
  private val PerKind = tier.size.toInt
  private val Seed    = 1L

  s"SRV-02, SRV-03, HOST-07: $PerKind hostile datagrams of each kind" should "not stop the line" in {
    val state = AlarmSystem.emptyFolder(Paths.get("build/e2e/flood"))
    val flags = Seq(
      "--slaves",
      "2",
      "--bus-cycle-us",
      "200",
      "--flood",
      s"$PerKind",
      "--seed",
      s"$Seed",
      "--state",
      s"$state"
    )
    val errors = new StringBuilder
    val result = tier.run("all kinds", PerKind, Some(Seed)) {
      ujson.read(
        Process(AlarmSystem.program.toString +: flags).!!(ProcessLogger(line => errors ++= line ++= "\n"))
      )
    }
    info(result.render(indent = 2))
    def counts(kind: String, name: String) = result("kinds")(kind)(name).num.toInt
    val kinds                              = result("kinds").obj.keys.toSeq
    for (kind <- Seq("malformed", "oversized", "wrong_tag", "other_key", "changed", "replayed", "other_life"))
      assert(kinds.contains(kind))
    for (kind <- kinds) {
      assert(counts(kind, "sent") == PerKind, kind)
      assert(counts(kind, "orders") == 0 && counts(kind, "bad_frames") == 0, kind)
      assert(counts(kind, "refused") > 0, kind)
    }
    assert(result("commands_before").num == 1 && result("commands_after").num == 2)
    assert(!result("server_silent").bool)
    assert(result("alarms").num >= kinds.size)
    // REP-03: alarms every few milliseconds are more news than seven reports tell at once; then a report
    // waits for its millisecond.
    val bound = 2 * result("bus_cycle_us").num + 1000 + 50
    assert(result("to_report_us")("worst").num < bound, "alarms are reported meanwhile")
    assert(result("line_frames_bad").num == 0)
  }
}

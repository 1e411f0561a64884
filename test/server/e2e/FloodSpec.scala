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
    val verdicts                           = Seq("refused", "dropped", "malformed", "forged", "replayed")
    for (kind <- Seq("malformed", "oversized", "forged", "replayed")) {
      assert(counts(kind, "sent") == PerKind)
      assert(verdicts.map(counts(kind, _)).sum == PerKind, s"each $kind one is counted, once")
      assert(counts(kind, "bad_frames") == 0)
    }
    // What gets as far as the host program is what it is said to be.
    for ((kind, own) <- Seq("forged" -> "forged", "replayed" -> "replayed")) {
      assert(counts(kind, own) > PerKind / 2)
      assert(counts(kind, own) + counts(kind, "dropped") == PerKind, kind)
    }
    for (kind <- Seq("malformed", "oversized")) {
      assert(counts(kind, "refused") > PerKind / 20, kind)
      assert(counts(kind, "forged") == 0 && counts(kind, "replayed") == 0, kind)
    }
    assert(
      result("commands_before").num == 1 && result("commands_after").num == 2 && result("accepted").num == 2
    )
    assert(result("alarms").num == 4 * PerKind / 250)
    assert(
      result("to_report_us")("worst").num < 5 * result("bus_cycle_us").num,
      "alarms are reported meanwhile"
    )
    assert(result("line_frames_bad").num == 0)
  }
}

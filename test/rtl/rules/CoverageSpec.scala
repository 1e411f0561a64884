package flyframe.rules

import java.nio.file.{Files, Path, Paths}
import org.scalatest.flatspec.AnyFlatSpec
import scala.jdk.CollectionConverters._

/** Every rule of the specification has a test with its ID in the name, or a reason why not. */
class CoverageSpec extends AnyFlatSpec {
  private val specification = Paths.get("../shared/spec/esc-behaviour.md")
  private val groups =
    Seq("FMMU", "SM", "AL", "SII", "WD", "IRQ", "LED", "GEN", "FP", "LP", "ERR", "PHY", "PDI", "SYS")

  private def optional(what: String) = s"optional, not built: $what"
  private val exceptions: Map[String, String] = Map(
    "SM-11"  -> "[VW] only: here buffers lie `length` apart, whatever the width (SM-10)",
    "SM-23"  -> "time stamps of distributed clocks, which are not built",
    "SM-29"  -> optional("deactivation delay"),
    "SM-30"  -> optional("deactivation delay"),
    "SM-31"  -> optional("deactivation delay"),
    "SM-32"  -> optional("sequential mode"),
    "SM-33"  -> optional("sequential mode"),
    "SM-34"  -> optional("sequential mode"),
    "SM-36"  -> optional("acknowledge by write"),
    "SM-37"  -> optional("acknowledge by write"),
    "SM-38"  -> optional("acknowledge by write"),
    "SII-22" -> "32-bit data only: here a read gives eight bytes (SII-23)",
    "WD-08"  -> "there is one PDI",
    "IRQ-04" -> "SYNC of distributed clocks, which are not built",
    "LED-05" -> "no STATE LED: RUN and ERR have a pin each",
    "LED-07" -> optional("PERR LED"),
    "PDI-01" -> "the one PDI is the plain host port; the type is only kept (SII-07)",
    "PDI-05" -> "there is one PDI",
    "PDI-07" -> "a figure of other controllers, which the host port does not promise",
    "PDI-09" -> optional("acknowledge by write"),
    "PDI-10" -> "no general purpose inputs and outputs",
    "PDI-12" -> optional("private RAM"),
    "SYS-02" -> optional("register write protection"),
    "SYS-03" -> optional("ESC write protection"),
    "SYS-04" -> optional("reset by frames"),
    "SYS-05" -> "advice for the design around the controller"
  )

  private val Id = "[A-Z]+-\\d+".r

  /** A rule stands behind a dash, in bold. */
  private def rules: Seq[String] = "(?m)^- \\*\\*([A-Z]+-\\d+)\\*\\*".r
    .findAllMatchIn(Files.readString(specification))
    .map(_.group(1))
    .filter(id => groups.contains(id.takeWhile(_ != '-')))
    .toSeq

  /** The IDs that names of tests begin with. Tests of the golden model alone prove nothing of the RTL. */
  private def tested: Set[String] = {
    val sources = Files
      .walk(Paths.get("test"))
      .iterator
      .asScala
      .filter((f: Path) => f.toString.endsWith(".scala") && !f.startsWith("test/base/model"))
    val name = "\"([A-Z]+-\\d+(?:(?:,| to) [A-Z]+-\\d+)*): ".r
    sources
      .flatMap(f => name.findAllMatchIn(Files.readString(f)))
      .flatMap(m => Id.findAllIn(m.group(1)))
      .toSet
  }

  "Every rule" should "have a test with its ID in the name, or a reason why not" in {
    assume(Files.exists(specification), s"no $specification")
    assert(rules.size > 150, "the rules are not found")
    assert(rules.filterNot(id => tested(id) || exceptions.contains(id)) == Nil, "have no test")
    assert(exceptions.keys.filter(tested).toSeq.sorted == Nil, "have a test: the reason is out of date")
    assert(exceptions.keys.filterNot(rules.toSet).toSeq.sorted == Nil, "are no rules")
  }
}

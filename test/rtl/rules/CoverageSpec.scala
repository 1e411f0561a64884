package flyframe.rules

import java.nio.file.{Files, Path, Paths}
import org.scalatest.flatspec.AnyFlatSpec
import scala.jdk.CollectionConverters._

/** The rule books in `docs/rules`, against the tests and against whatever cites them. Nothing of the books is
  * listed here: every file of the folder is a book but its `README.md` and `untested.md`, and every group of
  * rules counts.
  */
class CoverageSpec extends AnyFlatSpec {
  private val folder   = Paths.get("docs/rules")
  private val untested = folder.resolve("untested.md")

  /** Conformance cases have the numbers of their standard. */
  private val caseId = "CC-\\d\\.\\d\\.\\d\\d?(?:\\.\\d)?"
  private val id     = s"(?:[A-Z]+-\\d\\d\\d?|$caseId)"

  /** `AP-01, AP-03 to AP-05` names AP-01, AP-03, AP-04 and AP-05. */
  private val ids = s"$id(?:(?:,| to) $id)*"
  private def named(text: String): Seq[String] = text.split(", ").toSeq.flatMap {
    case s"$first to $last" =>
      val (group, from) = split(first)
      val (same, until) = split(last)
      assert(group == same && from < until, s"$first to $last is no range")
      (from to until).map(number => f"$group-$number%02d")
    case one => Seq(one)
  }
  private def split(rule: String): (String, Int) = rule match {
    case s"$group-$number" => group -> number.toInt
  }

  private def files(root: String, kinds: String*): Seq[Path] = {
    val all = Files.walk(Paths.get(root))
    try all.iterator.asScala.filter(f => kinds.exists(kind => f.toString.endsWith(s".$kind"))).toSeq.sorted
    finally all.close()
  }
  private def isIn(file: Path, directory: String) = file.iterator.asScala.exists(_.toString == directory)

  private val books = files(folder.toString, "md").filterNot(Set(untested, folder.resolve("README.md")))

  /** A rule begins with a dash and its ID in bold. */
  private def rulesOf(book: Path): Seq[String] =
    s"(?m)^- \\*\\*($id)\\b".r.findAllMatchIn(Files.readString(book)).map(_.group(1)).toSeq
  private val rules = books.flatMap(rulesOf)

  /** Numbers within a group that no rule has: never given, or withdrawn (3 of MST). */
  private val unused: Map[String, Seq[Int]] =
    Map(
      "B"   -> Seq(7 to 9, 22 to 29, 36 to 39, 49 to 49, 73 to 79, 104 to 109).flatten,
      "CAN" -> Seq(15 to 19, 22 to 29, 36 to 39).flatten,
      "FR"  -> Seq(9 to 9, 16 to 19, 23 to 29, 39 to 39, 50 to 54).flatten,
      "MST" -> Seq(3, 9),
      "TP"  -> Seq(7 to 9, 14 to 19, 26 to 29, 33 to 49).flatten
    )

  /** Rows of the table of rules without test: IDs, and why there is none. */
  private val reasons: Seq[(String, String)] = Files
    .readString(untested)
    .linesIterator
    .collect { case s"| $rules | $reason |" if rules.matches(ids) => rules -> reason }
    .flatMap { case (rules, reason) => named(rules).map(_ -> reason) }
    .toSeq

  /** The IDs that names of tests begin with, those of host programs included. Tests of the golden model alone
    * prove nothing of the RTL.
    */
  private val tested: Set[String] = {
    val name = s"\"($ids): ".r
    (files("test", "scala") ++ files("test/firmware", "cpp"))
      .filterNot(isIn(_, "model"))
      .flatMap(f => name.findAllMatchIn(Files.readString(f)))
      .flatMap(m => named(m.group(1)))
      .toSet
  }

  "Every book" should "have rules, each with an ID of its own" in {
    assert(books.nonEmpty)
    for (book <- books) {
      assert(rulesOf(book).nonEmpty, s"$book has no rule")
      val bullets = Files.readString(book).linesIterator.filter(_.startsWith("- **")).size
      assert(bullets == rulesOf(book).size, s"$book has a rule whose ID is not one")
    }
    assert(rules.diff(rules.distinct) == Nil, "stand more than once")
    // A rule that is taken away, with its test, would leave a gap.
    val (cases, numbered) = rules.partition(_.matches(caseId))
    for ((group, all) <- numbered.map(split).groupMap(_._1)(_._2)) {
      val missing = (1 to all.max).filterNot(all.toSet) diff unused.getOrElse(group, Nil)
      assert(missing == Nil, s"are missing in the group $group")
    }
    assert(cases.size == 140, "conformance cases")
  }

  "Every rule" should "have a test with its ID in the name, or a reason why not" in {
    val excused = reasons.map(_._1)
    assert(rules.filterNot(rule => tested(rule) || excused.contains(rule)) == Nil, "have no test")
    assert(excused.filter(tested) == Nil, "have a test: the reason is out of date")
    assert(excused.filterNot(rules.toSet) == Nil, "have a reason, but are no rules")
    assert(excused.diff(excused.distinct) == Nil, "have several reasons")
    info(
      s"${rules.size} rules in ${books.size} books: ${rules.count(tested)} with tests, " +
        s"${excused.size} with reasons"
    )
  }

  "Every ID that a source, a test or a document cites" should "be that of a rule" in {
    // Names that look like an ID; CONTRIBUTING.md shows with BTN-01 how a rule is added.
    val others = Set("CRC-32", "CRC-15", "SHA-256", "BTN-01")
    val texts  = Seq("scala", "c", "h", "cpp", "v", "py", "js", "html", "tcl", "sdc", "mk", "sh", "md")
    val pages  = Seq("README.md", "CONTRIBUTING.md", "Makefile").map(Paths.get(_))
    val cited = for {
      file <- Seq("src", "test", "fpga", "docs", "demo").flatMap(files(_, texts: _*)) ++ pages
      cite <- s"(?<![\\w-])$id(?![\\w-])".r.findAllIn(Files.readString(file)) if !others(cite)
    } yield (cite, file)
    assert(cited.count(_._2.startsWith("src")) > 100, "the citations are not found")
    assert(cited.filterNot(c => rules.contains(c._1)).distinct == Nil, "are no rules")
  }
}

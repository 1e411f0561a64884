package flyframe.report

import java.nio.file.{Files, Paths}
import org.scalatest.flatspec.AnyFlatSpec

class WrapSpec extends AnyFlatSpec {
  private val long = Seq.fill(40)("word").mkString(" ")

  "A paragraph" should "be filled, however it was broken" in {
    val first = Seq.fill(22)("word").mkString(" ")
    val rest  = Seq.fill(18)("word").mkString(" ")
    assert(first.length == 109)
    assert(Wrap(s"$long\n\nend\nof it") == s"$first\n$rest\n\nend of it")
    assert(Wrap(Wrap(long)) == Wrap(long))
  }

  "An item of a list" should "begin a line, and go on behind an indent" in
    assert(Wrap("- one\n- " + long).linesIterator.toSeq.map(_.take(4)) == Seq("- on", "- wo", "  wo"))

  "A word that would begin a list" should "stay in its line" in {
    val minus = "x" * 109 + " - y"
    assert(Wrap(minus) == "x" * 109 + " -\ny")
  }

  "Headings, tables, pictures, comments and code" should "stay as they are" in {
    for (start <- Seq("# ", "| ", "![", "<!-- ", "    ")) {
      val page = s"$start$long\n$start$long\n"
      assert(Wrap(page) == page)
    }
  }

  "docs/report.md" should "be wrapped" in {
    val page = Files.readString(Paths.get("docs/report.md"))
    assert(Wrap(page) == page, "make report writes it so")
  }
}

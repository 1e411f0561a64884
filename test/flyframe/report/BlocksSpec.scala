package flyframe.report

import java.nio.file.{Files, Path, Paths}
import scala.jdk.CollectionConverters._
import org.scalatest.flatspec.AnyFlatSpec

/** Figures in pages are those of the report. */
class BlocksSpec extends AnyFlatSpec {
  private lazy val report = Blocks.report(Paths.get("docs"))

  for (page <- Blocks.pages)
    s"The figures in $page" should "be those of docs/report.json" in {
      val text = Files.readString(page)
      assert(text.contains("<!-- figures: "))
      assert(text == Blocks.renew(text, report), "make report writes them")
    }

  "A figure that was changed by hand" should "be found" in {
    val text    = Files.readString(Blocks.pages.head)
    val changed = text.replaceFirst("(?m)^(\\| `slave` \\| )\\d", "$19")
    assert(changed != text && Blocks.renew(changed, report) == text)
  }

  "A block of unknown name" should "be refused" in {
    val text = "<!-- figures: sizes -->\n<!-- end of figures -->"
    assert(intercept[ReportError](Blocks.renew(text, report)).getMessage.contains("sizes"))
  }

  "No page" should "have a block that is not kept" in {
    val pages = Files.walk(Paths.get("docs")).iterator.asScala.toSeq ++
      Seq("fpga", "test", "demo", "src").map(Paths.get(_)).flatMap(d => Files.walk(d).iterator.asScala)
    val others = pages.filter((f: Path) => f.toString.endsWith(".md") && !Blocks.pages.contains(f))
    assert(others.nonEmpty)
    assert(others.filter(Files.readString(_).contains("<!-- figures: ")) == Nil)
  }
}

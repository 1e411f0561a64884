package flyframe

import java.nio.file.{Files, Path, Paths}
import scala.annotation.tailrec
import scala.jdk.CollectionConverters._
import scala.util.Try
import org.scalatest.flatspec.AnyFlatSpec

/** The order of the sources: a floor uses those below it only, which the compiler sees to, and the folders of
  * a floor do not use each other in a circle, which this test sees to.
  */
class ImportsSpec extends AnyFlatSpec {
  private val floors = Seq("base", "rtl", "server", "flyframe").map(f => Paths.get("src", f))

  /** A folder by its package: that of the floor itself is `flyframe`. Those of two floors may have the same
    * name.
    */
  private type Folder = Path

  private def sources(folder: Folder): Seq[String] =
    Files.list(folder).iterator.asScala.filter(_.toString.endsWith(".scala")).map(Files.readString(_)).toSeq

  private def folders(floor: Path): Seq[Folder] =
    Files.walk(floor).iterator.asScala.filter(f => Files.isDirectory(f) && sources(f).nonEmpty).toSeq

  private val Package   = "(?m)^package (flyframe[.\\w]*)".r
  private val Reference = "\\bflyframe\\.(?:(\\w+)|\\{([^}]*)\\})".r
  private val Comment   = "(?s)/\\*.*?\\*/|//[^\n]*|\"[^\"\n]*\"".r

  /** The words behind `flyframe.` in a source, those in braces each for itself. */
  private def referred(text: String): Seq[String] =
    Reference
      .findAllMatchIn(Comment.replaceAllIn(Package.replaceAllIn(text, ""), ""))
      .flatMap(m => Option(m.group(1)).toSeq ++ Option(m.group(2)).toSeq.flatMap(_.split(",")))
      .map(_.trim.takeWhile(_.isLetterOrDigit))
      .filter(_.nonEmpty)
      .toSeq

  /** Which folders of a floor each of its folders uses. */
  private def uses(floor: Path): Map[Folder, Set[Folder]] = {
    val byPackage = folders(floor).map { f =>
      val names = sources(f).map(text => Package.findFirstMatchIn(text).get.group(1)).distinct
      assert(names.size == 1, s"$f holds several packages")
      names.head -> f
    }.toMap
    byPackage.map { case (name, folder) =>
      val used = for {
        text <- sources(folder)
        word <- referred(text)
        // Lower case: a package; else a class of the floor's own folder.
        other = if (word.head.isLower) s"flyframe.$word" else "flyframe"
        target <- byPackage.get(other) if other != name
      } yield target
      folder -> used.toSet
    }
  }

  /** What remains of the arrows when folders that use none of the rest are taken away, again and again. */
  @tailrec private def circles(arrows: Map[Folder, Set[Folder]]): Map[Folder, Set[Folder]] = {
    val left = arrows
      .filter { case (_, used) => used.exists(arrows.contains) }
      .map { case (f, used) => f -> used.filter(arrows.contains) }
    if (left.size == arrows.size) left else circles(left)
  }

  for (floor <- floors)
    s"The folders of $floor" should "use each other in no circle" in {
      val arrows = uses(floor)
      assert(floor.endsWith("server") || arrows.values.exists(_.nonEmpty), "no import was found")
      assert(circles(arrows) == Map.empty)
    }

  /** The arrows that no longer way stands for, as they are drawn; circles there are none. */
  private def drawn(arrows: Map[Folder, Set[Folder]]): Set[String] = {
    def leads(from: Folder, to: Folder): Boolean = arrows(from).exists(next => next == to || leads(next, to))
    for {
      (from, used) <- arrows.toSet
      to           <- used
      if !used.exists(leads(_, to))
    } yield s"${from.getFileName} --> ${to.getFileName}"
  }

  for (floor <- Seq("base", "rtl").map(f => Paths.get("src", f)))
    s"The picture of $floor in docs/architecture.md" should "have these arrows, no short cuts" in {
      val page    = Files.readString(Paths.get("docs/architecture.md"))
      val picture = page.linesIterator.dropWhile(_ != s"%% $floor").takeWhile(_ != "```").map(_.trim).toSet
      val arrows  = drawn(uses(floor))
      assert(
        picture.filter(_.contains("-->")) == arrows,
        arrows.toSeq.sorted.mkString("; draw:\n  ", "\n  ", "")
      )
    }

  "A reference" should "be found in every form" in {
    val text =
      "package flyframe.a\nimport flyframe.b.C\nimport flyframe.{Pins, d => e}\n" +
        "val x = flyframe.f.G // flyframe.h"
    assert(referred(text) == Seq("b", "Pins", "d", "f"))
  }

  "A circle" should "be found, with what leads into it" in {
    val Seq(a, b, c) = Seq("a", "b", "c").map(Paths.get(_))
    assert(circles(Map(a -> Set(b), b -> Set(c), c -> Set(b))).keySet == Set(a, b, c))
  }

  "The floor base" should "have no Chisel on its class path" in {
    assert(Try(Class.forName("chisel3.Module")).isFailure)
    assert(Try(Class.forName("flyframe.params.EscParams")).isSuccess)
  }
}

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
  private val Reference = "\\bflyframe\\.(\\w+)".r
  private val Comment   = "(?s)/\\*.*?\\*/|//[^\n]*|\"[^\"\n]*\"".r

  /** Which folders of a floor each of its folders uses. */
  private def uses(floor: Path): Map[Folder, Set[Folder]] = {
    val byPackage = folders(floor).map { f =>
      val names = sources(f).map(text => Package.findFirstMatchIn(text).get.group(1)).distinct
      assert(names.size == 1, s"$f holds several packages")
      names.head -> f
    }.toMap
    byPackage.map { case (name, folder) =>
      val used = for {
        text  <- sources(folder)
        found <- Reference.findAllMatchIn(Comment.replaceAllIn(Package.replaceAllIn(text, ""), ""))
        // Lower case: a package; else a class of the floor's own folder.
        other = if (found.group(1).head.isLower) s"flyframe.${found.group(1)}" else "flyframe"
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
    s"The picture of $floor in docs/architecture.md" should "have these arrows, but those that a longer way stands for" in {
      val page    = Files.readString(Paths.get("docs/architecture.md"))
      val picture = page.linesIterator.dropWhile(_ != s"%% $floor").takeWhile(_ != "```").map(_.trim).toSet
      val arrows  = drawn(uses(floor))
      assert(
        picture.filter(_.contains("-->")) == arrows,
        arrows.toSeq.sorted.mkString("; draw:\n  ", "\n  ", "")
      )
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

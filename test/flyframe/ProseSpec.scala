package flyframe

import java.nio.file.{FileSystems, Files, Path, Paths}
import org.scalatest.flatspec.AnyFlatSpec
import scala.sys.process.Process
import scala.util.Try

/** What the pages that people read name is there: files, headings behind links, make targets, test classes,
  * and functions and signals that stand beside their file. And no text file of ours has long lines.
  */
class ProseSpec extends AnyFlatSpec {
  import Prose._

  private val pages: Seq[Path] =
    (Seq("README.md", "CONTRIBUTING.md").map(Paths.get(_)) ++ files.filter(_.startsWith("docs")) ++
      files.filter(_.endsWith("README.md"))).filter(_.toString.endsWith(".md")).distinct.sorted

  for (page <- pages)
    s"$page" should "name only what is there" in {
      val wrong = new Prose(page, Files.readString(page)).wrong
      assert(wrong.isEmpty, wrong.mkString("\n", "\n", ""))
    }

  "docs/architecture.md" should "say for each step where it is written down" in {
    val page = Paths.get("docs/architecture.md")
    assert(new Prose(page, Files.readString(page)).places.size > 20)
  }

  /** Folders that hold sources, but for resources. */
  private def sourceFolders: Set[String] = files
    .filter(f => f.startsWith("src") && f.toString.matches(".*\\.(scala|c|cpp|py|lua)") && f.getNameCount > 2)
    .map(_.getParent.toString)
    .toSet

  "The table of first tests in CONTRIBUTING.md" should "have every folder of sources" in {
    val table = section(Files.readString(Paths.get("CONTRIBUTING.md")), "Which test to run first")
    val named =
      "(?m)^\\| *((?:`src/[\\w/]+`(?:, )?)+)".r
        .findAllMatchIn(table)
        .flatMap(m => Span.findAllMatchIn(m.group(1)))
        .map(_.group(1))
        .toSeq
    assert(named.diff(named.distinct) == Nil, "stand there twice")
    assert((sourceFolders -- named).toSeq.sorted == Nil, "have no row")
    assert((named.toSet -- sourceFolders).toSeq.sorted == Nil, "hold no sources")
  }

  "Every text file of ours" should s"have no line of more than $Columns columns" in {
    val found = for {
      file <- files if isOurText(file)
      text <- Try(Files.readString(file)).toOption.toSeq // else it is no text
      line <- tooLong(file, text)
    } yield s"$file:$line"
    assert(found.isEmpty, found.mkString("\n", "\n", ""))
  }

  // ---- that the tests above can fail ----

  private def wrong(text: String): Seq[String] = new Prose(Paths.get("docs/made-up.md"), text).wrong
  private val step                             = "| Step | File | Where in it |\n|---|---|---|\n"

  "A long line" should "be found, unless it cannot be broken" in {
    def lines(name: String)(text: String*) = tooLong(Paths.get(name), text.mkString("\n"))
    val most                               = "x" * Columns
    assert(lines("a.scala")(most, most + "x", s"| $most", "µ" * Columns) == Seq(2, 3))
    assert(lines("a.md")(s"| $most |", s"[$most](b.md)", s"see https://example.org/$most") == Seq(2))
    assert(lines("a.md")(s"https://example.org/ $most") == Seq(1))
    assert(lines("a.patch")(s"+$most", s"+x$most") == Seq(2))
    assert(Seq("a/b.v", "docs/a.md", "Makefile", ".ci/run").forall(f => isOurText(Paths.get(f))))
    assert(Seq("generated/a.v", ".ci/requirements/a.txt", "docs/a.svg").forall(f => !isOurText(Paths.get(f))))
  }

  "A page that names what is there" should "be in order" in {
    assert(wrong("# One page\n\n[a](../README.md#limits), [b](#one-page), [c](https://example.org/x)") == Nil)
    assert(
      wrong(
        "`src/rtl/mii`, `Crc32.scala`, `test/rtl/*/Mii*.scala`, `src/{base,rtl}`, `generated/NAME.v`"
      ) == Nil
    )
    assert(wrong("    make verilog ARGS=\"--preset et1100\" # a make target\n\n`make help lint`") == Nil)
    assert(wrong("`testOnly flyframe.mii.MiiReceiverSpec`, `testOnly flyframe.mii.*`") == Nil)
    assert(wrong(s"$step| a | `src/rtl/mii/Crc32.scala` | `next`, `Start` |") == Nil)
    assert(wrong("`MiiReceiver.scala`: `symbol` and `endOfFrame`") == Nil)
  }

  for (
    (what, text, message) <- Seq(
      ("a file", "`src/rtl/mii/Crc33.scala`", "no file src/rtl/mii/Crc33.scala"),
      ("a file without its folder", "`Crc33.scala`", "no file Crc33.scala"),
      ("a file in a command", "    sh test/none.sh", "no file test/none.sh"),
      ("a file by a pattern", "`src/rtl/none*.scala`", "no file src/rtl/none*.scala"),
      ("a page by a link", "[a](none.md)", "no file none.md"),
      ("a heading", "[a](../README.md#none)", "no heading none in README.md"),
      ("a make target", "`make lint nonsense`", "no make target nonsense"),
      ("a test class", "`testOnly flyframe.mii.NoneSpec`", "no class flyframe.mii.NoneSpec"),
      ("a program", "`runMain flyframe.model.None`", "no class flyframe.model.None"),
      ("a function", "`Crc32.scala`: `next`, `none()`", "no none in Crc32.scala"),
      ("a function in any of several files", "`README.md`: `flyframe`", "several files README.md"),
      ("a signal in a table", s"$step| a | `Crc32.scala` | `Crc32.none` |", "no none in Crc32.scala")
    )
  ) s"A page that names $what that is not there" should "be found out" in assert(wrong(text) == Seq(message))
}

/** A page in Markdown, and what it names.
  *
  * @param page
  *   its path from the top of the repository
  */
class Prose(page: Path, text: String) {
  import Prose._
  private val folder = Option(page.getParent).getOrElse(Paths.get(""))

  private val blocks  = Fence.findAllMatchIn(text).filterNot(_.group(1) == "json").map(_.group(2)).toSeq
  private val outside = Fence.replaceAllIn(text, "\n")

  /** Texts of the page that stand in the type of code: spans, and the lines of blocks. */
  private val code: Seq[String] = {
    val (indented, other) = outside.linesIterator.toSeq.partition(_.startsWith("    "))
    val paragraphs        = other.mkString("\n").split("\n *\n").toSeq
    blocks.flatMap(_.linesIterator) ++ indented ++
      paragraphs.flatMap(Span.findAllMatchIn(_)).map(_.group(1).replace('\n', ' '))
  }

  private def missingFiles: Seq[String] =
    code
      .flatMap(_.split("\\s+"))
      .map(_.replaceAll("^[\"'(]+|[\"'),;:.]+$", ""))
      .filter(isPath)
      .filterNot(exists)

  /** Made by make, or a name for many: neither can be looked up. */
  private def isPath(word: String): Boolean =
    word.matches("[\\w.*{},/-]+") && !word.startsWith("/") && !Placeholder.matches(word) &&
      (if (word.contains('/')) {
         val first = word.takeWhile(_ != '/')
         !Set("build", "target").contains(first) &&
         (Files.exists(Paths.get(first)) || Files.exists(folder.resolve(first)) || SourceName.matches(word))
       } else SourceName.matches(word) && !word.startsWith("*"))

  private def exists(word: String): Boolean = {
    val places = if (word.contains('/')) Seq(Paths.get(""), folder) else Seq(folder)
    val paths  = places.map(_.resolve(word).normalize)
    if (word.exists("*{".contains(_)))
      paths.exists { path =>
        val matcher = FileSystems.getDefault.getPathMatcher(s"glob:$path")
        files.exists(f => Iterator.iterate(f)(_.getParent).takeWhile(_ != null).exists(matcher.matches))
      }
    else paths.exists(Files.exists(_)) || named(word).nonEmpty
  }

  private def missingLinks: Seq[String] =
    Link.findAllMatchIn(outside).map(_.group(1)).filterNot(_.contains("://")).toSeq.flatMap { link =>
      val (to, anchor) = link.span(_ != '#')
      val target       = if (to.isEmpty) page else folder.resolve(to).normalize
      if (to.nonEmpty && !Files.exists(target)) Some(s"no file $to")
      else
        Option.when(
          anchor.nonEmpty && !headings(if (to.isEmpty) text else Files.readString(target))
            .contains(anchor.tail)
        )(
          s"no heading ${anchor.tail} in $target"
        )
    }

  private def missingTargets: Seq[String] = for {
    line   <- code
    call   <- Make.findAllMatchIn(Setting.replaceAllIn(line.replaceAll("(^| )#.*", ""), "")).map(_.group(1))
    word   <- call.trim.split("\\s+").takeWhile(_ != "<")
    target <- Option.when(word.matches("[a-z][a-z0-9-]*"))(word)
    if !targets(target)
  } yield s"no make target $target"

  private def missingClasses: Seq[String] = for {
    line <- code
    name <- ClassName.findAllMatchIn(line).map(_.group(1))
    if !(if (name.endsWith("*")) classes.exists(_.startsWith(name.init)) else classes(name))
  } yield s"no class $name"

  /** Files and what the page says is in them: in tables with the columns *File* and *Where in it*, and as
    * `file`: `name`, `name`.
    */
  def places: Seq[(String, String)] = {
    val rows =
      outside.linesIterator.toSeq.map(l => if (l.startsWith("|")) l.split('|').toSeq.map(_.trim) else Nil)
    val inTables = rows
      .foldLeft((Option.empty[Int], Seq.empty[(String, String)])) { case ((column, found), row) =>
        if (row.isEmpty) (None, found)
        else if (row.contains("Where in it")) (Some(row.indexOf("Where in it")), found)
        else
          column.filter(row.isDefinedAt).fold((column, found))(c => (column, found :+ (row(c - 1) -> row(c))))
      }
      ._2
    val inProse = Beside.findAllMatchIn(outside).map(m => m.group(1) -> m.group(2))
    for {
      (where, what) <- inTables ++ inProse
      file          <- Span.findFirstMatchIn(where).map(_.group(1)).toSeq
      name          <- Span.findAllMatchIn(what).map(_.group(1))
    } yield file -> name
  }

  private def missingNames: Seq[String] = for {
    (file, name) <- places
    sources = named(file).map(Files.readString(_))
    word <- "[A-Za-z_]\\w*".r.findAllIn(name)
    if sources.nonEmpty && !(sources.size == 1 && s"\\b$word\\b".r.findFirstIn(sources.head).isDefined)
  } yield if (sources.size == 1) s"no $word in $file" else s"several files $file"

  /** What the page names that is not there. */
  def wrong: Seq[String] =
    (missingFiles.map(f =>
      s"no file $f"
    ) ++ missingLinks ++ missingTargets ++ missingClasses ++ missingNames).distinct
}

object Prose {
  private val Fence       = "(?ms)^```(\\w*)\n(.*?)^```$".r
  val Span                = "`([^`]+)`".r
  private val Link        = "\\]\\(([^)\\s]+)\\)".r
  private val Make        = "(?:^|[;&|(])\\s*make((?:\\s+[^\\s;&|]+)+)".r
  private val Setting     = "\\w+=(?:\"[^\"]*\"|'[^']*'|\\S*)".r
  private val ClassName   = "(?:testOnly|runMain) (flyframe[\\w.]*\\*?)".r
  private val Beside      = "(`[\\w./-]+\\.\\w+`):\\s((?:`[^`]+`(?:,\\s| and )?)+)".r
  private val SourceName  = "(?!_)[\\w.*{},/-]*\\w\\.(scala|sbt|c|h|cpp|py|sh|mk|sdc|tcl|md)".r
  private val Placeholder = ".*\\b(NAME|ROLE|FLOOR|PRESET|MASTER|PRODUCT)\\b.*".r

  /** Everything in the repository but what is built, paths from its top: as git lists it, since other tests
    * build at the same time.
    */
  lazy val files: Seq[Path] =
    Process(Seq("git", "ls-files", "--cached", "--others", "--exclude-standard")).lazyLines
      .map(Paths.get(_))
      .filter(Files.isRegularFile(_))
      .toSeq
      .sorted

  /** What a line has at most. */
  val Columns = 110

  /** Whether people write it: not what is emitted, locked or measured, nor pictures. */
  def isOurText(file: Path): Boolean =
    !Seq("generated", ".ci/requirements").exists(file.startsWith) &&
      !Seq(".csv", ".lock", ".svg").exists(file.toString.endsWith)

  /** Numbers of the lines that are too long. Rows of tables and addresses of pages cannot be broken; in a
    * patch a character stands before each line.
    */
  def tooLong(file: Path, text: String): Seq[Int] = {
    val isPage = file.toString.endsWith(".md")
    val most   = if (file.toString.endsWith(".patch")) Columns + 1 else Columns
    for {
      (line, i) <- text.linesIterator.zipWithIndex.toSeq
      if line.length > most && !(isPage && line.startsWith("|"))
      if "https?://\\S+".r.replaceAllIn(line, "").length > most || !line.contains("://")
    } yield i + 1
  }

  /** The files whose paths end with `name`, folders included. */
  private def named(name: String): Seq[Path] = files.filter(_.endsWith(name))

  private lazy val targets: Set[String] = files
    .filter(f => f.endsWith("Makefile") || f.toString.endsWith(".mk"))
    .flatMap(f => "(?m)^([a-z][a-z0-9 -]*):(?!=)".r.findAllMatchIn(Files.readString(f)))
    .flatMap(_.group(1).split(' '))
    .toSet

  /** Classes and objects of all Scala sources. */
  private lazy val classes: Set[String] = files
    .filter(_.toString.endsWith(".scala"))
    .map(Files.readString(_))
    .flatMap { source =>
      val name = "(?m)^package ([\\w.]+)".r.findFirstMatchIn(source).map(_.group(1))
      "(?m)^(?:final |abstract )*(?:class|object) (\\w+)".r
        .findAllMatchIn(source)
        .map(m => s"${name.get}.${m.group(1)}")
    }
    .toSet

  private def headings(page: String): Set[String] = "(?m)^#+ (.*)$".r
    .findAllMatchIn(Fence.replaceAllIn(page, ""))
    .map(_.group(1).toLowerCase.replaceAll("[^\\w\\- ]", "").replace(' ', '-'))
    .toSet

  /** The part of a page under a heading, down to the next of the same rank. */
  def section(page: String, heading: String): String =
    page.linesIterator.dropWhile(_ != s"## $heading").drop(1).takeWhile(!_.startsWith("## ")).mkString("\n")
}

package flyframe.report

/** Wraps the prose of a page in Markdown: how long a line gets is not known before the figures are in it.
  * Headings, tables, pictures, comments and blocks of code stay as they are.
  */
object Wrap {

  /** What no text file of ours has more of in a line. */
  val Columns = 110

  private def isProse(line: String): Boolean =
    line.trim.nonEmpty && !line.startsWith("    ") && !Seq("|", "#", "!", "<").exists(line.startsWith)

  /** At the start of a line it would begin a list, a heading or a quotation. */
  private def isMark(word: String): Boolean = word.matches("[-+*#>|]+|\\d+[.)]")

  /** `page` with its paragraphs and the items of its lists filled anew. */
  def apply(page: String): String =
    page
      .split("\n", -1)
      .foldLeft(Vector.empty[String]) { (parts, line) =>
        val goesOn = isProse(line) && !line.startsWith("- ") && parts.lastOption.exists(isProse)
        if (goesOn) parts.init :+ s"${parts.last} ${line.trim}" else parts :+ line
      }
      .map(part => if (isProse(part)) fill(part) else part)
      .mkString("\n")

  private def fill(part: String): String = {
    val indent = if (part.startsWith("- ")) "  " else ""
    val words  = part.trim.split("\\s+").toSeq
    words.tail
      .foldLeft(Vector(words.head)) { (lines, word) =>
        if (isMark(word) || lines.last.length + 1 + word.length <= Columns)
          lines.init :+ s"${lines.last} $word"
        else lines :+ s"$indent$word"
      }
      .mkString("\n")
  }
}

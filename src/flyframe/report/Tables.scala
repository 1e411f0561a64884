package flyframe.report

import flyframe.params.EscParams

/** Tables of the pages, in Markdown. */
object Tables {
  private def row(cells: String*): String = cells.mkString("| ", " | ", " |\n")

  /** A table; all columns but the first `texts` are right-aligned. */
  def table(head: Seq[String], rows: Seq[Seq[String]], texts: Int = 1): String =
    row(head: _*) + head.indices.map(i => if (i < texts) "---" else "---:").mkString("|", "|", "|\n") + rows
      .map(row(_: _*))
      .mkString

  /** `text` for a template with margins: its own bars at the start of a line stay. */
  def block(text: String): String = text.replace("\n|", "\n||")

  def n(v: Int): String           = f"$v%,d"
  def diff(v: Int): String        = if (v == 0) "0" else f"$v%+,d"
  def cells(a: Area): Seq[String] = Seq(a.luts, a.ffs, a.logicElements, a.m9k).map(n)
  def goals(of: Seq[Goal]): String = table(
    Seq("Goal", "Wanted", "Measured", ""),
    of.map(g => Seq(g.title, g.goal, g.measured, if (g.reached) "reached" else "**missed**")),
    texts = 4
  )

  /** What each of `variants` takes, and how much more that is than `base` does. */
  def features(area: String => Area, base: EscParams, variants: Seq[Variant]): String = {
    val from = area(base.preset)
    table(
      Seq("Change", "LUTs", "Registers", "Logic elements", "M9K", "Difference in logic elements"),
      (Seq(s"none (`${base.preset}`)") ++ cells(from) :+ "") +: variants.map { v =>
        val a    = area(v.params.preset)
        val was  = v.info.show(base)
        val more = v.needs.fold("")(n => s", with $n")
        (s"${v.info.name} ${v.value} (was $was)$more" +: cells(a)) :+ diff(
          a.logicElements - from.logicElements
        )
      }
    )
  }

  /** What each unit takes in each of `presets`. */
  def units(
      names: Seq[String],
      presets: Seq[String],
      of: String => Map[String, Area],
      shown: Area => Seq[Int],
      titles: String => Seq[String]
  ): String = {
    val rows = names.map(unit => unit +: presets.flatMap(p => shown(of(p).getOrElse(unit, Area())).map(n)))
    val sums = "**Sum**" +: presets.flatMap(p => shown(of(p).values.reduce(_ + _)).map(n))
    table("Unit" +: presets.flatMap(titles), rows :+ sums)
  }
}

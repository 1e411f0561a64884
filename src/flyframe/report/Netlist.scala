package flyframe.report

import java.nio.file.{Files, Path}

/** What a netlist takes of a Cyclone IV.
  *
  * @param luts
  *   4-input look-up tables, those that add included
  * @param ffs
  *   registers
  * @param paired
  *   registers that share a logic element with the LUT at their D input
  * @param m9k
  *   memory blocks
  * @param ramBits
  *   bits of the memory blocks that are addressed
  */
final case class Area(luts: Int = 0, ffs: Int = 0, paired: Int = 0, m9k: Int = 0, ramBits: Int = 0) {

  /** Logic elements: one LUT and one register each. */
  def logicElements: Int = luts + ffs - paired

  def +(o: Area): Area = Area(luts + o.luts, ffs + o.ffs, paired + o.paired, m9k + o.m9k, ramBits + o.ramBits)
}

/** Counts the cells of a netlist that yosys wrote as JSON after the commands of [[Cyclone4]]. */
object Netlist {

  /** Bits of one M9K block, parity included, and its widest word. */
  val M9kBits  = 9216
  val M9kWidth = 36

  def read(path: Path): ujson.Value = ujson.read(Files.readString(path))

  private def number(v: ujson.Value): Int = v match {
    case ujson.Str(bits) => Integer.parseInt(bits, 2)
    case other           => other.num.toInt
  }

  /** A word-level cell that was not mapped, such as `$not`, is counted as one LUT for each output bit. */
  private def isUnmapped(kind: String): Boolean =
    kind.startsWith("$") && !kind.startsWith("$paramod") && kind != "$scopeinfo"

  private def bits(cell: ujson.Value, pin: String): Seq[Int] =
    cell("connections").obj.get(pin).toSeq.flatMap(_.arr).collect { case ujson.Num(n) => n.toInt }

  /** Words and bits per word of an `altsyncram`. */
  private def shape(cell: ujson.Value): (Int, Int) =
    (number(cell("parameters")("numwords_a")), number(cell("parameters")("width_a")))

  /** The area of the cells of `module` itself, instances left out.
    *
    * Packing: a register shares the logic element of the LUT that drives its D input, each LUT taking at most
    * one register.
    */
  def own(module: ujson.Value): Area = {
    val cells                     = module("cells").obj.values.toSeq
    def of(kind: String)          = cells.filter(_("type").str == kind)
    val (tables, flops, memories) = (of("cycloneive_lcell_comb"), of("dffeas"), of("altsyncram"))
    val unmapped                  = cells.filter(c => isUnmapped(c("type").str))
    val driven                    = tables.flatMap(bits(_, "combout")) ++ unmapped.flatMap(bits(_, "Y"))
    val taken                     = flops.flatMap(bits(_, "d")).toSet
    val ram = memories.map { m =>
      val (words, width) = shape(m)
      if (words.toLong * width > M9kBits || width > M9kWidth)
        throw new ReportError(
          s"A memory of $words words of $width bits does not fit one M9K block, so blocks cannot be counted."
        )
      words * width
    }
    Area(
      tables.size + unmapped.flatMap(bits(_, "Y")).size,
      flops.size,
      driven.distinct.count(taken),
      memories.size,
      ram.sum
    )
  }

  /** The Verilog module a yosys module was made of: without parameters and without the number that tells
    * equal names apart.
    */
  private[flyframe] def plainName(name: String): String =
    name.split('\\').filter(_.nonEmpty).find(!_.startsWith("$")).getOrElse(name).replaceAll("_\\d+$", "")

  /** The area of each unit below `top` in a netlist with hierarchy. `unitOf` names the unit of a module; a
    * module without one belongs to the unit it is instantiated in, `top` to `rest`.
    */
  def byUnit(
      netlist: ujson.Value,
      top: String,
      rest: String,
      unitOf: String => Option[String]
  ): Map[String, Area] = {
    val modules = netlist("modules").obj
    def isBody(name: String) =
      modules.get(name).exists(m => !m.obj.get("attributes").exists(_.obj.contains("blackbox")))
    def walk(name: String, outer: String): Seq[(String, Area)] = {
      val unit  = unitOf(plainName(name)).getOrElse(outer)
      val below = modules(name)("cells").obj.values.map(_("type").str).filter(isBody).toSeq
      (unit -> own(modules(name))) +: below.flatMap(walk(_, unit))
    }
    walk(top, rest).groupMapReduce(_._1)(_._2)(_ + _)
  }
}

package flyframe.report

import java.nio.file.{Files, Path, Paths}

/** How yosys maps a design to a Cyclone IV: the stages of its `synth_intel`, with maps of our own where that
  * leaves something out. What [[Netlist]] counts is a netlist of these commands.
  */
object Cyclone4 {
  private def map(name: String): Path = Paths.get("src/flyframe/report/cyclone4", name)
  private val memory                  = map("m9k.v")
  private val carry                   = map("carry.v")
  private val clear                   = map("clear.v")

  /** The maps; with other ones a netlist is made anew. */
  def maps: Seq[String] = Seq(memory, carry, clear).map(Files.readString(_))

  /** One enable and one inverted reset for all registers that have it in common: dfflegalize makes them anew
    * for each.
    */
  private val shared = "opt_merge"

  private def techmap(map: Path) = s"techmap -map $map"

  /** As one module. */
  def flat(top: String): String = commands(top)

  /** With the modules of the design, so that every cell belongs to one. */
  def byModule(top: String): String = commands(top, options = "-noflatten")

  /** As one module, with adders on carry chains and with synchronous clears: nothing in an element follows
    * its adder, so that a counter whose clear is not the register's own would take two elements a bit.
    */
  def withCarry(top: String): String = commands(
    top,
    comparisons = Seq("opt_expr", "opt_clean", techmap(carry)),
    adders = Seq(techmap(carry)),
    registers = Seq(
      "dfflegalize -minsrst 4 -cell $_DFFE_PN0P_ 01 -cell $_SDFFCE_PP0P_ 01",
      shared,
      techmap(clear)
    )
  )

  private def commands(
      top: String,
      options: String = "",
      comparisons: Seq[String] = Nil,
      adders: Seq[String] = Nil,
      registers: Seq[String] = Seq("dfflegalize -cell $_DFFE_PN0P_ 01", shared)
  ): String = {
    def stages(run: String) = s"synth_intel -family cycloneive -top $top $options -run $run"
    val all = Seq(stages("begin:coarse")) ++ comparisons ++
      Seq(stages("coarse:map_bram"), "memory_bram -rules +/intel/common/brams_m9k.txt", techmap(memory)) ++
      adders ++ Seq(stages("map_ffram:map_ffs")) ++
      // Its last stage would cut addresses to the eight bits that its model of a block has.
      registers ++ Seq(stages("map_ffs:check"))
    all.mkString("; ")
  }
}

package flyframe

import flyframe.params.{EscParams, ParamInfo, ParamTable, Preset, Presets}

/** `docs/parameters.md`: presets, and for each role its parameters and the ports of its top module. */
object ParameterPage {
  private val default = Presets.default.params

  private def unit(i: ParamInfo): String = if (Seq("code", "switch").contains(i.unit)) "" else i.unit

  private def parameters(role: Int, from: EscParams): Seq[String] = Seq(
    "| Parameter | Meaning | Default | Range | Unit |",
    "|---|---|---:|---|---|"
  ) ++ ParamTable.all
    .filter(_.roles.contains(role))
    .map(_.in(role))
    .map(i => s"| `--${i.name}` | ${i.text} | ${i.show(from)} | ${i.range} | ${unit(i)} |")

  private def ports(of: Seq[PortInfo]): Seq[String] = Seq(
    "| Port | Direction | Bits | Only with | Meaning |",
    "|---|---|---:|---|---|"
  ) ++ of.map(p => s"| `${p.name}` | ${p.direction.short} | ${p.width} | ${p.condition} | ${p.meaning} |")

  /** What a preset sets, other than the default preset. */
  private def differences(p: EscParams): String = ParamTable
    .told(p)
    .filter(i => i.get(p) != i.get(default))
    .map(i => s"`${i.name}` ${i.show(p)}")
    .mkString(", ")

  private def presets: Seq[String] =
    Seq("| Preset | What it is | Differs from the default in |", "|---|---|---|") ++
      Presets.all.map { case Preset(p, text, note) =>
        val name = if (p == default) s"`${p.preset}` (default)" else s"`${p.preset}`"
        s"| $name | $text${note.fold("")(n => s". **$n**")} | ${differences(p)} |"
      }

  /** The page. */
  def text: String = (Seq(
    "# Parameters and ports",
    "",
    "Generated from `src/base/params` and `src/flyframe/PortTable.scala` by `make generated`; do not edit.",
    "",
    "A parameter that is not given keeps the value of the preset. Numbers may be hexadecimal (`0x`). " +
      "A value out of",
    "range, or one that does not go with another, ends the program with one sentence and exit code 2.",
    "",
    "## Presets",
    ""
  ) ++ presets ++ Seq(
    "",
    "## Slave controllers (`role` 0)",
    "",
    s"Defaults are those of `${default.preset}`.",
    ""
  ) ++
    parameters(0, default) ++ Seq(
      "",
      "Ports of the top module; `y` is the number of a port, from 0 on.",
      ""
    ) ++ ports(PortTable.slave) ++ Seq(
      "",
      "## Alarm masters (`role` 1)",
      "",
      s"Defaults are those of `${Presets.master.preset}`. The other parameters keep what they have there.",
      ""
    ) ++ parameters(1, Presets.master) ++ Seq(
      "",
      "Ports of the top module. Port 0 leads to the line of slaves, port 1 to the plant network; with",
      "`linePorts` 2 port 2 is the other end of the ring.",
      ""
    ) ++ ports(PortTable.master) ++ Seq(
      "",
      "## Ring nodes (`role` 2)",
      "",
      s"Defaults are those of `${Presets.ring.preset}`. The other parameters keep what they have there.",
      ""
    ) ++ parameters(2, Presets.ring) ++ Seq(
      "",
      "Ports of the top module. Optical port 2 of a node leads to port 1 of the next; port 0, with",
      "`plant` 1, leads to the plant network.",
      ""
    ) ++ ports(PortTable.ring)).mkString("", "\n", "\n")
}

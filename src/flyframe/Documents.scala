package flyframe

import flyframe.can.{CanError, CanField, CanState}
import flyframe.params.{EscParams, ParamTable}
import flyframe.protocol.{Codes, Layout}
import flyframe.registers.{Field, Register, RegisterMap, Source}

/** Texts derived from parameters, register description and protocol: register documentation, C headers,
  * parameters as JSON.
  */
object Documents {

  private def sourceText(f: Field): String = f.source match {
    case Source.Constant       => "constant"
    case _: Source.Stored      => "stored"
    case Source.Status         => "status"
    case Source.Ram            => "RAM"
    case _: Source.Kept        => "RAM of its unit"
    case Source.Counter(group) => s"counter, group $group"
  }

  private def hex(address: Int): String = f"0x$address%04X"

  private def addresses(r: Register): String = {
    val one = if (r.bytes == 1) hex(r.address) else s"${hex(r.address)}:${hex(r.address + r.bytes - 1)}"
    one + r.block.fold("")(b => s" + ${b.stride}n, n < ${b.count}")
  }

  /** Each register once: of equal units the first, with n for its number in names. */
  private def listed(p: EscParams): Seq[Register] =
    RegisterMap(p).filter(_.block.forall(_.index == 0)).map { r =>
      def general(name: String) = if (r.block.isEmpty) name else name.replaceFirst("0", "n")
      r.copy(name = general(r.name), fields = r.fields.map(f => f.copy(name = general(f.name))))
    }

  /** `docs/registers.md`: those of a slave with parameters `p`, a master with parameters `master`, a ring
    * node with parameters `ring`.
    */
  def registers(p: EscParams, master: EscParams, ring: EscParams): String = {
    val ram = s"0x1000:${hex(0x0fff + p.ramBytes)}"
    Seq(
      Seq(
        "# Registers",
        "",
        s"Generated from `src/base/registers` for preset `${p.preset}` with all options, and for presets",
        s"`${master.preset}` and `${ring.preset}`; do not edit. Multi-byte registers are little endian. Bits",
        "without a row are reserved: they read 0 and ignore writes. `r/clr`: a write of any value clears the",
        "whole group.",
        "",
        "## Slave",
        "",
        "Addresses without a row below 0x0F80 are absent: they give no working counter.",
        ""
      ),
      table(p),
      Seq(
        "| 0x0F80:0x0FFF | User RAM | all | | rw | rw | undefined | memory | For anything | GEN-04 |",
        s"| $ram | Process data RAM | all | | rw | rw | undefined | memory | Open while `pdi_operational` " +
          "| GEN-04 |",
        "",
        "## Alarm master",
        "",
        "For its host (column PDI); there is no other way in.",
        ""
      ),
      table(master),
      Seq(
        "",
        "## Ring node",
        "",
        "For its host (column PDI); there is no other way in. `can_t` is there with `canPorts` 2 only,",
        "what has a rule of FR-40 to FR-63 with `ring` 2, what has one of BR with `bridge` 1, what has",
        "GW-04 with `plant` 1.",
        ""
      ),
      table(ring)
    ).flatten.mkString("", "\n", "\n")
  }

  private def table(p: EscParams): Seq[String] = {
    val rows = for (r <- listed(p); f <- r.fields) yield {
      val bits = if (f.width == 1) s"${f.low}" else s"${f.high}:${f.low}"
      s"| ${addresses(r)} | ${r.title} | $bits | `${f.name}` | ${r.ecat.code} | ${r.pdi.code} " +
        s"| 0x${f.reset.toString(16)} | ${sourceText(f)} | ${f.meaning} | ${r.rule} |"
    }
    Seq(
      "| Address | Register | Bits | Field | ECAT | PDI | Reset | Kind | Meaning | Rule |",
      "|---|---|---|---|---|---|---|---|---|---|"
    ) ++ rows
  }

  /** C header for the program on the local host. */
  def cHeader(p: EscParams): String = cHeader(p, p.topName, s"for preset ${p.preset}")

  /** C header for the driver, which is the same for all slaves: all registers that `p` has. */
  def registerHeader(p: EscParams): String = cHeader(p, "esc", "for slaves with all options")

  private def cHeader(p: EscParams, name: String, of: String): String = {
    val guard                               = s"FLYFRAME_${name.toUpperCase}_H"
    val prefix                              = Seq("ESC_", "MASTER_", "NODE_")(p.role)
    def define(name: String, value: String) = f"#define ${prefix + name}%-40s $value"
    val rows = listed(p).flatMap { r =>
      val (name, address) = r.block match {
        case Some(b) => (r.name.toUpperCase + "(n)", f"(0x${r.address}%04Xu + ${b.stride}u * (n))")
        case None    => (r.name.toUpperCase, f"0x${r.address}%04Xu")
      }
      val register =
        define(name, s"$address /* ${r.title}, ${r.bytes} byte(s), host: ${r.pdi.code} */")
      val masks = r.fields.filterNot(f => f.width == 8 * r.bytes).flatMap { f =>
        val mask = ((BigInt(1) << f.width) - 1) << f.low
        Seq(
          define(f.name.toUpperCase + "_MASK", s"0x${mask.toString(16).toUpperCase}u"),
          define(f.name.toUpperCase + "_SHIFT", s"${f.low}u")
        )
      }
      register +: masks
    }
    val ram =
      if (p.role != 0) Nil
      else
        Seq(
          "",
          define("USER_RAM", f"0x${RegisterMap.UserRamStart}%04Xu"),
          define("PROCESS_RAM", f"0x${RegisterMap.ProcessRamStart}%04Xu"),
          define("PROCESS_RAM_BYTES", s"${p.ramBytes}u")
        )
    def codes(of: String, all: Seq[(String, Int)]) =
      all.map { case (name, value) => define(s"CAN_${of}_${name.toUpperCase}", s"${value}u") }
    val can =
      if (p.role != 2) Nil
      else
        Seq(
          "",
          "/* What the fields of CAN status and of the last error hold; data byte n is CAN_FIELD_DATA + n. */"
        ) ++
          codes("STATE", CanState.all) ++ codes("ERROR", CanError.all) ++ codes("FIELD", CanField.all)
    val generated = s"Generated by flyframe ${BuildInfo.version} $of; do not edit."
    s"""/* $generated Byte addresses of the host port. */
       |#ifndef $guard
       |#define $guard
       |
       |${(rows ++ ram ++ can).mkString("\n|")}
       |
       |#endif
       |""".stripMargin
  }

  /** C header with the numbers of the protocol: codes, and for each field of a record its first byte and how
    * many it has. It does not depend on parameters.
    */
  def protocolHeader: String = {
    def constant(name: String, value: Int, meaning: String) = {
      val number = if (value < 256) s"$value" else f"0x$value%04X"
      val line   = f"  ${s"PROTOCOL_${name.toUpperCase} ="}%-41s ${s"$number,"}%-7s"
      if (line.length + meaning.length > 100) s"  /* $meaning */\n${line.stripTrailing}"
      else s"$line /* $meaning */"
    }
    val codes = Codes.all.map { group =>
      val (prefix, tag) = if (group.name.isEmpty) ("", "") else (group.name + "_", s"protocol_${group.name} ")
      (
        s"/* ${group.meaning}. */",
        s"enum $tag{",
        group.all.map(c => constant(prefix + c.name, c.value, c.meaning))
      )
    }
    val layouts = Layout.all.map { layout =>
      val fields = layout.fields.flatMap { f =>
        val name = s"${layout.name}_${f.name}"
        Seq(constant(name + "_at", f.offset, f.meaning), constant(name + "_bytes", f.bytes, "of it"))
      }
      val order = layout.order.toString.toLowerCase.replace('_', ' ')
      (
        s"/* ${layout.meaning}, $order. */",
        "enum {",
        fields :+ constant(layout.name + "_bytes", layout.bytes, "of all")
      )
    }
    val groups = (codes ++ layouts).map { case (comment, begin, lines) =>
      (comment +: begin +: lines :+ "};").mkString("\n")
    }
    val generated = s"Generated by flyframe ${BuildInfo.version}; do not edit."
    s"""/* $generated Numbers of the protocol between slaves, master and server. */
       |#ifndef FLYFRAME_PROTOCOL_H
       |#define FLYFRAME_PROTOCOL_H
       |
       |${groups.mkString("\n\n")}
       |
       |#endif
       |""".stripMargin
  }

  /** The parameters for other programs (simulator, scripts). */
  def json(p: EscParams): String = {
    val values = ujson.Obj("preset" -> p.preset, "top" -> p.topName, "cyclesPerNibble" -> p.cyclesPerNibble)
    ParamTable.told(p.role).foreach(i => values(i.name) = i.get(p))
    ujson.write(values, indent = 2) + "\n"
  }
}

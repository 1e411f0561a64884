package flyframe

import java.nio.file.{Files, Paths}
import org.scalatest.flatspec.AnyFlatSpec
import flyframe.params.{EscParams, ParamTable, Presets}

/** The table of ports says what the Verilog has. */
class PortTableSpec extends AnyFlatSpec {

  /** Direction, width and name of each port of the top module, as the Verilog declares it. */
  private def told(p: EscParams): Set[(String, Int, String)] =
    PortTable(p).flatMap(i => i.names(p).map(n => (i.direction.verilog, i.bits(p), n))).toSet

  // As committed, which is what the sources emit (make check-generated).
  for (preset <- Presets.all; p = preset.params)
    s"The ports of ${p.preset}" should "be those of its Verilog" in {
      assert(told(p) == VerilogPorts.declared(p, Files.readString(Paths.get(s"generated/${p.preset}.v"))))
    }

  "The ports of the master of a ring" should "be those of its Verilog" in {
    val p = Presets.master.copy(preset = "ring", linePorts = 2)
    assert(told(p) == VerilogPorts.declared(p, Emit.verilog(p)))
  }

  "Every optional port" should "be as the table says where a preset has none of it" in {
    val p = Presets.default.params.copy(
      preset = "all-ports",
      dataBusWidth = 32,
      applicationLayer = 1,
      leds = 1,
      digitalOutputs = 3,
      generalOutputs = 8,
      generalInputs = 5,
      alarm = 1,
      sii = 2,
      ports = 3,
      rmiiPorts = 0x1,
      mi = 1,
      enhancedLinkDetection = 1,
      fxPorts = 0x1,
      resetRegisters = 1,
      clocks = 2,
      syncSignals = 2,
      latchSignals = 2
    )
    assert(told(p) == VerilogPorts.declared(p, Emit.verilog(p)))
    val hosts =
      for (role <- Seq(Presets.default.params, Presets.master); interface <- 1 to 5)
        yield role.copy(preset = s"host${role.role}$interface", hostInterface = interface, dataBusWidth = 32)
    val sets = hosts ++ TestSets.digital ++ TestSets.rings
    for (set <- sets) assert(told(set) == VerilogPorts.declared(set, Emit.verilog(set)))
    val seen = (p +: (sets ++ Presets.all.map(_.params))).flatMap(told).map(_._3).toSet
    val all  = (PortTable.slave ++ PortTable.master ++ PortTable.ring).map(_.name.replace("_y", "_0")).toSet
    assert(all -- seen == Set.empty)
  }

  "docs/parameters.md" should "show every parameter with its range for its roles, and every port" in {
    val Array(slave, others) = ParameterPage.text.split("## Alarm masters")
    val Array(master, ring)  = others.split("## Ring nodes")
    for (i <- ParamTable.all; (part, role) <- Seq(slave, master, ring).zipWithIndex)
      if (i.roles(role)) {
        val row = part.linesIterator.filter(_.startsWith(s"| `--${i.name}` | ${i.in(role).text} | ")).toSeq
        assert(row.size == 1 && row.head.contains(s" | ${i.in(role).range} | "), i.name)
      } else assert(!part.contains(s"| `--${i.name}` |"), i.name)
    assert(ParamTable.all.flatMap(_.roles).toSet == Set(0, 1, 2) && ParamTable.all.forall(_.roles.nonEmpty))
    for (
      (ports, part) <- Seq(PortTable.slave -> slave, PortTable.master -> master, PortTable.ring -> ring);
      port          <- ports
    )
      assert(part.contains(s"| `${port.name}` | ${port.direction.short} | ${port.width} |"), port.name)
  }
}

package flyframe

import java.nio.file.{Files, Path, Paths}
import org.scalatest.flatspec.AnyFlatSpec
import flyframe.board.Shell
import flyframe.params.{EscParams, Presets}

/** What other tools are told of a controller, read by these or in their language. */
class PackagesSpec extends AnyFlatSpec {
  private val avalon = Presets.default.params.copy(
    preset = "on-avalon",
    hostInterface = 1,
    dataBusWidth = 16,
    applicationLayer = 1,
    leds = 1
  )

  /** What a component says, each command on a line with its arguments. */
  private def commands(p: EscParams): Seq[Seq[String]] = {
    val file =
      Files.writeString(Directory.lasting().resolve("component_hw.tcl"), Packages.platformDesigner(p).get)
    Shell
      .output("tclsh", "test/flyframe/hw_tcl.tcl", file.toString)
      .linesIterator
      .map(_.split('\t').toSeq)
      .toSeq
  }

  "A component for Platform Designer" should "have every port of its Verilog once" in {
    val said = commands(avalon)
    val ports = said.collect { case Seq("add_interface_port", _, name, _, direction, bits) =>
      (direction.toLowerCase, bits.toInt, name)
    }
    assert(ports.size == ports.distinct.size)
    assert(ports.toSet == VerilogPorts.declared(avalon, Emit.verilog(avalon)))
  }

  it should "have roles that Avalon-MM has, and interfaces that are there" in {
    val said       = commands(avalon)
    val interfaces = said.collect { case Seq("add_interface", name, kind, "end") => name -> kind }.toMap
    for (case Seq("add_interface_port", interface, name, role, _*) <- said) {
      val roles = interfaces(interface) match {
        case "clock"     => Set("clk")
        case "reset"     => Set("reset")
        case "interrupt" => Set("irq")
        case "conduit"   => Set("export")
        case "avalon" =>
          Set("address", "read", "write", "byteenable", "writedata", "readdata", "waitrequest")
      }
      assert(roles(role), s"$name is $role")
    }
    val properties = said.collect { case Seq("set_interface_property", name, property, value) =>
      interfaces(name)
      (name, property) -> value
    }.toMap
    assert(properties("avalon" -> "addressUnits") == "WORDS")
    assert(properties("clock" -> "clockRate") == "100000000")
    assert(properties("irq" -> "associatedAddressablePoint") == "avalon")
  }

  it should "be there with Avalon-MM only" in
    assert(Presets.all.map(_.params).forall(Packages.platformDesigner(_).isEmpty))

  "FuseSoC" should "know every preset, and lint one as its core file says" in {
    val root = Directory.lasting("flyframe-cores")
    val tool = Paths.get("build/tools/venv/bin/fusesoc").toAbsolutePath.toString
    def fusesoc(from: Path, arguments: String*): String =
      Shell.output(Seq(tool, "--cores-root", from.toString) ++ arguments: _*)
    val listed = fusesoc(Paths.get("generated"), "core", "list")
    for (p <- Presets.all.map(_.params))
      assert(listed.contains(s"flyframe:controllers:${p.topName}:${BuildInfo.version}"), p.preset)
    Files.writeString(root.resolve("on-avalon.v"), Emit.verilog(avalon))
    Files.writeString(root.resolve("on-avalon.core"), Packages.fuseSoc(avalon))
    val core  = s"flyframe:controllers:${avalon.topName}"
    val build = root.resolve("build")
    fusesoc(root, "run", "--target=lint", s"--build-root=$build", core)
    // A file that is not there is one.
    Files.delete(root.resolve("on-avalon.v"))
    val again = Seq(tool, "--cores-root", root.toString, "run", "--target=lint", s"--build-root=$build", core)
    assert(Shell.ends(again: _*)._1 != 0)
  }
}

package flyframe.board

import java.nio.file.{Files, Path, Paths}
import scala.sys.process._
import flyframe.{Documents, Emit}
import flyframe.params.{EscParams, Presets}
import flyframe.report.{Cyclone4, Netlist}

/** Runs programs for the tests of the board. */
object Shell {

  /** Exit code and output, standard error included. */
  def ends(command: String*): (Int, String) = {
    val text = new StringBuilder
    val code = Process(command).!(ProcessLogger(line => text.synchronized(text.append(line).append('\n'))))
    (code, text.toString)
  }

  /** The output of a command that must end with 0. */
  def output(command: String*): String = {
    val (code, text) = ends(command: _*)
    if (code != 0)
      throw new AssertionError(s"${command.mkString(" ")} ended with $code:\n${text.takeRight(4000)}")
    text
  }
}

/** The board of one role, data bus width, number of line ports and kind of PHYs, as `make quartus` generates
  * it, and what Yosys makes of it.
  */
final class BoardFiles(val role: String, val width: Int, val linePorts: Int = 1, val rmii: Boolean = false) {
  import Shell.output
  private val kind = if (rmii) "rmii" else "mii"
  private val dir  = Files.createDirectories(Paths.get(s"build/check-board/$role-$width-$linePorts-$kind"))
  private lazy val p: EscParams =
    Presets
      .named(s"alarm-$role")
      .get
      .params
      .copy(
        preset = s"alarm-$role",
        dataBusWidth = width,
        linePorts = linePorts,
        rmiiPorts = if (rmii) (2 << linePorts) - 1 else 0
      )

  /** Core clock, MHz. */
  def coreClockMhz: Int = p.coreClockMhz

  /** The type at register 0. */
  def identity: Int = p.escType

  private def written(name: String, text: String): Path = Files.writeString(dir.resolve(name), text)

  /** The files of the Quartus project, and a stand-in for the PLL. */
  lazy val verilog: Seq[Path] = Seq(
    Paths.get("fpga/alarm/board.v"),
    written("board_support.v", Emit.boardSupport(p)),
    written(s"alarm-$role.v", Emit.verilog(p)),
    Paths.get("test/flyframe/board/altpll.v")
  )

  private def isMaster = if (role == "master") 1 else 0
  private def parameters =
    Seq("ROLE" -> isMaster, "DATA_BUS_WIDTH" -> width, "CORE_MHZ" -> p.coreClockMhz)

  /** What the Verilog is read with, as the project script says. */
  private def macros =
    Seq("RMII" -> rmii, "RING" -> (linePorts == 2), "WIDE_BUS" -> (width == 32)).collect {
      case (name, true) => s"-D$name=1"
    }
  private def values = macros ++ parameters.map { case (name, value) => s"-G$name=$value" }
  private def yosys(kind: String, commands: String): ujson.Value = {
    val json   = dir.resolve(s"$kind.json")
    val set    = parameters.map { case (name, value) => s"-set $name $value" }.mkString(" ")
    val script = s"read_verilog ${(macros ++ verilog).mkString(" ")}; chparam $set board; "
    output("yosys", "-q", "-p", s"$script $commands; write_json $json")
    Netlist.read(json)
  }

  /** The design with its hierarchy; fails if a module is missing. */
  lazy val design: ujson.Value = yosys("design", "hierarchy -check -top board; proc; opt_clean")

  /** Mapped to Cyclone IV and flat. */
  lazy val mapped: ujson.Value =
    yosys("mapped", Cyclone4.flat("board"))("modules")("board")

  /** What Verilator complains about. */
  def lint(): String = {
    val waivers = Seq("fpga/verilator.vlt", "test/flyframe/board/verilator.vlt")
    val flags   = Seq("--lint-only", "-Wall", "--default-language", "1364-2005", "--top-module", "board")
    Shell.ends(Seq("verilator") ++ flags ++ values ++ waivers ++ verilog.map(_.toString): _*)._2
  }

  /** A program with a Verilated module and one C++ source. */
  def simulator(top: String, source: String, settings: Seq[String], files: Seq[Path]): String = {
    val out   = dir.resolve(top).toString
    val flags = Seq("--cc", "--exe", "--build", "-j", "2", "-O3", "-Wno-lint", "-Wno-style", "-Mdir", out)
    val c = Seq(
      "-CFLAGS",
      s"-std=c++17 -O2 -Wall -DWIDTH=$width -DCORE_MHZ=${p.coreClockMhz}",
      "-o",
      "program",
      "--top-module",
      top
    )
    val path = Paths.get(source).toAbsolutePath
    output(Seq("verilator") ++ flags ++ c ++ settings ++ (files :+ path).map(_.toString): _*)
    s"$out/program"
  }

  /** The host bus against a memory interface. */
  def busProgram: String =
    simulator(
      "board_support",
      "test/flyframe/board/host_bus.cpp",
      Nil,
      verilog.filter(_.endsWith("board_support.v"))
    )

  /** The whole board. */
  def boardProgram: String =
    simulator(
      "board_bench",
      "test/flyframe/board/board.cpp",
      values,
      verilog :+ Paths.get("test/flyframe/board/board_bench.v")
    )

  /** Ports of the top module, bit by bit, with their direction. */
  lazy val ports: Map[String, String] = design("modules")("board")("ports").obj.toSeq.flatMap {
    case (name, port) =>
      val bits      = port("bits").arr.size
      val direction = port("direction").str
      // A port declared [0:0] is a bus of one.
      if (bits == 1 && !BoardFiles.buses(name)) Seq(name -> direction)
      else (0 until bits).map(i => s"$name[$i]" -> direction)
  }.toMap

  /** Registers, as Quartus names them: `Entity:instance|Entity:instance|register`. */
  lazy val registers: Seq[String] = {
    val declared = BoardFiles.registers(verilog.map(f => Files.readString(f)).mkString("\n"))
    def walk(module: String, prefix: String): Seq[String] = {
      val entity = Netlist.plainName(module)
      val body   = design("modules")(module)
      val cells  = body("cells").obj.toSeq
      val stored = cells.filter(_._2("type").str.endsWith("dff")).flatMap(_._2("connections")("Q").arr).toSet
      val own = body("netnames").obj.toSeq
        .filter { case (name, net) => declared(entity -> name) && net("bits").arr.forall(stored) }
        .flatMap { case (name, net) =>
          val bits = net("bits").arr.size
          if (bits == 1) Seq(s"$prefix$name") else (0 until bits).map(i => s"$prefix$name[$i]")
        }
      val below = cells.collect {
        case (name, cell)
            if design("modules").obj.contains(cell("type").str) && cell("type").str != "altpll" =>
          (name, cell("type").str)
      }
      own ++ below.flatMap { case (name, kind) => walk(kind, s"$prefix${Netlist.plainName(kind)}:$name|") }
    }
    walk("board", "")
  }

  /** The names for `test/flyframe/board/timing.tcl`. */
  lazy val names: Path = {
    val pins  = registers.map(r => s"pin {$r|clrn}")
    val lines = ports.keys.toSeq.map(n => s"port {$n}") ++ registers.map(n => s"register {$n}") ++ pins
    written("names.txt", lines.mkString("", "\n", "\n"))
  }

  /** The assignments of the Quartus project, a line each, made from the parameters beside the Verilog; writes
    * clock.sdc.
    */
  lazy val project: Seq[String] = {
    written(s"alarm-$role.json", Documents.json(p))
    BoardFiles.project(role, width, dir).linesIterator.toSeq
  }

  /** What the project's constraints name: command, then the name of a port, register or clock. */
  lazy val constraints: Seq[(String, String)] = {
    val sdc = project.collectFirst { case s"global SDC_FILE $name" =>
      dir.resolve("quartus").resolve(name)
    }.get
    output("tclsh", "test/flyframe/board/timing.tcl", names.toString, sdc.toString).linesIterator
      .map(_.split(" ", 3))
      .map(words => words.head -> words.last)
      .toSeq
  }
}

object BoardFiles {

  /** Runs the project script in plain Tcl on what stands in `dir`. */
  def project(role: String, width: Int, dir: Path): String =
    Shell.output("tclsh", "test/flyframe/board/pins.tcl", "fpga/alarm/alarm.tcl", role, s"$width", s"$dir")
  private val buses = Set("bus_nbl")

  /** Names declared as registers, with the module they are in. */
  private def registers(text: String): Set[(String, String)] = {
    val Module = "^module (\\w+).*".r
    val Reg    = "^\\s+reg\\s+(?:\\[\\d+:0\\]\\s*)?(\\w+);.*".r
    var module = ""
    text.linesIterator.flatMap {
      case Module(name) => module = name; None
      case Reg(name)    => Some(module -> name)
      case _            => None
    }.toSet
  }
}

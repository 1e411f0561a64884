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

/** A board as `make quartus` generates it, and what Yosys makes of it.
  *
  * @param board
  *   its folder in `fpga`
  * @param role
  *   what it is, the rest of the preset's name
  * @param width
  *   data bus towards the host, bits
  * @param kind
  *   what else tells it from others of that role and width
  */
abstract class BoardFiles(val board: String, val role: String, val width: Int, kind: String) {
  import Shell.output

  /** What it is called in tests. */
  def name: String
  private val preset = s"$board-$role"
  private val dir    = Files.createDirectories(Paths.get(s"build/check-board/$role-$width$kind"))

  /** `base` with what the board has changed. */
  protected def changed(base: EscParams): EscParams
  lazy val p: EscParams =
    changed(Presets.named(preset).get.params).copy(preset = preset, dataBusWidth = width)

  /** Core clock, MHz. */
  def coreClockMhz: Int = p.coreClockMhz

  /** The device of the project, as Quartus names it. */
  def device: String = project.collectFirst { case s"global DEVICE $name" => name }.get

  /** Arguments of the project script behind role and width. */
  protected def arguments: Seq[String] = Nil

  private def written(name: String, text: String): Path = Files.writeString(dir.resolve(name), text)

  /** The files of the Quartus project, and a stand-in for the PLL. */
  lazy val verilog: Seq[Path] = Seq(
    Paths.get(s"fpga/$board/board.v"),
    written("board_support.v", Emit.boardSupport(p)),
    written(s"$preset.v", Emit.verilog(p)),
    Paths.get("test/flyframe/board/altpll.v")
  )

  private def parameters = project.collect { case s"parameter $name $value" => name -> value }

  /** What the Verilog is read with, as the project script says. */
  private def macros = project.collect { case s"global VERILOG_MACRO $assignment" => s"-D$assignment" }
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
    val headers = Paths.get("generated").toAbsolutePath
    val out     = dir.resolve(top).toString
    val flags   = Seq("--cc", "--exe", "--build", "-j", "2", "-O3", "-Wno-lint", "-Wno-style", "-Mdir", out)
    val c = Seq(
      "-CFLAGS",
      s"-std=c++17 -O2 -Wall -DWIDTH=$width -DCORE_MHZ=${p.coreClockMhz} -I$headers",
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

  /** The whole board on a bench: `NAME_bench.v` and `NAME.cpp`. */
  def boardProgram: String =
    simulator(
      s"${board}_bench",
      s"test/flyframe/board/$board.cpp",
      values,
      verilog :+ Paths.get(s"test/flyframe/board/${board}_bench.v")
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

  /** The names for `test/flyframe/board/timing.tcl`; those of pins hold no entities. */
  lazy val names: Path = {
    val pins  = registers.map(r => s"pin {${r.replaceAll("\\w+:", "")}|clrn}")
    val lines = ports.keys.toSeq.map(n => s"port {$n}") ++ registers.map(n => s"register {$n}") ++ pins
    written("names.txt", lines.mkString("", "\n", "\n"))
  }

  /** The assignments of the Quartus project, a line each, made from the parameters beside the Verilog; writes
    * clock.sdc.
    */
  lazy val project: Seq[String] = {
    written(s"$preset.json", Documents.json(p))
    val script = s"fpga/$board/$board.tcl"
    val all    = Seq(script, role, s"$width") ++ arguments :+ s"$dir"
    output(Seq("tclsh", "test/flyframe/board/pins.tcl") ++ all: _*).linesIterator.toSeq
  }

  /** Its pins: port, number. */
  lazy val pins: Seq[(String, Int)] =
    project.map(_.split(' ')).collect { case Array("pin", number, port) => port -> number.toInt }

  /** Where the constraints get the core clock from. */
  private lazy val clockPath = project.collectFirst { case s"global SDC_FILE $name" =>
    dir.resolve("quartus").resolve(name)
  }.get
  def clockFile: Seq[String] = Files.readString(clockPath).linesIterator.toSeq

  /** What the project's constraints name: command, then the name of a port, register or clock. */
  lazy val constraints: Seq[(String, String)] = {
    output("tclsh", "test/flyframe/board/timing.tcl", names.toString, clockPath.toString).linesIterator
      .map(_.split(" ", 3))
      .map(words => words.head -> words.last)
      .toSeq
  }
}

object BoardFiles {

  /** User pins of a package by number, with their kind, from a file beside this one. */
  def userPins(file: String): Map[Int, String] = Files
    .readString(Paths.get(s"test/flyframe/board/$file.txt"))
    .linesIterator
    .filterNot(_.startsWith("#"))
    .flatMap { line =>
      val words = line.split(' ')
      words.tail.map(_.toInt -> words.head)
    }
    .toMap
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

/** The alarm board. */
final class AlarmBoard(role: String, width: Int, val linePorts: Int = 1, val rmii: Boolean = false)
    extends BoardFiles("alarm", role, width, s"-$linePorts-${if (rmii) "rmii" else "mii"}") {
  def isRing: Boolean = linePorts == 2
  def name: String =
    s"The $role's board with $width bits${if (isRing) " and a ring" else ""}${if (rmii) " and RMII" else ""}"
  protected def changed(base: EscParams): EscParams =
    base.copy(linePorts = linePorts, rmiiPorts = if (rmii) (2 << linePorts) - 1 else 0)

  /** The type at register 0. */
  def identity: Int = p.escType
}

/** The ring board. */
final class RingBoard(role: String, width: Int, override val arguments: Seq[String])
    extends BoardFiles("ring", role, width, "") {
  def name: String                                  = s"The board of ring-$role with $width bits"
  protected def changed(base: EscParams): EscParams = base
}

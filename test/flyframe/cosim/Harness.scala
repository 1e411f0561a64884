package flyframe.cosim

import java.io.{BufferedOutputStream, FileOutputStream, PrintStream}
import java.nio.file.{Files, Path, Paths}
import scala.jdk.CollectionConverters._
import scala.sys.process._
import flyframe.{Documents, Emit}
import flyframe.params.EscParams

/** Emits parameter sets, builds the C++ simulator with them, without waveforms, and runs its programs.
  *
  * @param name
  *   of the folder under `build` for all of this
  * @param options
  *   variables of `src/sim/sim.mk`, as `NAME=value`
  */
final class Harness(name: String, sets: Seq[EscParams], options: String*) {
  private val verilog = Paths.get(s"build/$name/verilog")
  private val out     = Paths.get(s"build/$name")

  /** Standard output and error of a command; fails with them if it does not end with 0. */
  private def run(command: String*): String = {
    val text = new StringBuilder
    val code = Process(command).!(ProcessLogger(line => text.synchronized(text.append(line).append('\n'))))
    if (code != 0)
      throw new AssertionError(s"${command.mkString(" ")} ended with $code:\n${text.takeRight(4000)}")
    text.toString
  }

  /** Emits, on all cores; what has not changed keeps its file, what is of other sets goes. */
  lazy val emitted: Unit = {
    val present = Files.list(Files.createDirectories(verilog)).iterator.asScala.toSeq
    val names   = sets.map(_.preset) :+ "protocol"
    present
      .filterNot(file => names.exists(name => file.getFileName.toString.startsWith(s"$name.")))
      .foreach(Files.delete(_))
    val documents = Seq[(String, EscParams => String)](
      "v"    -> Emit.verilog,
      "json" -> Documents.json,
      "h"    -> Documents.cHeader
    )
    def write(name: String, text: String): Unit = {
      val file = verilog.resolve(name)
      if (!Files.exists(file) || Files.readString(file) != text) Files.writeString(file, text)
    }
    write("protocol.h", Documents.protocolHeader)
    sets.asJava.parallelStream.forEach(p =>
      documents.foreach { case (suffix, text) => write(s"${p.preset}.$suffix", text(p)) }
    )
  }
  private def make(target: String, more: String*): Unit = {
    emitted
    val settings = Seq(
      "COSIM_TRACE=0",
      s"GENERATED=$verilog",
      s"COSIM_OUT=$out",
      s"PRESETS=${sets.map(_.preset).mkString(" ")}"
    )
    run(Seq("make", "-s", "-j2", "-f", "src/sim/sim.mk", target) ++ settings ++ options ++ more: _*)
  }

  /** A program of the simulator, built when it is first needed; models are shared by content, see
    * `src/sim/model.sh`.
    */
  private def program(name: String, more: String*): String = {
    make(s"$out/$name", more: _*)
    s"$out/$name"
  }
  private lazy val fuzzProgram  = program("flyframe-fuzz")
  private lazy val cosimProgram = program("flyframe-cosim")

  /** Lints what has been emitted. */
  def lint(): String = run("test/sim/lint.sh", verilog.toAbsolutePath.toString)

  /** Writes vectors and plays them; the last line of the runner. */
  def play(file: String)(write: PrintStream => Unit): String = {
    val runner = fuzzProgram
    val path   = out.resolve(file)
    val stream = new PrintStream(new BufferedOutputStream(new FileOutputStream(path.toFile), 1 << 16))
    write(stream)
    stream.close()
    val text = run(runner, "--vectors", path.toString)
    Files.delete(path) // kept only if it shows a difference
    text.linesIterator.toSeq.last
  }

  /** Replays a recording through a network; what the program says. Idle time is skipped. */
  def replay(network: Path, recording: Path, result: Path): String =
    run(
      cosimProgram,
      "--network",
      network.toString,
      "--replay",
      recording.toString,
      "--out",
      result.toString
    )

  /** Random accesses of bus and host to the SyncManagers of one of the sets; what the program says. */
  def soak(set: EscParams, steps: Long, seed: Long): String =
    run(soakProgram, "--preset", set.preset, "--steps", s"$steps", "--seed", s"$seed")

  /** Slaves of the first set behind cables that fail; what the program says. */
  def faults(cycles: Long, seed: Long, more: String*): String = {
    val arguments = Seq("--preset", sets.head.preset, "--cycles", s"$cycles", "--seed", s"$seed") ++ more
    run(program("flyframe-faults") +: arguments: _*)
  }

  /** A host at the pins of one of the sets: conformance, and accesses at random; what the program says. */
  def hosts(set: EscParams, accesses: Long, seed: Long): String = {
    val header    = verilog.resolve(s"${set.preset}.h")
    val arguments = Seq("--preset", set.preset, "--registers", s"$header", "--accesses", s"$accesses")
    run(Seq(hostsProgram) ++ arguments ++ Seq("--seed", s"$seed"): _*)
  }
  private lazy val hostsProgram: String = program("flyframe-hosts")

  /** The program that simulates the smoke-alarm system. */
  lazy val alarmProgram: Path = Paths.get(program("flyframe-alarm"))

  /** The program that simulates a fibre ring. */
  lazy val ringProgram: Path = Paths.get(program("flyframe-ring"))

  /** The program that uses SyncManagers from bus and host at once. */
  private lazy val soakProgram: String = program("flyframe-smsoak")

  /** The programs for runs of many frames, as fast as they get. */
  def longRuns(): Unit = {
    val profile = if (sets.exists(p => p.isMaster || p.ports == 1)) "0" else "1"
    for (name <- Seq("flyframe-fuzz", "flyframe-smsoak", "flyframe-faults"))
      program(name, s"COSIM_PROFILE=$profile")
  }
}

package flyframe.cosim

import java.io.{BufferedOutputStream, FileOutputStream, PrintStream}
import java.nio.file.{Files, Path, Paths}
import scala.sys.process._
import flyframe.{Documents, Emit}
import flyframe.params.EscParams

/** Emits parameter sets, builds the C++ harness with them, and runs its programs. */
final class Harness(name: String, sets: Seq[EscParams]) {
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

  private def emit(): Unit = {
    Files.createDirectories(verilog)
    val documents = Seq[(String, EscParams => String)](
      "v"    -> Emit.verilog,
      "json" -> Documents.json,
      "h"    -> Documents.cHeader
    )
    val files = for (p <- sets; (suffix, write) <- documents) yield s"${p.preset}.$suffix" -> write(p)
    for ((name, text) <- files :+ ("protocol.h" -> Documents.protocolHeader)) {
      val file = verilog.resolve(name)
      if (!Files.exists(file) || Files.readString(file) != text) Files.writeString(file, text)
    }
  }
  private def make(target: String, settings: String*): Unit = {
    val fixed = Seq(s"GENERATED=$verilog", s"COSIM_OUT=$out", s"PRESETS=${sets.map(_.preset).mkString(" ")}")
    run(Seq("make", "-s", "-j2", "-f", "test/cosim/cosim.mk", target) ++ fixed ++ settings: _*)
  }

  /** Emits and builds what has changed. */
  lazy val build: Unit = {
    emit()
    make("cosim")
  }

  /** Lints what `build` has emitted. */
  def lint(): String = run("test/cosim/matrix.sh", verilog.toAbsolutePath.toString)

  /** Writes vectors and plays them; the last line of the runner. */
  def play(file: String)(write: PrintStream => Unit): String = {
    build
    val path   = out.resolve(file)
    val stream = new PrintStream(new BufferedOutputStream(new FileOutputStream(path.toFile), 1 << 16))
    write(stream)
    stream.close()
    val text = run(s"$out/flyframe-fuzz", "--vectors", path.toString)
    Files.delete(path) // kept only if it shows a difference
    text.linesIterator.toSeq.last
  }

  /** Replays a recording through a network; what the program says. Idle time is skipped behind `settleUs`. */
  def replay(network: Path, recording: Path, result: Path, settleUs: Int = 4): String = {
    build
    run(
      s"$out/flyframe-cosim",
      "--network",
      network.toString,
      "--replay",
      recording.toString,
      "--out",
      result.toString,
      "--settle-us",
      settleUs.toString
    )
  }

  /** Random accesses of bus and host to the SyncManagers of one of the sets; what the program says. */
  def soak(set: EscParams, steps: Long, seed: Long): String = {
    soakProgram
    run(s"$out/flyframe-smsoak", "--preset", set.preset, "--steps", s"$steps", "--seed", s"$seed")
  }

  /** The program that simulates the smoke-alarm system. */
  lazy val alarmProgram: Path = {
    val program = out.resolve("flyframe-alarm")
    emit()
    make(program.toString, "COSIM_TRACE=0", "COSIM_OPT=-O3")
    program
  }

  /** `flyframe-fuzz` and `flyframe-smsoak` as fast as they get, for runs of many frames. */
  lazy val longRuns: Unit = {
    emit()
    for (program <- Seq("fuzz", "smsoak")) make(s"$out/flyframe-$program", "COSIM_TRACE=0", "COSIM_OPT=-O3")
  }
  lazy val soakProgram: Unit = {
    emit()
    make(s"$out/flyframe-smsoak", "COSIM_TRACE=0")
  }
}

package flyframe.e2e

import java.io.{BufferedReader, InputStreamReader}
import java.nio.charset.StandardCharsets.UTF_8
import java.nio.file.{Files, Path}
import java.util.concurrent.TimeUnit
import org.scalatest.Assertions._
import scala.jdk.CollectionConverters._
import scala.sys.process._
import scala.util.Try
import flyframe.server.ServerBench.eventually

/** A demonstration, but for the building: the program that `make` calls, driven as somebody at the terminal
  * does.
  *
  * @param program
  *   in `demo`
  * @param folder
  *   of its files
  */
final class DemoProcess(program: String, folder: Path, simulator: String, options: String*)
    extends AutoCloseable {
  Files.createDirectories(folder)
  Files.writeString(folder.resolve("classpath"), sys.props("java.class.path"))

  /** Where nohup has started the tests a hang-up would be ignored. */
  val process: java.lang.Process = new java.lang.ProcessBuilder(
    (Seq("env", "--default-signal=HUP,INT", "python3", s"demo/$program") ++ options ++
      Seq("--http-port", "0", "--simulator", simulator)).asJava
  ).redirectError(java.lang.ProcessBuilder.Redirect.INHERIT).start()
  private val out = new BufferedReader(new InputStreamReader(process.getInputStream))
  private val in  = process.getOutputStream

  /** What it says until the panel is ready. */
  val greeting: Seq[String] =
    Iterator.continually(out.readLine()).takeWhile(_ != null).takeWhile(!_.contains("times slower")).toSeq

  def write(line: String): Unit = write(s"$line\n".getBytes(UTF_8))
  def write(bytes: Array[Byte]): Unit = {
    in.write(bytes)
    in.flush()
  }

  /** All else that it says. */
  def rest(): String = Iterator.continually(out.readLine()).takeWhile(_ != null).mkString("\n")

  /** One that has ended may still wait for whoever has its exit code. */
  private def runs(pid: Long) =
    Try(Files.readString(Path.of("/proc", s"$pid", "stat"))).toOption.exists(!_.contains(") Z "))

  /** Ends it by a signal: its programs must end, too. */
  def endsBy(signal: String, exitCode: Int): Unit = {
    val programs = process.descendants.iterator.asScala.map(_.pid).toSeq
    assert(programs.size == 2, "server and simulator")
    assert(Seq("kill", s"-$signal", s"${process.pid}").! == 0)
    try {
      assert(process.waitFor(60, TimeUnit.SECONDS), signal)
      eventually(s"its programs end by SIG$signal", 60000)(!programs.exists(runs))
      assert(process.exitValue == exitCode, signal)
    } finally programs.filter(runs).foreach(pid => Seq("kill", "-KILL", s"$pid").!)
  }

  /** It ends its own programs. */
  def close(): Unit = {
    process.destroy()
    process.waitFor(60, TimeUnit.SECONDS)
  }
}

object DemoProcess {

  /** Signals that end a demonstration, and its exit code then. */
  val signals: Seq[(String, Int)] = Seq("HUP" -> 0, "TERM" -> 0, "INT" -> 0, "KILL" -> 137)

  /** It says in one sentence what is wrong, and ends. */
  def refuses(program: String, option: String, values: String*): Unit = for (value <- values) {
    var said = Vector.empty[String]
    val code = Seq("python3", s"demo/$program", option, value).!(ProcessLogger(line => said :+= line))
    assert(code == 2 && said.size == 1 && said.head.contains(option), s"$option $value: $code, $said")
  }
}

package flyframe.report

import java.io.File
import java.nio.file.{Files, Path, Paths}
import java.util.concurrent.{ExecutorService, Executors, TimeUnit}
import scala.concurrent.duration.Duration
import scala.concurrent.{Await, ExecutionContext, Future}
import scala.io.Source
import scala.util.Using

/** The report cannot be made; the message is one sentence for the user. */
final class ReportError(sentence: String) extends Exception(sentence)

/** Finds and runs the programs that measure. */
object Tools {
  private val venv         = "build/tools/venv/bin"
  private val limitMinutes = 30L
  private val searched =
    sys.env.getOrElse("PATH", "").split(File.pathSeparator).toSeq.filter(_.nonEmpty) :+ venv

  /** How many jobs run at the same time. */
  val atOnce: Int = Runtime.getRuntime.availableProcessors min 4

  private def find(name: String): Option[String] =
    searched
      .map(d => Paths.get(d, name))
      .find(f => Files.isExecutable(f) && !Files.isDirectory(f))
      .map(_.toString)

  /** The first of `names` that is installed; `purpose` completes "... is needed to". */
  def need(purpose: String, names: String*): String =
    names
      .flatMap(find)
      .headOption
      .getOrElse(
        throw new ReportError(
          s"${names.mkString(" or ")} is needed to $purpose but is neither on PATH nor in $venv."
        )
      )

  /** Runs a command from the repository root, its output into `log`; the result is that output. */
  def run(log: Path, command: Seq[String]): String = {
    val process = new ProcessBuilder(command: _*).redirectErrorStream(true).redirectOutput(log.toFile).start()
    process.getOutputStream.close()
    val name = Paths.get(command.head).getFileName
    try {
      if (!process.waitFor(limitMinutes, TimeUnit.MINUTES))
        throw new ReportError(s"$name took more than $limitMinutes minutes; its output so far is in $log.")
      if (process.exitValue != 0)
        throw new ReportError(s"$name failed with exit code ${process.exitValue}; its output is in $log.")
    } finally { process.descendants.forEach(d => { d.destroy(); () }); process.destroy() }
    Files.readString(log)
  }

  /** The standard output of a short command, to be parsed. */
  def output(command: Seq[String]): String = {
    val process = new ProcessBuilder(command: _*).redirectError(ProcessBuilder.Redirect.INHERIT).start()
    process.getOutputStream.close()
    val text = Using.resource(Source.fromInputStream(process.getInputStream, "UTF-8"))(_.mkString)
    if (process.waitFor() != 0)
      throw new ReportError(s"${Paths.get(command.head).getFileName} failed; its message is above.")
    text
  }

  /** The line of `tool version` that has the version number in it, without paths. */
  def version(command: String*): String = {
    val process = new ProcessBuilder(command: _*).redirectErrorStream(true).start()
    process.getOutputStream.close()
    val text = Using.resource(Source.fromInputStream(process.getInputStream, "UTF-8"))(_.mkString)
    process.waitFor()
    "\\d+\\.\\d+[\\w.+-]*".r.findFirstIn(text).getOrElse("of unknown version")
  }

  /** `work` on every item, as many at a time as there are processors; results in the order of `items`. */
  def parallel[A, B](items: Seq[A])(work: A => B): Seq[B] = {
    val pool: ExecutorService              = Executors.newFixedThreadPool(atOnce)
    implicit val context: ExecutionContext = ExecutionContext.fromExecutor(pool)
    try Await.result(Future.sequence(items.map(i => Future(work(i)))), Duration.Inf)
    finally pool.shutdownNow()
  }
}

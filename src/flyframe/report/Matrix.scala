package flyframe.report

import java.nio.file.{Files, Path, Paths}
import scala.util.control.NonFatal
import flyframe.{Documents, Emit}
import flyframe.params.EscParams

/** Elaborates every point of the parameter matrix, for `test/cosim/matrix.sh` to lint. */
object Matrix {

  /** FMMUs 0, 1, 3, 8, 16 and SyncManagers 0, 2, 4, 8, 16, each with the most and the least of the other
    * kind.
    */
  private val units: Seq[EscParams] =
    Seq((0, 2), (1, 4), (3, 2), (8, 8), (16, 16), (0, 16), (16, 0)).map { case (fmmus, syncManagers) =>
      EscParams(
        preset = s"f${fmmus}_s$syncManagers",
        ramKiB = 8,
        fmmus = fmmus,
        syncManagers = syncManagers,
        applicationLayer = 1
      )
    }

  /** All there is, in both ways to keep the configuration. */
  private val complete: Seq[EscParams] = Seq(
    EscParams(preset = "all_i2c", fmmus = 8, syncManagers = 8, sii = 1),
    EscParams(
      preset = "all_emulated",
      fmmus = 16,
      syncManagers = 16,
      sii = 2,
      dataBusWidth = 32,
      coreClockMhz = 125
    )
  ).map(
    _.copy(ramKiB = 8, fmmuBitwise = 1, applicationLayer = 1, watchdogs = 1, leds = 1, digitalOutputs = 4)
  )

  /** Smoke-alarm slaves: each pair of values of dataBusWidth 8, 16, 32, maxSubTelegrams 1, 4, 15 and
    * nodeIdWidth 4, 8, 16 is in one of nine points.
    */
  private def alarm: Seq[EscParams] =
    for ((width, i) <- Seq(8, 16, 32).zipWithIndex; (count, j) <- Seq(1, 4, 15).zipWithIndex) yield {
      val id = Seq(4, 8, 16)((i + j) % 3)
      EscParams(
        preset = s"alarm${width}_t${count}_i$id",
        dataBusWidth = width,
        maxSubTelegrams = count,
        nodeIdWidth = id,
        ramKiB = 1,
        alarm = 1
      )
    }

  /** The points, in the order they are elaborated. */
  val points: Seq[EscParams] = wire ++ units ++ complete ++ alarm

  private def wire: Seq[EscParams] =
    for {
      width <- Seq(8, 16, 32)
      ports <- Seq(1, 2, 4)
      count <- Seq(1, 15, 128)
      id    <- Seq(8, 16)
    } yield EscParams(
      preset = s"m${width}_p${ports}_t${count}_i$id",
      dataBusWidth = width,
      ports = ports,
      maxSubTelegrams = count,
      nodeIdWidth = id,
      ramKiB = 1
    )

  /** Writes the files of one point, or says why it has none; a failed point leaves no file of an earlier run
    * behind.
    */
  private def elaborate(p: EscParams, out: Path): Option[String] = {
    val files = Seq("v", "json").map(e => out.resolve(s"${p.preset}.$e"))
    files.foreach(f => Files.deleteIfExists(f))
    EscParams.problems(p).headOption.orElse {
      try {
        files.zip(Seq(Emit.verilog(p), Documents.json(p))).foreach { case (f, text) =>
          Files.writeString(f, text)
        }
        None
      } catch { case NonFatal(e) => Some(e.toString) }
    }
  }

  /** Argument: the directory to write to, default build/matrix. Exit code 1 if a point could not be
    * elaborated.
    */
  def main(args: Array[String]): Unit = {
    val out = Files.createDirectories(Paths.get(args.headOption.getOrElse("build/matrix")))
    val failed = points.zipWithIndex.count { case (p, i) =>
      println(s"[${i + 1}/${points.size}] ${p.preset}")
      val problem = elaborate(p, out)
      problem.foreach(reason => Console.err.println(s"${p.preset}: $reason"))
      problem.nonEmpty
    }
    println(s"${points.size - failed} elaborated, $failed failed")
    if (failed > 0) sys.exit(1)
  }
}

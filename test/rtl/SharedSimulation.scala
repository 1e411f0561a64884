package flyframe

import java.nio.file.{Files, Path, Paths}
import scala.jdk.CollectionConverters._
import scala.util.Using
import chisel3._
import chiseltest._
import chiseltest.internal.CachingAnnotation
import chiseltest.simulator.VerilatorFlags
import firrtl2.AnnotationSeq
import firrtl2.options.TargetDirAnnotation
import org.scalatest.flatspec.AnyFlatSpec
import scala.util.Try

/** How test benches are simulated: by Verilator, whose compilation is kept in `test_run_dir` until the
  * circuit changes.
  */
object Simulation {

  /** @param suite
    *   the suite that simulates
    * @param title
    *   of the simulation, unlike all others of the suite
    */
  def annotations(suite: Any, title: String): AnnotationSeq = {
    val name   = suite.getClass.getSimpleName.stripSuffix("$")
    val folder = Paths.get("test_run_dir", name, title.replaceAll("[^A-Za-z0-9]+", "-"))
    forgetUnfinished(folder)
    Seq(DirectSimulation, oneFile, CachingAnnotation, TargetDirAnnotation(folder.toString))
  }

  /** The C++ of a model in one file: of many, each would take longer to read Verilator's headers than to
    * compile what is its own.
    */
  private val oneFile = VerilatorFlags(Seq("--output-split", "0"))

  /** A compilation that was broken off leaves the hash of the one before it, which would stand for a program
    * that is gone, or for another one: the hash is written last, so a right one is at least as new as all
    * there is.
    */
  private def forgetUnfinished(folder: Path): Unit = {
    val hash = folder.resolve("caching.hash")
    if (Files.exists(hash)) {
      val files = Using.resource(Files.walk(folder.resolve("verilated"), 1))(_.iterator.asScala.toVector)
      // Each simulation runs a copy of the program, with a number behind its name.
      val built = files.filter(f => Files.isRegularFile(f) && !f.toString.matches(".*_\\d+"))
      val times = built.map(Files.getLastModifiedTime(_))
      if (times.isEmpty || times.exists(_.compareTo(Files.getLastModifiedTime(hash)) > 0)) Files.delete(hash)
    }
  }
}

/** Several tests on one Verilator simulation, which takes seconds to build. */
trait SharedSimulation extends ChiselScalatestTester { this: AnyFlatSpec =>
  private var simulations = 0

  /** Every check starts with a reset and reports its own result. */
  protected def together[M <: Module](title: String, module: => M)(checks: (String, M => Any)*): Unit = {
    simulations += 1
    val folder = s"$simulations $title"
    lazy val results: Map[String, Try[Unit]] = {
      var found = Map.empty[String, Try[Unit]]
      test(module).withAnnotations(Simulation.annotations(this, folder)) { dut =>
        dut.clock.setTimeout(0)
        for ((name, check) <- checks) {
          dut.reset.poke(true.B)
          dut.clock.step(2)
          dut.reset.poke(false.B)
          found += name -> Try { check(dut); () }
        }
      }
      found
    }
    for ((name, _) <- checks) s"$name [$title]" should "hold" in results(name).get
  }
}

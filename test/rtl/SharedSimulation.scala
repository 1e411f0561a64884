package flyframe

import chisel3._
import chiseltest._
import chiseltest.simulator.VerilatorBackendAnnotation
import org.scalatest.flatspec.AnyFlatSpec
import scala.util.Try

/** Several tests on one Verilator simulation, which takes ten seconds and more to build. */
trait SharedSimulation extends ChiselScalatestTester { this: AnyFlatSpec =>

  /** Every check starts with a reset and reports its own result. */
  protected def together[M <: Module](title: String, module: => M)(checks: (String, M => Any)*): Unit = {
    lazy val results: Map[String, Try[Unit]] = {
      var found = Map.empty[String, Try[Unit]]
      test(module).withAnnotations(Seq(VerilatorBackendAnnotation)) { dut =>
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

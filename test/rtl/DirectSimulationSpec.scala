package flyframe

import chisel3._
import chiseltest._
import chiseltest.simulator.SimulatorAnnotation
import org.scalatest.flatspec.AnyFlatSpec
import scala.util.Random

/** Ports of every kind of width, through wires and through registers. */
private class PortsOfWidths extends Module {
  private def way[T <: Data](t: T) = {
    val in   = IO(Input(t)).suggestName(s"in_${t.getWidth}")
    val wire = IO(Output(t)).suggestName(s"wire_${t.getWidth}")
    val kept = IO(Output(t)).suggestName(s"kept_${t.getWidth}")
    wire := in
    kept := RegNext(in)
    (in, wire, kept)
  }
  val bits    = Seq(1, 8, 33, 63, 64, 65, 128, 200).map(n => way(UInt(n.W)))
  val numbers = Seq(2, 7, 66).map(n => way(SInt(n.W)))
  val wrong   = IO(Input(Bool()))
  assert(!wrong, "what must not be")
}

class DirectSimulationSpec extends AnyFlatSpec with ChiselScalatestTester {

  /** What all outputs read, while random values come, before and after each edge. */
  private def seen(backend: SimulatorAnnotation): Seq[BigInt] = {
    var all = Vector.empty[BigInt]
    test(new PortsOfWidths).withAnnotations(Seq(backend)) { dut =>
      val random = new Random(1)
      dut.wrong.poke(false)
      def read() = {
        for ((_, wire, kept) <- dut.bits) all ++= Seq(wire.peekInt(), kept.peekInt())
        for ((_, wire, kept) <- dut.numbers) all ++= Seq(wire.peekInt(), kept.peekInt())
      }
      for (_ <- 1 to 50) {
        for ((in, _, _) <- dut.bits) in.poke(BigInt(in.getWidth, random))
        for ((in, _, _) <- dut.numbers)
          in.poke(BigInt(in.getWidth, random) - (BigInt(1) << in.getWidth - 1))
        if (random.nextBoolean()) read() // else no call between poke and edge
        dut.clock.step(random.between(1, 4))
        read()
      }
    }
    all
  }

  "A simulation called directly" should "show what one shows that chiseltest calls" in {
    val found = seen(DirectSimulation)
    assert(found == seen(VerilatorBackendAnnotation))
    assert(found.exists(_ < 0) && found.exists(_.bitLength == 200))
  }

  it should "end with an assertion that fails" in {
    val thrown = intercept[ChiselAssertionError](
      test(new PortsOfWidths).withAnnotations(Seq(DirectSimulation)) { dut =>
        dut.wrong.poke(true)
        dut.clock.step(3)
      }
    )
    assert(thrown.getMessage.contains("assertion"))
  }
}

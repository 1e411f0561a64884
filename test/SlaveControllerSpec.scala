package flyframe

import chiseltest._
import chiseltest.simulator.VerilatorBackendAnnotation
import org.scalatest.flatspec.AnyFlatSpec
import Frames._
import flyframe.params.{EscParams, Presets}

class SlaveControllerSpec extends AnyFlatSpec with ChiselScalatestTester {
  private val p = Presets.named("cyclone4-min").get.params

  private def bench(p: EscParams)(body: RtlBench => Unit): Unit =
    test(new ControllerUnderTest(p)).withAnnotations(Seq(VerilatorBackendAnnotation))(dut => body(new RtlBench(dut, p)))

  "FP-27" should "a broadcast read counts one and returns the type" in bench(p) { b =>
    val sent = b.frame(0, ethercat(datagram(7, 0, 0, Seq.fill(12)(0))))
    println(sent)
    assert(sent.size == 1)
    assert(fcsGood(sent.head.bytes))
    val d = sent.head.bytes.drop(16)
    println(d.map(x => f"$x%02x").mkString(" "))
    assert(d.slice(10, 12) == Seq(0xf1, 0x00))
    assert(d.slice(12, 14) == Seq(1, 0))
    println(b.hostRead(0x30c), b.hostRead(0x300), b.hostRead(0x110), b.hostRead(0x111))
  }
}

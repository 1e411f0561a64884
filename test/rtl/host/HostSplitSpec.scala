package flyframe.host

import chisel3._
import chiseltest._
import flyframe.memory.HostPort
import org.scalatest.flatspec.AnyFlatSpec

private class SplitUnderTest(lanes: Int) extends Module {
  val host          = IO(new HostPort(lanes))
  val lower         = IO(Flipped(new HostPort(lanes)))
  val upper         = IO(Flipped(new HostPort(lanes)))
  private val split = Module(new HostSplit(lanes))
  split.host <> host
  lower <> split.lower
  upper <> split.upper
}

class HostSplitSpec extends AnyFlatSpec with ChiselScalatestTester {
  for (lanes <- Seq(1, 4))
    s"GW-01: two address spaces at a port of ${8 * lanes} bits" should "each see its own accesses" in
      test(new SplitUnderTest(lanes)) { dut =>
        val (mine, others) = (0x5aL, 0xa5L)
        for (
          (address, port, other) <- Seq(
            (0x0000, dut.lower, dut.upper),
            (0x7fff, dut.lower, dut.upper),
            (0x8000, dut.upper, dut.lower),
            (0xfffe, dut.upper, dut.lower)
          );
          write <- Seq(false, true); ack <- Seq(false, true)
        ) {
          dut.host.addr.poke(address)
          dut.host.write.poke(write)
          dut.host.wdata.poke(0x77)
          dut.host.be.poke(1)
          port.rdata.poke(mine)
          other.rdata.poke(others)
          port.ack.poke(ack)
          other.ack.poke(!ack)
          dut.host.req.poke(false)
          port.req.expect(false)
          dut.host.req.poke(true)
          port.req.expect(true)
          other.req.expect(false)
          port.addr.expect(address & 0x7fff)
          port.write.expect(write)
          port.wdata.expect(0x77)
          port.be.expect(1)
          dut.host.ack.expect(ack)
          dut.host.rdata.expect(mine)
        }
      }
}

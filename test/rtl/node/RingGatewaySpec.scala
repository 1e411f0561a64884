package flyframe.node

import chisel3._
import chiseltest._
import flyframe.{RingGateway, Simulation}
import flyframe.memory.HostPort
import flyframe.params.{EscParams, Presets}
import flyframe.registers.{NodeRegisters, RingRegisters}
import org.scalatest.flatspec.AnyFlatSpec

/** A gateway whose optical ports lead to each other: a ring of one node. Nothing is at its PHYs. */
private class GatewayUnderTest(p: EscParams) extends Module {
  private val gateway = withReset(reset.asAsyncReset)(Module(RingGateway(p)))
  val host            = IO(new HostPort(p.lanes))
  val irq             = IO(Output(Bool()))
  val ringIrq         = IO(Output(Bool()))
  host <> gateway.hostPins.asInstanceOf[HostPort]
  irq     := gateway.irq.get
  ringIrq := gateway.ring_irq
  gateway.phys.foreach(_ := DontCare)
  gateway.phy_clk_ref         := false.B
  gateway.pdi_operational.get := true.B
  for ((from, to) <- Seq(gateway.optical_1 -> gateway.optical_2, gateway.optical_2 -> gateway.optical_1)) {
    to.rx     := from.tx
    to.signal := true.B
  }
}

class RingGatewaySpec extends AnyFlatSpec with ChiselScalatestTester {
  private val Space = EscParams.RingSpace
  private val p     = Presets.gateway.copy(sii = 0, ramKiB = 1, fmmus = 1, syncManagers = 2)

  private class Host(dut: GatewayUnderTest) {
    private def access(address: Int, write: Boolean, data: Int): Int = {
      dut.host.addr.poke(address)
      dut.host.write.poke(write)
      dut.host.wdata.poke(data)
      dut.host.be.poke(1)
      dut.host.req.poke(true)
      var cycles = 0
      while (!dut.host.ack.peekBoolean()) {
        dut.clock.step()
        cycles += 1
        assert(cycles < 5000, f"no answer at 0x$address%04x")
      }
      val read = dut.host.rdata.peekInt().toInt
      dut.clock.step()
      dut.host.req.poke(false)
      dut.clock.step()
      read
    }
    def read(address: Int): Int              = access(address, write = false, 0)
    def write(address: Int, data: Int): Unit = access(address, write = true, data)
  }

  "GW-01, GWB-05: a gateway's host" should "reach slave and node, each in its half of the address space" in
    test(new GatewayUnderTest(p)).withAnnotations(Simulation.annotations(this, "halves")) { dut =>
      dut.clock.setTimeout(0)
      val host = new Host(dut)
      assert(host.read(0) == p.escType && host.read(Space) == EscParams.NodeType)
      // The same addresses in both.
      host.write(Space + RingRegisters.Address, 0x5a)
      assert(host.read(Space + RingRegisters.Address) == 0x5a && host.read(RingRegisters.Address) == 0)
      for (at <- Seq(0x0f80, 0x1000)) {
        host.write(at, 0x33)
        assert(host.read(at) == 0x33 && host.read(Space + at) == 0)
        host.write(Space + at, 0x44)
        assert(host.read(at) == 0x33)
      }
      assert(host.read(0x7fff) == 0 && host.read(0xffff) == 0)
    }

  it should "be interrupted by each at a pin of its own" in
    test(new GatewayUnderTest(p)).withAnnotations(Simulation.annotations(this, "interrupts")) { dut =>
      dut.clock.setTimeout(0)
      val host = new Host(dut)
      host.write(Space + RingRegisters.Control, 1 << RingRegisters.PortsOff) // a wait keeps its time (FB-04)
      host.write(Space + RingRegisters.UpMs, 0)
      host.write(Space + RingRegisters.Control, 0)
      host.write(Space + NodeRegisters.Mask, 1 << RingRegisters.PortEvent)
      dut.irq.expect(false)
      var cycles = 0
      while (!dut.ringIrq.peekBoolean()) {
        dut.clock.step(100)
        cycles += 100
        assert(cycles < 300000, "no port came up")
      }
      dut.irq.expect(false)
      dut.clock.step(100000)
      val up = host.read(Space + RingRegisters.Ports)
      assert((up & 0x44) == 0x44, s"ports 0x${up.toHexString}")
      host.write(Space + NodeRegisters.Events, 0xff)
      dut.clock.step(2)
      dut.ringIrq.expect(false)
    }
}

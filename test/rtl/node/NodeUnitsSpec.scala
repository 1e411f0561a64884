package flyframe.node

import chiseltest._
import flyframe.fibre.RingHost
import flyframe.params.Presets
import flyframe.registers.{NodeRegisters, RingRegisters}
import org.scalatest.flatspec.AnyFlatSpec

class NodeUnitsSpec extends AnyFlatSpec with ChiselScalatestTester {
  "A quantum" should "last as long as the prescaler says, and not come from an impossible setting" in
    test(new TimeQuanta) { dut =>
      dut.clock.setTimeout(0)
      def quanta(cycles: Int) = (1 to cycles).count { _ =>
        val is = dut.quantum.peekBoolean()
        dut.clock.step()
        is
      }
      assert(quanta(50) == 0)
      for (prescaler <- Seq(0, 1, 6, 40)) {
        dut.possible.poke(true)
        dut.prescaler.poke(prescaler)
        dut.clock.step(2050)
        assert(quanta(840 * (prescaler + 1)) == 840, prescaler)
      }
    }

  for (mhz <- Seq(50, 100))
    s"The time at $mhz MHz" should "count microseconds" in test(new NodeTime(mhz)) { dut =>
      for (cycle <- 0 until 5 * mhz) {
        dut.timer.expect(cycle / mhz)
        dut.us.expect(cycle % mhz == mhz - 1)
        dut.clock.step()
      }
    }

  for (lanes <- Seq(1, 2, 4))
    s"A host with ${8 * lanes} bits" should "reach each byte" in test(new WideHost(lanes)) { dut =>
      dut.wide.rdata.poke(0x44332211L)
      for (first <- 0 until 8 by lanes; be <- 1 until 1 << lanes) {
        val at = first % 4
        dut.narrow.addr.poke(0x100 + first)
        dut.narrow.be.poke(be)
        dut.narrow.wdata.poke(0xa5c3L & (1L << 8 * lanes) - 1)
        dut.wide.addr.expect(0x100 + first)
        dut.wide.be.expect(be << at)
        assert(
          (dut.wide.wdata
            .peek()
            .litValue >> 8 * at & (1L << 8 * lanes) - 1) == (0xa5c3L & (1L << 8 * lanes) - 1)
        )
        dut.narrow.rdata.expect(0x44332211L >> 8 * at & (1L << 8 * lanes) - 1)
      }
    }

  "NODE-03: the address of a node" should "have as many bits as it was built with" in
    test(new RingHost(addressBits = 4)) { dut =>
      dut.host.addr.poke(RingRegisters.Address)
      dut.host.wdata.poke(0x7f)
      dut.host.be.poke(1)
      dut.host.write.poke(true)
      dut.host.req.poke(true)
      dut.clock.step(2)
      dut.host.write.poke(false)
      assert((dut.host.rdata.peekInt() & 0xff) == 0x0f)
      dut.control.address.expect(0x0f)
    }

  "FB-10: events of a node" should "stay until they are cleared, and interrupt as the mask says" in
    test(new NodeHost(Presets.ring.copy(canPorts = 2, dataBusWidth = 16))) { dut =>
      def access(address: Int, be: Int, write: Option[BigInt] = None): BigInt = {
        dut.host.addr.poke(address)
        dut.host.be.poke(be)
        dut.host.write.poke(write.isDefined)
        dut.host.wdata.poke(write.getOrElse(BigInt(0)))
        dut.host.req.poke(true)
        dut.host.ack.expect(false)
        dut.clock.step()
        dut.host.ack.expect(true)
        val answer = dut.host.rdata.peekInt()
        dut.clock.step()
        dut.host.req.poke(false)
        dut.clock.step()
        answer
      }
      def events = access(NodeRegisters.Events, 15)
      val pulses = dut.can.zip(NodeRegisters.CanEventBits).flatMap { case (e, from) =>
        Seq(e.received, e.slotDone, e.state, e.busError, e.overrun).zipWithIndex.map { case (s, i) =>
          s -> (from + i)
        }
      }
      assert(events == 0)
      for ((pulse, bit) <- pulses) {
        pulse.poke(true)
        dut.clock.step()
        pulse.poke(false)
        assert(events == 1 << bit)
        dut.irq.expect(false)
        access(NodeRegisters.Events, 15, Some(BigInt(1) << bit + 16))
        dut.irq.expect(true)
        assert(events == (BigInt(1) << bit + 16 | 1 << bit))
        access(NodeRegisters.Events, 15 & ~(1 << bit / 8), Some(BigInt(1) << bit + 16 | 1 << bit))
        dut.irq.expect(true)
        access(NodeRegisters.Events, 3, Some(BigInt(1) << bit))
        dut.irq.expect(false)
        access(NodeRegisters.Mask, 12, Some(0))
      }
      // One that happens while it is cleared.
      dut.host.addr.poke(NodeRegisters.Events)
      dut.host.be.poke(3)
      dut.host.write.poke(true)
      dut.host.wdata.poke(0xffff)
      dut.host.req.poke(true)
      dut.clock.step()
      pulses.head._1.poke(true)
      dut.clock.step()
      pulses.head._1.poke(false)
      dut.host.req.poke(false)
      dut.clock.step()
      assert(events == 1)
      // The time of a host that needs two reads for it.
      dut.time.poke(0x1234ffffL)
      assert((access(NodeRegisters.Time, 3) & 0xffff) == 0xffff)
      dut.time.poke(0x12350000L)
      events
      assert((access(NodeRegisters.Time, 12) >> 16) == 0x1234)
    }
}

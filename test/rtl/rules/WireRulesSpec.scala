package flyframe.rules

import chisel3._
import chiseltest._
import org.scalatest.flatspec.AnyFlatSpec
import flyframe.model._
import flyframe.params.{EscParams, Presets}
import flyframe.protocol.Command.{Apwr, Brd, Bwr}
import flyframe.{ControllerUnderTest, RtlBench, SharedSimulation}

/** Rules that take more than one frame at a time, or a pin the other rule tests do not see. */
class WireRulesSpec extends AnyFlatSpec with SharedSimulation {
  private val small = Presets.named("cyclone4-min").get.params
  private val sets = Seq(
    small,
    small.copy(preset = "wide-25", ports = 4, coreClockMhz = 25, dataBusWidth = 32)
  )

  for (p <- sets)
    together(p.preset, new ControllerUnderTest(p))(
      "GEN-03: frames in both directions at the same time both come out right" -> (bothDirections(_, p)),
      "PHY-01: phy_reset_n is low exactly while reset is high"                 -> phyReset
    )

  private val alarm = small.copy(preset = "alarm", alarm = 1)
  together(alarm.preset, new ControllerUnderTest(alarm))(
    "ALARM-07: a message that comes while the host reads whether there is one is not lost" ->
      (messageWhileRead(_, alarm))
  )

  private val random                   = new scala.util.Random(3)
  private def bytes(count: Int)        = Seq.fill(count)(random.nextInt(256))
  private def frame(ds: Seq[Datagram]) = WireFrame.withFcs(EtherCatFrame(ds))

  private def bothDirections(dut: ControllerUnderTest, p: EscParams): Unit = {
    val bench = new RtlBench(dut, p)
    val model = new EscModel(p)
    for (y <- 2 until p.ports) {
      bench.setLink(y, up = false)
      model.setLink(y, up = false)
    }
    def forward(size: Int) = frame(Seq(Datagram(Brd, 0, 0, Seq(0)), Datagram(Apwr, 0, 0x0f80, bytes(size))))
    // The frame on its way back holds a command too, which must not be carried out again.
    def backward(size: Int) = frame(Seq(Datagram(Apwr, 0, 0x0f80, bytes(size))))

    // `delay`: slots the frame at port 1 begins later than that at port 0.
    for ((delay, there, back) <- Seq((0, 20, 20), (1, 100, 30), (37, 30, 100), (-90, 90, 128), (-3, 1, 90))) {
      val (out, in) = (forward(there), backward(back))
      val expected  = Set(model.receive(0, out).get, model.receive(1, in).get)
      val found     = bench.sendTogether((0, 0 max -delay, out), (1, 0 max delay, in))
      assert(found.size == 2 && found.toSet == expected, s"delay $delay")
      for (address <- 0x0f80 until 0x0f80 + there)
        assert(bench.hostRead(address) == model.hostRead(address))
    }
    assert((0x0300 until 0x0310).forall(bench.hostRead(_) == 0), "no error was counted")
  }

  private def messageWhileRead(dut: ControllerUnderTest, p: EscParams): Unit = {
    import flyframe.registers.AlarmRegisters.{Broadcast, Messages}
    val bench = new RtlBench(dut, p)
    val lane  = Messages % p.lanes
    bench.hostRead(Messages)
    var early, late = 0
    for (offset <- 0 until 100) {
      val message = frame(Seq(Datagram(Bwr, 0, Broadcast, bytes(8))))
      val begin   = bench.now + message.symbols.size * p.cyclesPerNibble + offset
      var first   = Option.empty[BigInt]
      bench.eachCycle = Some(now =>
        if (now == begin) {
          dut.host.addr.poke(Messages - lane)
          dut.host.write.poke(false)
          dut.host.be.poke(1 << lane)
          dut.host.req.poke(true)
        } else if (now > begin && first.isEmpty && dut.host.ack.peekBoolean()) {
          first = Some(dut.host.rdata.peekInt() >> 8 * lane & 0xff)
          dut.host.req.poke(false)
        }
      )
      bench.send(0, message)
      bench.eachCycle = None
      val second = bench.hostRead(Messages)
      assert((first.get != 0) != (second != 0), s"read $offset cycles behind the frame: $first, then $second")
      if (first.get != 0) late += 1 else early += 1
    }
    assert(early > 5 && late > 5, s"$early reads came before the message, $late behind it")
  }

  private def phyReset(dut: ControllerUnderTest): Unit = {
    def released = dut.phyResetN.peekBoolean()
    for (_ <- 0 until 2) { // the second time out of operation
      dut.reset.poke(true.B)
      for (_ <- 0 until 10) {
        assert(!released)
        dut.clock.step()
      }
      dut.reset.poke(false.B)
      for (_ <- 0 until 10) {
        assert(released)
        dut.clock.step()
      }
    }
  }
}

package flyframe.node

import chiseltest._
import flyframe.{RingNode, Simulation, TestSets, Tier}
import flyframe.can._
import flyframe.fibre._
import flyframe.params.{EscParams, Presets}
import flyframe.registers.{CanRegisters, NodeRegisters, RingRegisters}
import org.scalatest.flatspec.AnyFlatSpec

/** A whole node in RTL on a ring with models of two others, at 500 kbit/s. */
class RingNodeSpec extends AnyFlatSpec with ChiselScalatestTester {
  private val preset = Presets.ring
  private val f      = CanRegisters.PortStarts.head
  private val Slot   = CanRegisters.SlotStarts.head
  private val Frame  = CanRegisters.FrameBytes

  /** The node and two models. It takes all frames, by its last filter. */
  private class Ring(dut: RingNode, p: EscParams) {

    /** In kbit/s: that of light that is decided each 2 us is slow (FR-04). */
    val rate = if (p.demodulator == 0) 500 else 100

    // As FR-38 has it.
    private val timed =
      Rate(s"$rate kbit/s", p.coreClockMhz * 40 / rate, BitSetting(tseg1 = 21, tseg2 = 3, sjw = 3))
    val rtl            = new RtlRingNode(dut, p.dataBusWidth / 8)
    private val models = Seq.fill(2)(new RingPortsModel(p.fibre))
    private val cans   = Seq.fill(2)(new CanPortModel(p.can, isTolerant = false))
    private val period = 1000000L / p.coreClockMhz
    val bench =
      new RingBench(p.fibre, (rtl +: models).toIndexedSeq, Seq.fill(3)(40000L), Seq.fill(3)(period))
    val hosts = cans.map(new LowerTester(_, timed))
    rtl.bench = bench
    for ((can, n) <- cans.zipWithIndex) {
      bench.drives(n + 1) = () => can.driven
      bench.hears(n + 1) = level => can.step(level)
      models(n).write(RingRegisters.Address, n + 3)
      models(n).write(RingRegisters.UpMs, 0)
      models(n).setBit(timed.setting.length, timed.prescaler)
    }
    val timing =
      Seq(
        timed.prescaler - 1,
        0,
        timed.setting.tseg1 - 1,
        timed.setting.tseg2 - 1 | timed.setting.sjw - 1 << 4
      )
    rtl.write(RingRegisters.Address, 2)
    rtl.write(RingRegisters.UpMs, 0)
    rtl.write(RingRegisters.Control, 1 << RingRegisters.Home)
    rtl.write(f + CanRegisters.Timing, timing)
    rtl.write(
      CanRegisters.FilterStarts.head + (p.filters - 1) * CanRegisters.FilterBytes,
      Seq(0, 0, 0, 0x20, 0, 0, 0, 0)
    )
    rtl.write(f + CanRegisters.Control, 1)
    hosts.foreach(_.start())

    def up(node: Int, port: Int): Boolean = bench.isUp(node, port)
    def state: Int                        = rtl.read(RingRegisters.State)
    def events: Long                      = rtl.word(NodeRegisters.Events) & 0xffff
    def clearEvents(): Unit               = rtl.write(NodeRegisters.Events, Seq(0xff, 0xff))

    def send(slot: Int, frame: CanFrame): Unit = {
      rtl.write(Slot + Frame * slot, frame.bytes())
      rtl.write(f + CanRegisters.Requests, Seq(1 << slot))
    }
    def received(): Seq[CanFrame] = Seq.fill(rtl.read(f + CanRegisters.RxLevel)) {
      val bytes = (0 until Frame by 4).flatMap { i =>
        val word = rtl.word(f + CanRegisters.RxFrame + i)
        (0 to 3).map(b => (word >> 8 * b & 0xff).toInt)
      }
      rtl.write(f + CanRegisters.RxRelease, 1)
      CanFrame.of(bytes)
    }
    def settle(us: Int = 700): Unit = bench.runUs(us * 500.0 / rate)
  }

  /** @param width
    *   bits of the host's words
    */
  private def onRing(width: Int, canPorts: Int = 1)(body: Ring => Unit): Unit =
    onRing(preset.copy(preset = s"node of $width bits", dataBusWidth = width, canPorts = canPorts))(body)

  private def onRing(p: EscParams)(body: Ring => Unit): Unit =
    test(new RingNode(p)).withAnnotations(Simulation.annotations(this, p.preset))(dut =>
      body(new Ring(dut, p))
    )

  private val ours = CanFrame(0x123, extended = false, remote = false, 2, Seq(0xde, 0xad))
  private val theirs =
    Seq(0x10503fe7, 0x00000040).map(CanFrame(_, extended = true, remote = false, 3, Seq(1, 2, 3)))

  /** All three send at once. */
  private def exchange(r: Ring, us: Int): Unit = {
    r.send(3, ours)
    for ((host, frame) <- r.hosts.zip(theirs)) host.request(frame)
    r.settle(us)
    assert(r.rtl.word(f + CanRegisters.Sent) == 8)
    r.rtl.write(f + CanRegisters.Sent, Seq(0xff, 0xff))
    assert(r.hosts.map(_.sent) == Seq(1, 1))
    assert(r.received().toSet == theirs.toSet)
    for ((host, other) <- r.hosts.zip(theirs.reverse)) {
      assert(host.received().toSet == Set(ours, other))
      host.clearSent(1)
    }
  }

  /** The second port hears itself only. */
  private def loopBack(r: Ring): Unit = {
    val t = CanRegisters.PortStarts(1)
    r.rtl.write(t + CanRegisters.Timing, r.timing)
    r.rtl.write(CanRegisters.FilterStarts(1), Seq(0, 0, 0, 0x20, 0, 0, 0, 0))
    r.rtl.write(t + CanRegisters.Control, 1 | CanCases.LoopBack)
    r.rtl.write(CanRegisters.SlotStarts(1), ours.bytes())
    r.rtl.write(t + CanRegisters.Requests, 1)
    r.settle(250)
    assert(r.rtl.word(t + CanRegisters.Sent) == 1 && r.rtl.read(t + CanRegisters.RxLevel) == 1)
  }

  "NODE-01, NODE-04, FR-31: a node" should "send and receive on a ring, whole and broken beside it" in
    onRing(width = 8) { r =>
      assert(r.rtl.word(NodeRegisters.Identity) == (0x10000L | preset.escType))
      assert((r.state & 8) != 0, "alone at first")
      r.bench.runUs(2200)
      assert(r.rtl.read(RingRegisters.Ports) == 0x55, "both ports up")
      assert((r.state & 7) == 6, "guard, as it is home")
      assert((r.events & 0x60) == 0x60 && !r.rtl.interrupt)
      r.clearEvents()
      r.rtl.write(NodeRegisters.Mask, Seq(0x23, 0))
      assert(r.rtl.word(NodeRegisters.Events) == 0x230000L)

      def round(us: Int = 700): Unit = {
        exchange(r, us)
        assert((r.events & 3) == 3 && r.rtl.interrupt, "received, and slot done")
        r.clearEvents()
        assert(!r.rtl.interrupt)
      }
      round()
      assert(r.rtl.word(f + CanRegisters.ErrorCounters) == 0)
      assert(r.rtl.word(f + CanRegisters.Counters) == 0)

      // Behind it: its port 2 is lost. The guard was there, so that nothing needs to be healed.
      r.bench.cut(0)
      r.settle(20)
      assert(r.rtl.read(RingRegisters.Losses2) == 1 && r.rtl.read(RingRegisters.Losses1) == 0)
      assert((r.state & 7) == 2 && r.events == 0x60 && r.rtl.interrupt)
      r.clearEvents()
      round()

      // It is mended, and broken again between the models: the guard closes within the next frame.
      r.bench.cut(0, isCut = false)
      r.bench.runUs(2200)
      assert((r.state & 7) == 6)
      r.bench.cut(1)
      r.settle(20)
      r.clearEvents()
      round(us = 1200) // a frame is repeated
      assert((r.state & 7) == 1 && r.rtl.read(RingRegisters.Closings) == 1)
    }

  "CAN-45: the time of a node" should "be that of its frames" in onRing(width = 32, canPorts = 2) { r =>
    r.bench.runUs(2200)
    r.hosts.head.request(theirs.head)
    r.settle(400)
    val now   = r.rtl.word(NodeRegisters.Time)
    val stamp = r.rtl.word(f + CanRegisters.RxFrame + 4) >> 16
    assert(math.abs(now - r.bench.now / 1000000) <= 1)
    assert(now - stamp > 250 && now - stamp <= 400)

    // What the other port does is told apart from the first one's.
    r.clearEvents()
    loopBack(r)
    assert(r.rtl.word(f + CanRegisters.Sent) == 0 && r.rtl.read(f + CanRegisters.RxLevel) == 1)
    assert(r.events == 0x700, "state, received and slot done, of the second port")
  }

  private val tier =
    Tier("Nodes of a fibre ring in all parameter sets", "sets", test = 1, soak = TestSets.rings.size.toLong)

  "FR-31, CAN-40, CAN-44: a node of each parameter set" should "send and receive on a ring" in
    tier.run("bus mode", tier.size) {
      // The hosts' interfaces and the plant's network have suites of their own.
      for (p <- TestSets.rings.take(tier.size.toInt))
        onRing(p.copy(hostInterface = 0, plant = 0, rmiiPorts = 0)) { r =>
          withClue(s"${p.preset}: ") {
            r.bench.runUs(2200)
            assert(r.rtl.read(RingRegisters.Ports) == 0x55, "both ports up")
            for (_ <- 1 to 3) exchange(r, us = 700)
            if (p.canPorts == 2) loopBack(r)
          }
        }
    }
}

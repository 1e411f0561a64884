package flyframe.node

import flyframe.can._
import flyframe.can.model.ModelBus
import flyframe.fibre.{RingBench, RingPortsModel}
import flyframe.params.{CanParams, FibreParams}
import flyframe.registers.{CanRegisters, RingRegisters}
import flyframe.transport.BusFrame
import org.scalatest.flatspec.AnyFlatSpec

/** The driver in C at the registers of a node, in golden models, with another controller on its bus. */
class CanDriverSpec extends AnyFlatSpec {
  private val rate = Rate("500 kbit/s", 4, BitSetting(tseg1 = 21, tseg2 = 3, sjw = 3))

  private class Bench {
    private var port  = new CanPortModel(CanParams())
    private var ring  = new RingPortsModel(FibreParams(coreClockMhz = 50))
    private val other = new CanPortModel(CanParams())
    val host          = new LowerTester(other, rate)

    // The node may be replaced by a fresh one.
    private val node = new CanUnderTest {
      def cycle: Long                                = port.cycle
      def driven: Boolean                            = port.driven
      def step(heard: Boolean): Unit                 = port.step(heard)
      def write(address: Int, bytes: Seq[Int]): Unit = port.write(address, bytes)
      def read(address: Int, count: Int): Seq[Int]   = port.read(address, count)
    }
    private val bus                  = new ModelBus(Seq(node, other), Seq(1, 1), (_, _, level) => level)
    private def isRing(address: Int) = address < CanRegisters.PortStarts.head
    val driver = new DriverInC(
      (address, count) =>
        if (isRing(address)) (0 until count).map(i => ring.read(address + i)) else port.read(address, count),
      (address, bytes) =>
        if (isRing(address)) for ((b, i) <- bytes.zipWithIndex) ring.write(address + i, b)
        else port.write(address, bytes)
    )
    def reset(): Unit = {
      port = new CanPortModel(CanParams())
      ring = new RingPortsModel(FibreParams(coreClockMhz = 50))
    }
    def run(bits: Int): Unit = bus.run(bus.now + bits.toLong * rate.bitCycles)
    def register(address: Int, n: Int): Int =
      port.read(address, n).zipWithIndex.map { case (b, i) => b << 8 * i }.sum
    def ringControl: Int = ring.read(RingRegisters.Control)
    def start(): Boolean = driver.start(address = 9, home = true, kbps = 500, coreMhz = 50)
    host.start()
    assert(start())
    run(20)
  }

  private def bench(body: Bench => Unit): Unit = {
    val b = new Bench
    try body(b)
    finally b.driver.end()
  }

  private def to(destination: Int, source: Int, n: Int) =
    BusFrame(
      1 << 28 | destination << 21 | 1 << 20 | source << 13 | n << 5 | 1,
      1 + n % 8,
      Seq.fill(1 + n % 8)(n)
    )
  private def asCan(f: BusFrame) =
    CanFrame(f.id, extended = true, remote = false, f.dlc, f.data)

  "FR-38: the driver in C" should "set the bit timing of the reach, and refuse what does not divide" in
    bench { b =>
      val f = CanRegisters.PortStarts.head
      assert(b.register(f + CanRegisters.Timing, 4) == (3 | 20 << 16 | 2 << 24 | 2 << 28))
      assert(b.register(f + CanRegisters.Status, 1) == CanState.Active)
      assert(b.ringControl == 1 << RingRegisters.Home)
      for ((kbps, mhz) <- Seq(3 -> 50, 0 -> 50, 300 -> 50, 2000 -> 50, 30 -> 100))
        assert(!b.driver.start(9, home = false, kbps, mhz), kbps)
      for (kbps <- Seq(1000, 500, 400, 250, 125, 100, 50, 20, 10, 5); mhz <- Seq(50, 100))
        assert(b.driver.start(9, home = false, kbps, mhz), kbps)
    }

  "FR-30, FB-05: the driver in C" should "make a node guard whose ports are up, once" in {
    val p    = FibreParams(coreClockMhz = 50, usPerMs = 1)
    val ring = RingBench.ready(p, IndexedSeq.fill(3)(new RingPortsModel(p)), home = None, bit = 50)
    ring.nodes.foreach(_.setBit(25, 4)) // as the driver sets it
    val port = new CanPortModel(CanParams())
    val driver = new DriverInC(
      (address, count) =>
        if (address < CanRegisters.PortStarts.head)
          (0 until count).map(i => ring.nodes(0).read(address + i))
        else port.read(address, count),
      (address, bytes) => {
        ring.runUs(0.2)
        if (address < CanRegisters.PortStarts.head)
          for ((b, i) <- bytes.zipWithIndex) ring.nodes(0).write(address + i, b)
        else port.write(address, bytes)
      }
    )
    try {
      assert(ring.guards == Nil)
      assert(driver.start(address = 9, home = true, kbps = 500, coreMhz = 50))
      ring.runUs(2)
      assert(ring.guards == Seq(0))
      // A break, and the next start of the host.
      ring.cut(1)
      ring.runUs(10)
      ring.dominant(2)
      ring.runUs(10)
      assert(ring.guards == Nil)
      assert(driver.start(address = 9, home = true, kbps = 500, coreMhz = 50))
      ring.runUs(2)
      assert(ring.guards == Nil)
    } finally driver.end()
  }

  "CAN-41: the driver in C" should "send what it is given in CAN order, eight at once, and say what waits" in
    bench { b =>
      val frames = Seq(5, 3, 7, 1, 8, 2, 6, 4).map(to(2, 9, _))
      for (f <- frames) assert(b.driver.send(f))
      assert(!b.driver.send(to(2, 9, 9)), "a ninth one")
      assert(frames.forall(f => b.driver.waits(f.id)))
      assert(!b.driver.waits(to(2, 9, 9).id))
      b.run(1500)
      assert(frames.forall(f => !b.driver.waits(f.id)))
      // Whatever came first was offered while it was alone.
      val got = b.host.received()
      assert(got.toSet == frames.map(asCan).toSet && got.size == 8)
      assert(got.tail == got.tail.sortBy(_.order))
      assert(b.driver.send(to(2, 9, 9)) && b.driver.waits(to(2, 9, 9).id))
    }

  "CAN-43: the driver in C" should "receive data frames to its node and to all, whole and in order" in bench {
    b =>
      val ours = Seq(to(9, 2, 1), to(0, 2, 2), to(9, 2, 3))
      val others = Seq(to(8, 2, 4), to(11, 2, 5)).map(asCan) ++
        Seq(
          CanFrame(9, extended = false, remote = false, 1, Seq(1)),
          asCan(to(9, 2, 6)).copy(remote = true, data = Nil)
        )
      assert(b.driver.receive().isEmpty)
      b.host.request(others ++ ours.map(asCan): _*)
      b.run(1500)
      assert(b.host.sent == 0x7f)
      assert(Seq.fill(3)(b.driver.receive()).flatten.sortBy(_.id) == ours.sortBy(_.id))
      assert(b.driver.receive().isEmpty)
  }

  "CAN-44: the driver in C" should "go on behind a FIFO that was full" in bench { b =>
    for (round <- 0 until 5) {
      b.host.request((0 until 16).map(n => asCan(to(9, 2, 16 * round + n))): _*)
      b.run(3000)
      b.host.clearSent(0xffff)
    }
    val got = Iterator.continually(b.driver.receive()).takeWhile(_.nonEmpty).flatten.toSeq
    assert(got.size == 64)
    b.host.request(asCan(to(9, 2, 200)))
    b.run(300)
    assert(b.driver.receive().contains(to(9, 2, 200)) && b.driver.receive().isEmpty)
  }

  "CB-04: the driver in C" should "see a node that began anew, start it, and forget what waited" in bench {
    b =>
      assert(b.driver.runs())
      b.reset()
      assert(!b.driver.runs() && !b.driver.waits(to(2, 9, 1).id))
      assert(b.start() && b.driver.runs())
      b.run(20)
      // Nobody acknowledges, as the other one has stopped: it waits; a start forgets it.
      b.host.setControl(0)
      assert(b.driver.send(to(2, 9, 1)))
      b.run(50)
      assert(b.driver.waits(to(2, 9, 1).id))
      assert(b.start() && !b.driver.waits(to(2, 9, 1).id))
      b.host.setControl(1)
      b.run(20)
      assert(b.driver.send(to(2, 9, 2)))
      b.run(300)
      assert(b.host.received() == Seq(asCan(to(2, 9, 2))))
  }

  "CAN-40, TB-27: the driver in C" should "take a frame back that nobody acknowledges, and no other" in
    bench { b =>
      b.host.setControl(0)
      val (old, kept) = (to(2, 9, 1), to(2, 9, 2))
      assert(b.driver.send(old) && b.driver.send(kept))
      b.run(50)
      b.driver.abort(old.id)
      b.run(500) // it may have been on the wire
      assert(!b.driver.waits(old.id) && b.driver.waits(kept.id))
      b.driver.abort(old.id)
      b.host.setControl(1)
      b.run(1000)
      assert(!b.driver.waits(kept.id) && b.host.received() == Seq(asCan(kept)))
    }

  "CAN-01: the driver in C" should "tell that there is no node" in {
    val driver = new DriverInC((_, count) => Seq.fill(count)(0xff), (_, _) => ())
    try assert(!driver.start(9, home = false, 500, 50))
    finally driver.end()
  }
}

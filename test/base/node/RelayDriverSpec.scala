package flyframe.node

import flyframe.can.CanFrame
import flyframe.registers.RingRegisters
import flyframe.relay._
import flyframe.transport.BusFrame
import org.scalatest.flatspec.AnyFlatSpec

/** The driver in C at the registers of a golden model in relay mode. */
class RelayDriverSpec extends AnyFlatSpec {
  private val Own = 9

  private def bench(body: (DriverInC, RelayBench) => Unit): Unit = {
    val node   = new RelayModel
    val driver = new DriverInC(node.read, node.write)
    try {
      val b = new RelayBench(node)
      assert(driver.relay(Own, 2000, 50, confirmUs = 2000, life = 77))
      for (port <- 0 to 1) b.up(port) = true
      b.isLooped = true
      b.run(2 * 2 * 2000 + 400)
      body(driver, b)
    } finally driver.end()
  }

  private def to(destination: Int, source: Int, n: Int) =
    BusFrame(1 << 28 | destination << 21 | 1 << 20 | source << 13 | n << 5 | 1, 8, Seq.fill(8)(n))
  private def asCan(f: BusFrame) = CanFrame(f.id, extended = true, remote = false, f.dlc, f.data)

  "FR-55: the driver in C" should "send sixteen at once, and say what waits until all have seen it" in
    bench { (driver, b) =>
      assert(b.frames(0).head.header == LinkHeader(LinkKind.Start, 0, Own, 77, 255))
      b.isLooped = false
      b.run(20)
      val first  = b.now
      val frames = (1 to 16).map(to(2, Own, _))
      for (f <- frames) assert(driver.send(f))
      assert(!driver.send(to(2, Own, 17)), "a seventeenth one")
      b.run(3400)
      assert(frames.forall(f => driver.waits(f.id)), "nobody has confirmed them")
      val ids =
        b.frames(0, first).take(16).map(_.body.take(32).foldLeft(0)((n, x) => n << 1 | (if (x) 1 else 0)))
      assert(ids.map(_ & 0x1fffffff) == frames.map(_.id))
      b.isLooped = true
      b.run(8000)
      assert(frames.forall(f => !driver.waits(f.id)) && driver.runs())
      assert(driver.send(to(2, Own, 17)))
    }

  "FR-59: the driver in C" should "receive data frames to its node and to all, once" in bench { (driver, b) =>
    b.isLooped = false
    b.run(20)
    val sent = Seq(to(Own, 3, 1), to(8, 3, 2), to(0, 3, 3), to(Own, 3, 4))
    for ((f, i) <- sent.zipWithIndex; port <- 0 to 1)
      b.send(port, LinkHeader(0, 1 - port, 3, i, 200), asCan(f))
    b.finish()
    assert(Seq.fill(4)(driver.receive()).flatten == Seq(sent(0), sent(2), sent(3)))
  }

  "FR-58, RB-25: the driver in C" should "see a node that began anew, and start it with another life" in
    bench { (driver, b) =>
      assert(driver.runs())
      b.write(RingRegisters.Control, 0)
      assert(!driver.runs())
      val first = b.now
      assert(driver.relay(Own, 2000, 50, life = 78) && driver.runs())
      assert(b.node.read(RingRegisters.Confirm, 2) == Seq(1000 & 0xff, 1000 >> 8), "10 ms at 2 Mbit/s")
      b.run(2 * 20000 + 400)
      assert(b.frames(0, first).head.header.sequence == 78)
    }

  "FR-40: the driver in C" should "refuse bits that are no whole cycles, too short or too long" in bench {
    (driver, b) =>
      for ((kbps, mhz) <- Seq(399 -> 50, 2001 -> 100, 300 -> 50, 1500 -> 50, 0 -> 50))
        assert(!driver.relay(Own, kbps, mhz), s"$kbps kbit/s at $mhz MHz")
      assert(!driver.relay(Own, 2000, 50, confirmUs = 655360))
      for (kbps <- Seq(400, 500, 1000, 2000); mhz <- Seq(50, 100)) {
        assert(driver.relay(Own, kbps, mhz))
        assert(b.node.read(RingRegisters.LinkBit, 1).head == mhz * 1000 / kbps)
      }
  }
}

package flyframe.node

import chiseltest._
import flyframe.{Simulation, Tier}
import flyframe.can.CanFrame
import flyframe.params.Presets
import flyframe.registers.{CanRegisters, RingRegisters}
import org.scalatest.flatspec.AnyFlatSpec
import scala.util.Random

/** Rings of whole nodes in RTL in relay mode, tones included. */
class RelayRingSpec extends AnyFlatSpec {
  private val p     = Presets.relay.copy(coreClockMhz = 50)
  private val Nodes = 4
  private val tier  = Tier("Relay mode of a ring of RTL nodes", "breaks", test = 6, soak = 400)
  private val Seed  = 5L
  private val port  = CanRegisters.PortStarts(0)

  private def little(map: Int) = Seq(map & 0xff, map >> 8)

  /** The nodes are up and have told their lives. */
  private class Ring(dut: RingUnderTest, delayNs: Long) {
    val rtl              = new RtlRing(dut, Seq.fill(Nodes)(delayNs), p.coreClockMhz)
    private val free     = Array.fill(Nodes)(0)
    def us(n: Int): Unit = rtl.pass(n * p.coreClockMhz)

    for (n <- 0 until Nodes) {
      rtl.write(n, RingRegisters.Address, Seq(n + 2))
      rtl.write(n, RingRegisters.LinkBit, little(25) ++ little(150) :+ 15)
      rtl.write(n, RingRegisters.Life, Seq(7))
      rtl.write(n, CanRegisters.FilterStarts(0), Seq(0, 0, 0, 0x20, 0, 0, 0, 0))
      rtl.write(n, RingRegisters.Control, Seq(1 << RingRegisters.Relay))
    }
    us(4000)

    def map(n: Int, which: Int): Int = {
      val bytes = rtl.read(n, port + which, 2)
      bytes.head | bytes(1) << 8
    }

    /** A frame goes to the next slot. */
    def request(n: Int, frame: CanFrame): Unit = {
      val slot = free(n)
      free(n) = (slot + 1) % 16
      rtl.write(n, CanRegisters.SlotStarts(0) + slot * CanRegisters.FrameBytes, frame.bytes())
      rtl.write(n, port + CanRegisters.Requests, little(1 << slot))
    }

    def received(n: Int): Seq[CanFrame] = {
      val frames = Seq.newBuilder[CanFrame]
      while (rtl.read(n, port + CanRegisters.RxLevel, 1).head > 0) {
        frames += CanFrame.of(rtl.read(n, port + CanRegisters.RxFrame, 16))
        rtl.write(n, port + CanRegisters.RxRelease, Seq(0))
      }
      frames.result()
    }
    def counter(n: Int, name: String): Int =
      rtl.read(n, RingRegisters.relay.find(_.name == name).get.address, 1).head
  }

  private def onRing(body: Ring => Unit): Unit = onFibres(300)(body)
  private def onFibres(delayNs: Long)(body: Ring => Unit): Unit =
    RawTester.test(new RingUnderTest(p, Nodes), Simulation.annotations(this, "relay ring"))(dut =>
      body(new Ring(dut, delayNs))
    )

  private def frame(n: Int, number: Int) =
    CanFrame((n + 2) << 13 | number, extended = true, remote = false, 8, Seq.fill(7)(n) :+ (number & 0xff))

  "FR-45, FR-57, FR-60: frames in a ring of RTL nodes" should "come to all, confirmed" in onRing { r =>
    for (n <- 0 until Nodes; i <- 1 to 3) r.request(n, frame(n, i))
    r.us(3000)
    for (n <- 0 until Nodes) {
      assert(r.map(n, CanRegisters.Requests) == 0 && r.map(n, CanRegisters.Failed) == 0)
      val got = r.received(n)
      for (from <- 0 until Nodes)
        assert(got.filter(_.data.head == from) == (if (from == n) Nil else (1 to 3).map(frame(from, _))))
      assert(r.counter(n, "ring_repeated") == 0 && r.counter(n, "ring_bad_frames1") == 0)
    }
    // Port 2 of a node goes to port 1 of the next.
    for (n <- 0 until Nodes; from <- 0 until Nodes if from != n)
      assert(
        r.rtl.read(n, RingRegisters.Distances + 2 * (from + 2), 2) ==
          Seq((n - from + Nodes) % Nodes, (from - n + Nodes) % Nodes)
      )
  }

  "FR-12, FR-63: within 20 us and 5 us for each km both ends of a break" should
    "be in the modes in which they stay" in {
      val km = 4
      onFibres(km * 5000L) { r =>
        def mode(n: Int) = r.rtl.read(n, RingRegisters.State, 1).head & 3
        // Both fibres, or one: its other end is told by search, the way back.
        for (fibres <- Seq(Seq(0, 1), Seq(0), Seq(1)); link <- 0 until Nodes) {
          val next = (link + 1) % Nodes
          r.rtl.pass(7 * link) // another phase of the bits
          r.rtl.cut(link, isCut = true, fibres)
          val cutAt = r.rtl.now
          r.us(20 + 5 * km - 1)
          for (look <- 1 to 10) {
            val modes = (0 until Nodes).map(mode)
            assert(look > 1 || r.rtl.now - cutAt <= (20 + 5 * km) * p.coreClockMhz)
            val expected = (0 until Nodes).map(n => if (n == link) 2 else if (n == next) 3 else 1)
            assert(modes == expected, s"fibres ${fibres.mkString(" and ")} of link $link, look $look")
            r.us(100)
          }
          r.rtl.cut(link, isCut = false)
          r.us(2000)
          assert((0 until Nodes).forall(mode(_) == 1), s"link $link is mended")
        }
      }
    }

  "FR-63: breaks of a ring of RTL nodes, and their mends" should "lose and double nothing" in
    tier.run(s"$Nodes nodes", tier.size, Some(Seed))(onRing { r =>
      val random = new Random(Seed)
      val sent   = Array.fill(Nodes)(0)
      def load(us: Int): Unit = for (_ <- 0 until us / 100) {
        val n = random.nextInt(Nodes)
        if (r.map(n, CanRegisters.Requests) == 0) {
          sent(n) += 1
          r.request(n, frame(n, sent(n)))
        }
        r.us(1 + random.nextInt(200))
      }
      val got = Array.fill(Nodes)(Seq.empty[CanFrame])
      for (_ <- 0L until tier.size) {
        load(500)
        val link = random.nextInt(Nodes)
        r.rtl.pass(random.nextInt(25))
        r.rtl.cut(link, isCut = true)
        load(1500)
        r.rtl.cut(link, isCut = false)
        load(500)
        for (n <- 0 until Nodes) got(n) ++= r.received(n)
      }
      r.us(20000)
      for (n <- 0 until Nodes) {
        got(n) ++= r.received(n)
        assert(r.map(n, CanRegisters.Requests) == 0 && r.map(n, CanRegisters.Failed) == 0, s"node $n")
        for (from <- 0 until Nodes)
          assert(
            got(n).filter(_.data.head == from) == (if (from == n) Nil
                                                   else (1 to sent(from)).map(frame(from, _))),
            s"frames of node $from at node $n"
          )
      }
      info(s"${sent.sum} frames, ${(0 until Nodes).map(r.counter(_, "ring_repeated")).sum} repeats")
    })
}

package flyframe.relay

import flyframe.can.CanFrame
import flyframe.registers.RingRegisters
import scala.util.Random

/** Starts and lives: FR-61 to FR-63; switches of the mode. A bit is 0.5 us, `confirmUs` 400. */
trait StartRules extends RelayCases {
  "FR-61, RB-13: a node that starts" should "listen, tell its life, and then send data" in withNode { node =>
    val b = new RelayBench(node)
    b.write(RingRegisters.Retries, 1)
    b.start(7, life = 9)
    val told = b.frames(0).head
    assert(told.header == LinkHeader(LinkKind.Start, 0, 7, 9, 255) && told.body.take(40).forall(!_))
    assert(told.start >= 2 * confirm && told.start < 2 * confirm + 45)
    b.request(0, data(1))
    b.run(300)
    assert(b.frames(0).last.header == LinkHeader(LinkKind.Data, 0, 7, 0, 255))
  }

  it should "send data when nobody has confirmed its life, too" in withNode { node =>
    val b = new RelayBench(node)
    b.write(RingRegisters.Address, 7)
    b.write(RingRegisters.Confirm, 40, 0)
    b.write(RingRegisters.Retries, 1)
    b.write(RingRegisters.Control, 1)
    b.up(0) = true
    b.run(10)
    b.request(0, data(1))
    b.run(confirm * 4 + 500)
    assert(b.frames(0).map(_.header.kind) == Seq(1, 1))
    b.run(confirm * 2)
    assert(b.frames(0).map(_.header.kind).take(3) == Seq(1, 1, 0))
  }

  "FR-61, FR-62, RB-30: a life that the host changes while its start is under way" should
    "be that of the next start" in withNode { node =>
      val b = new RelayBench(node)
      b.write(RingRegisters.Address, 7)
      b.write(RingRegisters.Confirm, 40, 0)
      b.write(RingRegisters.Life, 5)
      b.write(RingRegisters.Control, 1)
      def starts(port: Int) = b.frames(port).filter(_.header.kind == LinkKind.Start).map(_.header.sequence)
      def comesHome(n: Int): Unit = {
        b.send(1, LinkHeader(LinkKind.Start, 0, 7, n, 250), data(0))
        b.run(300)
      }
      for (port <- 0 to 1) b.up(port) = true
      b.run(2 * confirm - 50)
      b.write(RingRegisters.Life, 9) // it still listens
      while (b.frames(0).isEmpty && b.now < 4 * confirm) b.run(10)
      b.write(RingRegisters.Life, 33)
      b.run(confirm + 200)
      assert(starts(0) == Seq(9, 9) && starts(1) == Seq(9, 9), "repeated, by both ports")
      comesHome(9)
      assert(!b.conflict)
      b.request(0, data(1))
      b.run(300)
      assert(b.frames(0).last.header == LinkHeader(LinkKind.Data, 0, 7, 0, 255))
      comesHome(9)
      assert(!b.conflict, "a copy that is late")
      comesHome(33)
      assert(b.conflict)
      val first = b.now
      b.write(RingRegisters.Control, 1 << RingRegisters.ClearConflict | 1)
      b.run(2 * confirm + 300)
      assert(b.frames(0, first).map(_.header).head == LinkHeader(LinkKind.Start, 0, 7, 33, 255))
    }

  "FR-61: another life" should "begin the source's sequences anew, once" in bench() { b =>
    def life(n: Int): Unit = {
      b.send(
        0,
        LinkHeader(LinkKind.Start, 1, 3, n, 250),
        CanFrame(0, extended = false, remote = false, 0, Nil)
      )
      b.run(300)
    }
    def frame(id: Int): Unit = {
      b.send(0, from(3, 40), data(id))
      b.run(300)
    }
    for (n <- Seq(127, 0)) { // the life goes round
      life(n)
      frame(n)
      life(n)
      frame(500)
    }
    assert(b.received().map(_.id) == Seq(127, 0))
  }

  "FR-62, RB-14: a sequence ahead of all that were sent, or another life" should "be an address conflict" in {
    bench() { b =>
      b.request(0, data(1))
      b.run(200)
      for (sequence <- Seq(0, 16383, 8192)) home(b, 0, 1, sequence, data(2))
      assert(!b.conflict)
      home(b, 0, 1, 1, data(2))
      assert(b.conflict)
      val first = b.now
      b.request(1, data(3))
      b.run(5000)
      assert(own(b, 0, first).isEmpty)
      // The host clears it, with another life.
      b.write(RingRegisters.Life, 6)
      b.write(RingRegisters.Control, 1 | 1 << RingRegisters.ClearConflict)
      b.run(2 * confirm + 300)
      assert(!b.conflict && own(b, 0, first).head.header == LinkHeader(LinkKind.Start, 0, 7, 6, 255))
    }
    bench() { b =>
      b.send(0, LinkHeader(LinkKind.Start, 1, 7, 5, 250), data(0))
      b.run(300)
      home(b, 0, 1, 5000, data(1)) // of the life before
      assert(!b.conflict)
      b.send(0, LinkHeader(LinkKind.Start, 1, 7, 6, 250), data(0))
      b.run(300)
      assert(b.conflict)
    }
  }

  "RB-25: a switch of the mode" should "let all slots fail that are pending, and begin anew" in bench() { b =>
    b.request(0, data(1, 1))
    b.request(1, data(1, 2)) // waits for its identifier
    b.run(40)
    assert(pending(b) == 3)
    val first = b.now
    b.write(RingRegisters.Control, 0)
    b.run(300)
    assert(pending(b) == 0 && failed(b) == 3 && own(b, 0, first).forall(!_.isGood))
    b.send(0, from(3, 1), data(5))
    b.run(300)
    assert(b.frames(1, first).forall(!_.isGood) && b.received().isEmpty)
    val second = b.now
    b.write(RingRegisters.Control, 1)
    b.run(2 * confirm + 300)
    assert(own(b, 0, second).map(_.header.kind) == Seq(LinkKind.Start))
  }

  "RB-25: links in bus mode" should "say nothing, and count nothing" in withNode { node =>
    val b      = new RelayBench(node)
    val random = new Random(3)
    for (port <- 0 to 1) {
      b.up(port) = true
      // Bits of a bus, some as long as several of a link, frames with an end that is wrong, and silence.
      for (_ <- 1 to 60) b.send(port, Seq.fill(1 + random.nextInt(9))(random.nextBoolean()))
      for (_ <- 1 to 40) b.send(port, Seq.fill(1 + random.nextInt(9))(false) ++ Seq.fill(7)(true))
      b.send(port, RelayBench.levels(from(3, 1), data(5)).dropRight(1))
      b.send(port, Seq.fill(LinkFrame.EndBits)(true) ++ Seq.fill(400)(false) :+ true)
    }
    b.finish()
    // What comes when the mode is switched is the rest of a frame: it may look like a start.
    for (port <- 0 to 1) b.send(port, from(4, 1), data(6))
    b.run(60)
    b.write(RingRegisters.Control, 1 << RingRegisters.Relay)
    assert(!node.isStuck(0) && !node.isStuck(1))
    b.finish()
    for (which <- Seq(RelayCounter.BadHeader, RelayCounter.BadFrame); port <- 0 to 1)
      assert(counter(b, which + port) == 0)
    b.start(7)
    b.send(0, from(3, 2), data(8))
    b.run(300)
    assert(b.received() == Seq(data(8)))
  }

  "RB-26: bits of impossible lengths" should "be as long as the nearest possible one" in {
    for ((cycles, register) <- Seq(25 -> 10, 250 -> 255)) withNode { node =>
      val b = new RelayBench(node, bit = cycles)
      b.write(RingRegisters.LinkBit, register, 0)
      assert(b.node.read(RingRegisters.LinkBit, 2) == Seq(cycles, 0))
      b.start(7, confirmUs = 40)
      b.send(0, from(3, 1), data(5))
      b.run(300)
      assert(b.frames(1).last.isGood && b.received() == Seq(data(5)))
    }
  }

  "FR-63, RB-04: dominant for 320 bits" should "be no signal" in bench() { b =>
    b.send(0, Seq.fill(319)(false) ++ Seq.fill(20)(true))
    b.run(345)
    assert(!b.node.isStuck(0))
    b.send(0, Seq.fill(330)(false))
    b.run(325)
    assert(b.node.isStuck(0) && !b.node.isStuck(1))
    b.run(20)
    assert(!b.node.isStuck(0))
  }
}

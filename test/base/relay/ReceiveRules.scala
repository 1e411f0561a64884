package flyframe.relay

import flyframe.registers.{CanRegisters, RingRegisters}
import scala.util.Random

/** Receiving: FR-59 and FR-60, time stamps, and what is no frame. A bit is 0.5 us. */
trait ReceiveRules extends RelayCases {
  private val unit640 = 1280 // bits

  "FR-59: a data frame" should "be received once, from either side" in bench() { b =>
    for (sequence <- Seq(100, 100, 69, 68, 101, 69, 132, 101, 100)) {
      b.send(0, from(3, sequence), data(sequence))
      b.send(1, from(3, sequence, direction = 0), data(sequence))
      b.run(700)
    }
    // 68 is 32 behind 100; 101 and 132 are ahead.
    assert(b.received().map(_.id) == Seq(100, 69, 101, 132))
  }

  it should "be taken when it is ahead by up to half of all, and not from behind" in bench() { b =>
    for (sequence <- Seq(0, 8192, 8192 - 8191, 8192 + 8191, 5)) {
      b.send(0, from(3, sequence & 0x3fff), data(sequence))
      b.run(300)
    }
    assert(b.received().map(_.id) == Seq(0, 8192, 8192 + 8191, 5))
  }

  "FR-59, RB-23: a data frame" should "count from anew behind a source that was silent" in bench(confirmUs =
    100
  ) { b =>
    b.send(0, from(3, 100), data(1))
    b.run(64 * 200 - 400)
    b.send(0, from(3, 100), data(2))
    b.run(64 * 200 + unit640)
    b.send(0, from(3, 90), data(3))
    b.run(300)
    assert(b.received().map(_.id) == Seq(1, 3))
  }

  "FR-60: distances" should "be those of copies that have not turned round" in bench(confirmUs = 100) { b =>
    b.send(0, from(3, 1, direction = 1, hops = 250), data(1))
    b.send(0, from(3, 1, direction = 0, hops = 100), data(1))
    b.send(1, from(3, 1, direction = 0, hops = 255), data(1))
    b.finish()
    assert(b.node.read(RingRegisters.Distances + 6, 2) == Seq(6, 1))
    b.run(64 * 200 + unit640)
    assert(b.node.read(RingRegisters.Distances + 6, 2) == Seq(0, 0))
  }

  "FR-60, RB-25: distances" should "be 0 in bus mode and behind each switch, read in any cycle" in
    bench(confirmUs = 100) { b =>
      val (near, far) = (RingRegisters.Distances + 2 * 3, RingRegisters.Distances + 2 * 120)
      val sources     = Seq(near, far)
      def all         = b.node.read(RingRegisters.Distances, 256)
      def switch(on: Boolean): Unit =
        b.write(RingRegisters.Control, if (on) 1 << RingRegisters.Relay else 0)
      def known(): Unit = {
        b.run(30)
        b.send(0, from(3, 1, direction = 1, hops = 250), data(1))
        b.send(0, from(120, 1, direction = 1, hops = 200), data(1))
        b.finish()
        assert(sources.map(b.read) == Seq(6, 56))
      }
      // Few cycles behind each other, and so many that some sources are forgotten already, and others not.
      for (cycles <- (0 until 24) ++ (40 until 700 by 44)) {
        known()
        for (_ <- 0 until cycles % 25) b.cycle() // of a bit
        switch(on = false)
        for (_ <- 0 until cycles % 7) b.cycle()
        assert(b.read(far) == 0 && all.forall(_ == 0), s"in bus mode, $cycles cycles")
        assert(b.read(RingRegisters.Address) == 7, "the host goes on")
        switch(on = true)
        for (_ <- 0 until cycles) b.cycle()
        assert(b.read(far) == 0 && b.read(near) == 0, s"$cycles cycles behind the switch")
        assert(all.forall(_ == 0) && b.read(RingRegisters.Address) == 7)
      }
      known()
    }

  "CAN-45, RB-17: time stamps" should "be those of start bits" in bench() { b =>
    def time(bytes: Seq[Int]) = bytes.head | bytes(1) << 8
    b.run(40)
    val now = b.node.cycle / 50
    b.request(0, data(1))
    b.send(0, from(3, 1), data(2))
    b.run(300)
    val slot  = time(b.node.read(CanRegisters.SlotStarts(0) + 6, 2))
    val frame = time(b.node.read(CanRegisters.PortStarts(0) + CanRegisters.RxFrame + 6, 2))
    assert(slot - now <= 2 && slot >= now && frame - now <= 2 && frame >= now)
  }

  it should "be those of start bits when a bit is longer than a microsecond, too" in withNode { node =>
    val b = new RelayBench(node, bit = 200)
    b.write(RingRegisters.LinkBit, b.bit, 0)
    b.start(7, confirmUs = 40)
    b.write(RingRegisters.Confirm, 0xff, 0xff)
    b.request(0, data(1))
    while (node.level(0) && node.level(1)) b.cycle()
    val start = node.cycle / 50
    b.run(20)
    val bytes = b.node.read(CanRegisters.SlotStarts(0) + 6, 2)
    assert(((bytes.head | bytes(1) << 8) - start).abs <= 1)
  }

  "FR-45, FR-59: random bits" should "deliver nothing, and leave the node able" in bench() { b =>
    val random = new Random(8)
    for (port <- 0 to 1) b.send(port, Seq.fill(20000)(random.nextBoolean()) ++ Seq.fill(20)(true))
    b.finish()
    assert(b.received().isEmpty)
    for (port <- 0 to 1) b.send(port, from(3, 5), data(1))
    b.finish()
    assert(b.received() == Seq(data(1)))
    assert(b.frames(1).last.isGood && b.frames(0).last.isGood)
  }
}

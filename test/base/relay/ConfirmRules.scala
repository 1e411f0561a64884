package flyframe.relay

import flyframe.registers.{CanRegisters, RingRegisters}
import scala.util.Random

/** Own frames: FR-55 to FR-58. A bit is 0.5 us, `confirmUs` 400. */
trait ConfirmRules extends RelayCases {
  "FR-55: pending slots" should "go in CAN order, with ascending sequences" in bench() { b =>
    b.write(RingRegisters.Confirm, 1000 & 0xff, 1000 >> 8)
    val first = b.now
    for (slot <- 0 until 16) b.request(slot, data(0x1000 - slot * 7))
    b.run(3000)
    for (port <- 0 to 1) {
      val frames = own(b, port, first).take(16)
      assert(frames.map(_.header.sequence) == (0 until 16) && frames.forall(_.isGood))
      val ids = frames.map(_.body.take(32).foldLeft(0L)((n, x) => n << 1 | (if (x) 1 else 0)))
      assert(ids.drop(1) == ids.drop(1).sorted)
    }
  }

  "FR-55, RB-16: sequences" should "be less than 16 ahead of the oldest one not confirmed" in bench() { b =>
    b.request(0, data(0x99))
    b.run(260)
    for (i <- 1 to 15) {
      b.request(1, data(0x100 + i))
      b.run(260)
      home(b, 0, 1, i, data(0x100 + i))
      assert(sent(b) == 2, i)
      b.write(CanRegisters.PortStarts(0) + CanRegisters.Sent, 2)
    }
    b.request(1, data(0x200))
    b.run(500)
    assert(own(b, 0, 0).map(_.header.sequence).max == 15)
    home(b, 0, 1, 0, data(0x99))
    b.run(500)
    assert(own(b, 0, 0).map(_.header.sequence).max == 16)
  }

  "FR-55: a frame with the identifier of one that is not confirmed" should "wait" in bench() { b =>
    b.request(3, data(0x55, 1))
    b.request(1, data(0x55, 2))
    b.run(700)
    assert(own(b, 0, 0).filter(_.header.kind == 0).forall(_.header.sequence == 0))
    home(b, 1, 0, 0, data(0x55, 1))
    b.run(300)
    assert(own(b, 0, 0).filter(_.header.kind == 0).map(_.header.sequence).distinct == Seq(0, 1))
    assert(sent(b) == 8 && pending(b) == 2)
  }

  "FR-56: a copy" should "be sent at each port that is up" in bench() { b =>
    b.request(0, data(1))
    b.run(300)
    for (port <- 0 to 1) assert(own(b, port, 0).last.header == LinkHeader(0, port, 7, 0, 255))
    b.up(1) = false
    val first = b.now
    b.request(1, data(2))
    b.run(300)
    assert(own(b, 0, first).map(_.header.sequence) == Seq(1) && own(b, 1, first).isEmpty)
  }

  "FR-57: a copy that went all round" should "confirm its frame" in bench() { b =>
    b.request(4, data(1))
    b.run(200)
    home(b, 0, 0, 0, data(1))
    assert(pending(b) == 16)
    home(b, 1, 0, 0, data(1))
    assert(pending(b) == 0 && sent(b) == 16 && failed(b) == 0)
  }

  it should "not do so with a bad end" in bench() { b =>
    b.request(4, data(1))
    b.run(200)
    b.send(1, RelayBench.levels(LinkHeader(0, 0, 7, 0, 200), data(1)) ++ Seq(true, true, true, false))
    b.run(300)
    assert(pending(b) == 16)
  }

  "FR-57: copies that came home where they left" should "confirm together" in bench() { b =>
    b.request(4, data(1))
    b.run(200)
    home(b, 0, 0, 0, data(1))
    assert(pending(b) == 16)
    home(b, 1, 1, 0, data(1))
    assert(pending(b) == 0 && sent(b) == 16)
  }

  it should "be confirmed by one if the port of the other one has gone down since" in bench() { b =>
    b.request(4, data(1))
    b.run(200)
    home(b, 0, 0, 0, data(1))
    b.up(1) = false
    b.run(20)
    assert(pending(b) == 0 && sent(b) == 16)
    b.request(5, data(2)) // and a port that was down has no copy
    b.run(200)
    home(b, 0, 0, 1, data(2))
    assert(pending(b) == 0 && sent(b) == 48)
  }

  it should "not be confirmed by a port that has gone down alone" in bench() { b =>
    b.request(4, data(1))
    b.run(200)
    b.up(1) = false
    b.run(20)
    assert(pending(b) == 16)
  }

  "FR-58, RB-22: a frame that is not confirmed" should "be repeated, later and later, and fail in the end" in
    bench(retries = 6) { b =>
      val first = b.now
      b.request(4, data(1))
      b.run(confirm * (1 + 2 + 4 + 8 + 16 + 16) + 2000)
      val starts = own(b, 0, first).map(_.start)
      assert(own(b, 0, first).forall(_.header.sequence == 0) && starts.size == 7)
      val waits = starts.zip(starts.drop(1)).map { case (a, next) => next - a }
      for ((w, times) <- waits.zip(Seq(1, 2, 4, 8, 16, 16)))
        assert(w >= confirm * times && w < confirm * times + 40)
      assert(pending(b) == 16)
      b.run(confirm * 16)
      assert(pending(b) == 0 && failed(b) == 16 && sent(b) == 0)
      assert(counter(b, RelayCounter.Repeated) == 6 && counter(b, RelayCounter.Failed) == 1)
    }

  /** A frame of which a copy has come home by the port by which it left, while the other one waits, for so
    * many bits, at the port `late` for frames that are before it. Its sequence.
    */
  private def halfHome(b: RelayBench, late: Int, bits: Int): Int = {
    val frame = data(0x4000)
    for (slot <- 0 to 1) b.request(slot, data(slot, 1, 2, 3, 4, 5, 6, 7, 8)) // two wait from now on
    b.run(30)
    b.request(2, frame)
    for (i <- 0 until bits / 135) {
      if (i == 2) b.send(1 - late, LinkHeader(0, 1 - late, 7, 2, 200), frame)
      b.send(1 - late, from(3, i), data(0x100 + i % 5, 1))
    }
    b.run(bits)
    assert(begun(b, 1 - late, 2).size == 1 && begun(b, late, 2).isEmpty)
    assert((pending(b) & 4) == 4)
    2
  }
  private def begun(b: RelayBench, port: Int, sequence: Int, from: Int = 0) =
    own(b, port, from).filter(_.header.sequence == sequence)
  private val long  = 6 * confirm
  private val short = confirm

  /** It is sent if this copy comes home too. */
  private def isSentBy(b: RelayBench, port: Int, sequence: Int): Boolean = {
    b.finish()
    home(b, port, port, sequence, data(0x4000))
    (sent(b) & 4) == 4
  }

  "RB-29: a copy that came home long before the other one begins" should "be sent again, as a repeat" in {
    for (bits <- Seq(short, long); late <- 0 to 1) bench(confirmUs = 1000) { b =>
      val sequence = halfHome(b, late, bits)
      val first    = b.now
      val repeated = counter(b, RelayCounter.Repeated)
      while (begun(b, late, sequence, first).isEmpty) b.run(10)
      home(b, late, late, sequence, data(0x4000))
      assert(begun(b, 1 - late, sequence, first).nonEmpty == (bits == long))
      assert((sent(b) & 4) == (if (bits == long) 0 else 4))
      if (bits == long) {
        assert(counter(b, RelayCounter.Repeated) > repeated)
        assert(isSentBy(b, 1 - late, sequence))
      }
    }
  }

  it should "be sent again when the port of the other one goes down, too" in {
    for (bits <- Seq(short, long); late <- 0 to 1) bench(confirmUs = 1000) { b =>
      val sequence = halfHome(b, late, bits)
      val first    = b.now
      b.up(late) = false
      b.run(300)
      assert(begun(b, 1 - late, sequence, first).nonEmpty == (bits == long))
      assert((sent(b) & 4) == (if (bits == long) 0 else 4))
      if (bits == long) assert(isSentBy(b, 1 - late, sequence))
    }
  }

  it should "tell nothing any more of a frame that is not repeated" in {
    for (isLost <- Seq(false, true); late <- 0 to 1) bench(confirmUs = 1000) { b =>
      val sequence = halfHome(b, late, long)
      val first    = b.now
      b.write(CanRegisters.PortStarts(0) + CanRegisters.Aborts, 4)
      if (isLost) b.up(late) = false else while (begun(b, late, sequence, first).isEmpty) b.run(10)
      b.run(20)
      if (!isLost) home(b, late, late, sequence, data(0x4000))
      b.finish()
      b.run(5 * confirm)
      assert(begun(b, 1 - late, sequence, first).isEmpty && (failed(b) & 4) == 4 && (sent(b) & 4) == 0)
    }
  }

  "RB-29: a port that comes up" should "get a copy of what is not confirmed" in {
    for (port <- 0 to 1; wasSent <- Seq(false, true)) bench(confirmUs = 1000) { b =>
      val first = b.now
      if (!wasSent) b.up(port) = false
      b.run(20)
      b.request(2, data(0x4000))
      b.run(200)
      if (wasSent) b.up(port) = false
      b.run(20)
      b.up(port) = true
      b.run(20)
      home(b, 1 - port, 1 - port, 0, data(0x4000))
      assert((sent(b) & 4) == 0)
      assert(begun(b, port, 0, first).size == (if (wasSent) 2 else 1))
      assert(isSentBy(b, port, 0) && counter(b, RelayCounter.Repeated) == 0)
    }
  }

  "RB-11: a copy that has not begun" should "not be sent when its frame is confirmed" in bench() { b =>
    for (i <- 0 until 6) b.send(0, from(3, i), data(1 + i, 1, 2, 3, 4, 5, 6, 7, 8))
    b.run(60)
    val first = b.now
    b.request(4, data(0x1000))
    b.run(5)
    b.send(1, LinkHeader(0, 0, 7, 0, 200), data(0x1000))
    b.finish()
    assert(sent(b) == 16 && own(b, 0, first).size == 1 && own(b, 1, first).isEmpty)
  }

  "RB-24: a slot" should "be done when no copy of it is being sent any more" in bench() { b =>
    b.send(0, from(3, 1), data(1, 1, 2, 3, 4, 5, 6, 7, 8)) // leaves by port 2 until bit 240 or so
    b.run(60)
    val first = b.now
    b.request(4, data(0x1000))
    b.run(90)
    b.send(1, LinkHeader(0, 0, 7, 0, 200), data(0x1000))
    b.run(150)
    assert(pending(b) == 16 && own(b, 1, first).forall(!_.isGood))
    b.run(150)
    assert(pending(b) == 0 && sent(b) == 16 && own(b, 1, first).map(_.isGood) == Seq(true))
  }

  "RB-12: an abort" should "count for a slot that has not begun, and end repeats of one that has" in bench() {
    b =>
      val aborts = CanRegisters.PortStarts(0) + CanRegisters.Aborts
      b.request(0, data(1, 1))
      b.run(5)
      b.request(1, data(1, 2)) // waits for its identifier
      b.run(5)
      b.write(aborts, 3)
      b.run(5)
      assert(failed(b) == 2 && pending(b) == 1)
      b.run(confirm + 300)
      assert(failed(b) == 3 && pending(b) == 0 && own(b, 0, 0).count(_.header.kind == 0) == 1)
      b.write(CanRegisters.PortStarts(0), 8) // one shot
      b.request(0, data(1, 3))
      b.run(confirm + 300)
      assert(failed(b) == 3 && pending(b) == 0 && own(b, 0, 0).count(_.header.kind == 0) == 2)
  }

  "RB-12: an abort at any moment around the beginning" should
    "leave no copy or one at each port, and a slot that works" in bench(confirmUs = 40) { b =>
      val port   = CanRegisters.PortStarts(0)
      var counts = Set.empty[Seq[Int]]
      for (cycles <- 0 until 40) {
        while (b.node.cycle % b.bit != 0) b.cycle()
        val first = b.now
        b.request(0, data(1, cycles))
        for (_ <- 0 until cycles) b.cycle()
        b.write(port + CanRegisters.Aborts, 1)
        b.run(320)
        assert(pending(b) == 0 && failed(b) == 1 && sent(b) == 0, s"$cycles cycles behind the request")
        val copies = (0 to 1).map(own(b, _, first).size)
        assert(copies.distinct.size == 1 && copies.head <= 1, s"$cycles cycles behind the request")
        counts += copies
        b.request(0, data(2, cycles))
        b.run(5)
        assert(pending(b) == 1)
        b.run(160)
        home(b, 0, 1, own(b, 0, first).last.header.sequence, data(2, cycles))
        assert(pending(b) == 0 && sent(b) == 1, s"$cycles cycles behind the request, the next one")
      }
      assert(counts == Set(Seq(0, 0), Seq(1, 1)))
    }

  "FR-15, FR-58: own frames of a node that is alone" should "fail" in bench() { b =>
    b.request(4, data(1))
    b.run(100)
    b.up(0) = false
    b.up(1) = false
    b.run(5)
    assert(failed(b) == 16)
    b.request(5, data(2))
    b.run(5)
    assert(failed(b) == 48 && (b.read(RingRegisters.State) >> 3 & 1) == 1)
  }
}

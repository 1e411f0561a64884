package flyframe.relay

import flyframe.can.CanFrame
import flyframe.registers.{CanRegisters, RingRegisters}
import scala.util.Random

/** Own frames, and receiving: FR-55 to FR-63. A bit is 0.5 us, `confirmUs` 400. */
trait ConfirmRules extends RelayCases {
  private val confirm = 800  // bits
  private val unit640 = 1280 // likewise

  private def own(b: RelayBench, port: Int, first: Int) = b.frames(port, first).filter(_.header.source == 7)

  /** A copy of the own frame comes back. */
  private def home(b: RelayBench, port: Int, direction: Int, sequence: Int, frame: CanFrame): Unit = {
    b.send(port, LinkHeader(0, direction, 7, sequence, 200), frame)
    b.run(260)
  }
  private def pending(b: RelayBench) = b.map(CanRegisters.Requests)
  private def sent(b: RelayBench)    = b.map(CanRegisters.Sent)
  private def failed(b: RelayBench)  = b.map(CanRegisters.Failed)

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

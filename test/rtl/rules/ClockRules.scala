package flyframe.rules

import flyframe.model._
import flyframe.params.EscParams
import flyframe.protocol.Command._

/** Distributed clocks: rule group DC. */
object ClockRules extends Rules {
  private def built(p: EscParams)   = p.hasClocks && !p.savesClockPower
  private def several(p: EscParams) = built(p) && p.ports > 1

  private class Times(s: Steps) {
    import s._
    private def number(bytes: Seq[Int]) = bytes.foldRight(BigInt(0))((byte, rest) => rest << 8 | byte)

    def port(y: Int): BigInt    = number(get(0x0900 + 4 * y, 4).get)
    def ofPorts: Seq[BigInt]    = (0 until 4).map(port)
    def processingUnit: BigInt  = number(get(0x0918, p.clockBytes).get)
    def low: BigInt             = processingUnit & 0xffffffffL
    val trigger: Datagram       = Datagram(Bwr, 0, 0x0900, Seq(0, 0, 0, 0))
    def stamp(): Unit           = assert(one(trigger).workingCounter == 1)
    def nothingAt(y: Int): Unit = send(EtherCatFrame(Seq(Datagram(Nop, 0, 0, Seq(0)))), y)
  }

  rule("DC-05, B-83: the features tell of clocks and of the width of times", built) { s =>
    import s._
    assert((word(0x0008) & 0x000c) == (if (p.clockBits == 64) 0x000c else 0x0004))
    assert(get(0x0910, 1).isDefined == p.hasSystemTime, "or receive times only")
  }
  rule("DC-05: without clocks there are none of their registers", p => !p.hasClocks && !p.hasAlarm) { s =>
    import s._
    for (address <- Seq(0x0900, 0x0910, 0x0918)) {
      assert(write(Bwr, 0, address, 0, 0, 0, 0).workingCounter == 0)
      assert(get(address, 4).isEmpty)
    }
  }
  rule("DC-01: times have 64 bits, or their low half", built) { s =>
    import s._
    new Times(s).stamp()
    assert(get(0x091c, 4).isDefined == (p.clockBits == 64))
  }
  rule("DC-03, DC-07, DC-10, B-81: a BWR keeps the local time of its beginning, which runs freely", built) {
    s =>
      import s._
      val times = new Times(s)
      import times._
      var before = BigInt(0)
      for (us <- Seq(100, 400, 100)) {
        stamp()
        assert(port(0) == low, "a frame at port 0 is in the processing unit at once")
        val now = processingUnit
        if (before != 0) assert(now - before > 1000 * us && now - before < 1000 * (us + 100), s"$us us")
        assert(port(0) == (now & 0xffffffffL), "it stays while other frames pass")
        assert(hostGet(0x0918, 4) == get(0x0918, 4).get, "the host reads the same")
        before = now
        bench.advanceUs(if (us == 100) 400 else 100)
      }
  }
  rule("DC-07: FPWR does the same, other writes keep the time of the processing unit only", built) { s =>
    import s._
    val times = new Times(s)
    import times._
    stationAddress(0x55)
    def after(command: Int, adp: Int, ado: Int = 0x0900): (Boolean, Boolean, Int) = {
      val (atPort, atUnit) = (port(0), processingUnit)
      val counter          = write(command, adp, ado, 0).workingCounter
      (port(0) != atPort, processingUnit != atUnit, counter)
    }
    stamp()
    assert(after(Fpwr, 0x55) == ((true, true, 1)))
    assert(after(Apwr, 0) == ((false, true, 1)))
    assert(after(Brw, 0) == ((false, true, 3)))
    assert(after(Fprw, 0x55) == ((false, true, 3)))
    assert(after(Frmw, 0x33) == ((false, true, 1)))
    assert(after(Fpwr, 0x33) == ((false, false, 0)), "of another")
    assert(after(Brd, 0) == ((false, false, 1)))
    assert(after(Bwr, 0, 0x08ff) == ((false, false, 0)))
    for (ado <- Seq(0x0901, 0x0904, 0x0918)) assert(after(Bwr, 0, ado) == ((false, false, 0)))
    bench.hostWrite(0x0900, 0)
    val (atPort, atUnit) = (port(0), processingUnit)
    assert(port(0) == atPort && processingUnit == atUnit, "nor does the host")
    // Where the write stands in its frame does not matter.
    val other = Datagram(Brd, 0, 0x0000, Seq(0))
    exchange(other, trigger, other)
    assert(port(0) > atPort && low == port(0))
    assert(one(Datagram(Bwr, 0, 0x08fe, Seq(1, 2, 3))).workingCounter == 1)
    assert(low == port(0) && port(0) > atPort)
  }
  rule("DC-08: a frame in error keeps nothing; none reads its own times", built) { s =>
    import s._
    val times = new Times(s)
    import times._
    stamp()
    val (atPort, atUnit) = (port(0), processingUnit)
    spoiled(trigger)
    assert(port(0) == atPort && processingUnit == atUnit)
    val replies = exchange(trigger, Datagram(Aprd, 0, 0x0900, Seq(0, 0, 0, 0)))
    assert(replies(1).data.zipWithIndex.map { case (b, i) => BigInt(b) << (8 * i) }.sum == atPort)
    assert(port(0) > atPort && processingUnit > atUnit)
  }
  rule("DC-08, B-80: on its way back the frame is stamped where it comes in", several) { s =>
    import s._
    val times = new Times(s)
    import times._
    nothingAt(nextPort) // one before does not count
    stamp()
    val unknown = port(nextPort)
    assert(unknown == 0)
    bench.advanceUs(20)
    nothingAt(nextPort)
    val back = port(nextPort) - port(0)
    assert(back > 20000 && back < 60000, s"$back ns")
    bench.advanceUs(20)
    nothingAt(nextPort)
    assert(port(nextPort) - port(0) == back, "only once")
    stamp()
    assert(port(nextPort) < port(0), "again to come")
    nothingAt(nextPort)
    assert(port(nextPort) > port(0))
  }
  rule(
    "B-100: a frame that takes another way back is stamped as it comes",
    p => several(p) && p.hasMeanWays
  ) { s =>
    import s._
    val times = new Times(s)
    import times._
    for (us <- Seq(20, 20, 60, 30)) {
      stamp()
      bench.advanceUs(us)
      nothingAt(nextPort)
      val back = port(nextPort) - port(0)
      assert(back >= 1000 * us && back < 1000 * us + 20000, s"$back ns for $us us")
    }
  }
  rule(
    "B-100: a frame is stamped as frames are on the mean, until the way has changed",
    p => several(p) && p.hasMeanWays
  ) { s =>
    import s._
    val times = new Times(s)
    import times._
    // The frame is `more` bytes longer, and with it its way back.
    def back(more: Int): BigInt = {
      exchange(trigger, Datagram(Nop, 0, 0, Seq.fill(40 + more)(0)))
      bench.advanceUs(20)
      nothingAt(nextPort)
      port(nextPort) - port(0)
    }
    val usual = (1 to 12).map(_ => back(0)).last
    assert(back(4) - usual < 100, "320 ns more")
    val changed = (1 to 15).map(_ => back(4)).last
    assert(changed - usual > 220 && changed - usual < 420, s"$changed ns are not $usual ns")
  }
  rule("B-80: nothing is waited for at a port without link", several) { s =>
    import s._
    val times = new Times(s)
    import times._
    stamp()
    bench.setLink(nextPort, up = false)
    bench.setLink(nextPort, up = true)
    nothingAt(nextPort)
    assert(port(nextPort) == 0)
  }
  rule("B-80: a frame that enters elsewhere is stamped there", several) { s =>
    import s._
    val times = new Times(s)
    import times._
    // Without port 0 the processing unit is behind the other ports. Time 0 would look like none.
    bench.advanceUs(1)
    bench.setLink(0, up = false)
    (1 until p.ports).filter(_ != nextPort).foreach(bench.setLink(_, up = false))
    assert(bench.send(nextPort, WireFrame.withFcs(EtherCatFrame(Seq(trigger)))).isDefined)
    val bytes = hostGet(0x0900, 16).grouped(4).toSeq
    assert(bytes(nextPort) == hostGet(0x0918, 4) && bytes(nextPort).exists(_ != 0))
    assert(bytes(0).forall(_ == 0))
  }
  rule("B-82: times are 0 until there are some, and always for ports that do not exist", built) { s =>
    import s._
    val times = new Times(s)
    import times._
    assert(ofPorts.forall(_ == 0) && processingUnit == 0)
    stamp()
    (1 until p.ports).foreach(nothingAt)
    assert(processingUnit != 0)
    assert(ofPorts.map(_ != 0) == (0 until 4).map(_ < p.ports))
  }

  // ---- times of SyncManagers' buffers ----

  private def hasEvents(p: EscParams) = built(p) && p.hasEventTimes
  private class BufferTimes(s: Steps) {
    import s._
    private def number(bytes: Seq[Int]) = bytes.foldRight(0L)((byte, rest) => rest << 8 | byte)
    def all: Seq[Long]                  = Seq(0x09f0, 0x09f8, 0x09fc).map(a => number(get(a, 4).get))
    def ofHost(address: Int): Long      = number(hostGet(address, 4))

    /** SyncManager 0 has a buffer that ECAT writes, 1 a mailbox that it reads, four bytes each. */
    def managers(): Unit = {
      syncManager(0, 0x1000, 4, 0x04)
      syncManager(1, 0x1100, 4, 0x02)
      latch(0xc0)
    }
    def latch(bits: Int): Unit = for (n <- 0 to 1) assert(put(0x0806 + 8 * n, bits | 1))
    def stamp(more: Datagram*): Long = {
      assert(exchange(Datagram(Bwr, 0, 0x0900, Seq(0)) +: more: _*).forall(_.workingCounter == 1))
      number(get(0x0918, 4).get)
    }
  }
  rule("DC-42, SM-23, B-111: a frame that closes a buffer leaves the time of its beginning", hasEvents) { s =>
    import s._
    val t = new BufferTimes(s)
    t.managers()
    bench.advanceUs(100)
    assert(t.all == Seq(0, 0, 0) && put(0x1000, 1, 2, 3) && t.all == Seq(0, 0, 0), "not closed")
    val written = t.stamp(Datagram(Apwr, 0, 0x1003, Seq(4)))
    assert(t.all == Seq(written, 0, 0) && t.ofHost(0x09f0) == written)
    bench.advanceUs(100)
    spoiled(Datagram(Apwr, 0, 0x1000, Seq(5, 6, 7, 8)))
    assert(put(0x1000, 1) && get(0x1100, 4).isEmpty && t.all.head == written, "bad, not closed, denied")
    hostPut(0x1100, 1, 2, 3, 4)
    val read = t.stamp(Datagram(Aprd, 0, 0x1100, Seq(0, 0, 0, 0)))
    assert(t.all.head == read && read > written + 100000)
  }
  rule("DC-42, SM-23, B-111: the host begins with a buffer, and closes it", hasEvents) { s =>
    import s._
    val t = new BufferTimes(s)
    t.managers()
    bench.advanceUs(100)
    def within(act: => Unit): (Long, Long) = {
      val before = t.stamp()
      bench.advanceUs(10)
      act
      bench.advanceUs(10)
      before -> t.stamp()
    }
    def isIn(time: Long, span: (Long, Long)) = time > span._1 + 5000 && time < span._2
    val begun                                = within(bench.hostWrite(0x1100, 1))
    assert(isIn(t.all(1), begun) && t.all(2) == 0)
    hostPut(0x1101, 2, 3)
    assert(isIn(t.all(1), begun) && t.all(2) == 0, "neither the first nor the last byte")
    val closed = within(bench.hostWrite(0x1103, 4))
    assert(isIn(t.all(1), begun) && isIn(t.all(2), closed) && t.all.head == 0)
    assert(Seq(1, 2).map(n => t.ofHost(0x09f4 + 4 * n)) == t.all.tail)
    val times = t.all
    bench.hostWrite(0x1100, 1) // the mailbox is full
    bench.hostRead(0x1000)     // and nothing has been written there
    assert(t.all == times, "denied")
    assert(put(0x1000, 1, 2, 3, 4))
    val again = within(assert(hostGet(0x1000, 4) == Seq(1, 2, 3, 4)))
    assert(isIn(t.all(1), again) && isIn(t.all(2), again) && t.all(1) <= t.all(2))
  }
  rule(
    "DC-42, B-111: of SyncManagers that are told to keep times of ECAT, of the host, or of none",
    hasEvents
  ) { s =>
    import s._
    val t = new BufferTimes(s)
    t.managers()
    for (bits <- Seq(0, 0x40, 0x80)) {
      t.latch(bits)
      bench.advanceUs(10)
      val before = t.all
      assert(put(0x1000, 1, 2, 3, 4) && hostGet(0x1000, 4) == Seq(1, 2, 3, 4))
      val changed = t.all.zip(before).map { case (is, was) => is != was }
      assert(changed == Seq(bits == 0x40, bits == 0x80, bits == 0x80), s"bits $bits")
    }
  }
  rule("B-111: the host sees a time as it was at its first byte", p => hasEvents(p) && p.lanes == 1) { s =>
    import s._
    val t = new BufferTimes(s)
    t.managers()
    assert(put(0x1000, 1, 2, 3, 4))
    def read(): Unit = assert(hostGet(0x1000, 4) == Seq(1, 2, 3, 4))
    read()
    val before = hostGet(0x09fc, 4)
    bench.advanceUs(200)
    assert(bench.hostRead(0x09fc) == before.head)
    read()
    assert(hostGet(0x09fd, 3) == before.tail && hostGet(0x09fc, 4) != before)
  }

  // ---- system time ----

  private def has(p: EscParams)     = built(p) && p.hasSystemTime
  private def follows(p: EscParams) = has(p) && !p.hasTimeByPdi
  private class SystemTime(val s: Steps) {
    import s._
    def number(bytes: Seq[Int]): BigInt = bytes.foldRight(BigInt(0))((byte, rest) => rest << 8 | byte)

    /** The host reads that SYNC signal `n` is active, which ends it. */
    def acknowledges(n: Int): Boolean = {
      val was = bench.syncLevel(n) && bench.hostRead(0x098e + n) == 1
      if (p.acknowledgesByWrite) bench.hostWrite(0x098e + n, 0)
      bench.advanceUs(1)
      was && !bench.syncLevel(n)
    }
    def bytes(value: BigInt, count: Int): Seq[Int] =
      (0 until count).map(i => (value >> (8 * i) & 0xff).toInt)
    val width: Int       = p.clockBytes
    val mask: BigInt     = (BigInt(1) << p.clockBits) - 1
    def local: BigInt    = number(get(0x0918, width).get)
    def hostTime: BigInt = number(hostGet(0x0910, width))
    def time: Datagram   = Datagram(Aprd, 0, 0x0910, Seq.fill(width)(0))
    private val loop     = 0x0910 until 0x0940

    /** Writes; what belongs to the time loop by the side that has it. */
    def set(address: Int, value: BigInt, count: Int): Unit =
      if (p.hasTimeByPdi && loop.contains(address)) hostPut(address, bytes(value, count): _*)
      else assert(put(address, bytes(value, count): _*), f"0x$address%04x")

    /** A frame with the time of the reference clock; how late that is here. */
    def sample(reference: BigInt, write: Datagram => Datagram = identity): BigInt = {
      val replies = exchange(time, write(Datagram(Bwr, 0, 0x0910, bytes(reference, 4))))
      bench.advanceUs(20)
      val late = (number(replies.head.data.take(4)) - reference) & 0xffffffffL
      if (late.testBit(31)) late - (BigInt(1) << 32) else late
    }

    /** What 0x092C shows, with its sign as that of DC-17. */
    def difference: BigInt = {
      val shown     = number(get(0x092c, 4).get)
      val magnitude = shown & 0x7fffffff
      if (shown.testBit(31)) magnitude else -magnitude
    }
    def speed: Int = number(get(0x0932, 2).get).toInt
  }
  rule("DC-04, DC-16, B-84: the system time is local time and offset, of a frame less its delay", has) { s =>
    import s._
    val t = new SystemTime(s)
    for ((offset, delay) <- Seq(0L -> 0, 0x123456789abL -> 0, 1000L -> 777, -5000L -> 123456)) {
      t.set(0x0920, BigInt(offset) & t.mask, t.width)
      t.set(0x0928, delay, 4)
      val replies = exchange(t.time, Datagram(Bwr, 0, 0x0900, Seq(0)))
      assert(t.number(replies.head.data) == ((t.local + offset - delay) & t.mask))
      val ahead = (t.hostTime - offset - t.local) & t.mask
      assert(ahead < 200000, "the host's is without the delay")
      assert(t.number(get(0x0920, t.width).get) == (BigInt(offset) & t.mask))
      assert(t.number(get(0x0928, 4).get) == delay)
    }
    val within = exchange(t.time, t.time).map(_.data)
    assert(within.head == within.last, "it stands while a frame reads it")
    assert(exchange(t.time).head.data != within.head, "the next frame has its own")
  }
  rule("DC-17, DC-19, DC-23: a write is compared with the time of its frame", follows) { s =>
    import s._
    val t = new SystemTime(s)
    assert(t.difference == 0 && t.number(get(0x092c, 4).get) == 0)
    assert(get(0x0934, 2).get == Seq(4, 12) && t.number(get(0x0930, 2).get) == 0x1000)
    t.set(0x0934, 0, 1)
    for (reference <- Seq[BigInt](0, 1, 5000000, BigInt("80000000", 16))) {
      val late = t.sample(reference)
      assert(t.difference == late, s"$reference")
      assert(hostGet(0x092c, 4) == get(0x092c, 4).get)
    }
    t.set(0x0934, 4, 1)
    assert(t.difference == 0, "the filter has begun anew")
    val late = t.sample(0)
    assert((t.difference * 16 - late).abs <= 16, "the mean of sixteen")
  }
  rule("DC-17, DC-21, B-84: FRMW and ARMW of another slave compare, what only reads does not", follows) { s =>
    import s._
    val t = new SystemTime(s)
    stationAddress(0x55)
    t.set(0x0934, 0, 1)
    val frmw = t.sample(0, d => d.copy(command = Frmw, address = 0x0910L << 16 | 0x33))
    assert(t.difference == frmw)
    val armw = t.sample(0, d => d.copy(command = Armw, address = 0x0910L << 16 | 0x0001))
    assert(t.difference == armw && armw > frmw)
    t.sample(0, d => d.copy(command = Frmw, address = 0x0910L << 16 | 0x55))
    assert(t.difference == armw, "that is the reference clock itself")
    spoiled(Datagram(Bwr, 0, 0x0910, Seq(0, 0, 0, 0)))
    bench.advanceUs(20)
    assert(t.difference == armw, "a frame in error")
    exchange(Datagram(Bwr, 0, 0x0911, Seq(0, 0, 0)))
    bench.advanceUs(20)
    assert(t.difference == armw, "without the first byte")
    hostPut(0x0910, 0, 0, 0, 0)
    bench.advanceUs(20)
    assert(t.difference == armw, "nor does the host")
  }
  rule("DC-18, DC-20, DC-22, B-85: the speed follows the sign, and a reset ends it", follows) { s =>
    import s._
    val t = new SystemTime(s)
    t.set(0x0935, 0, 1)
    def now     = t.number(exchange(t.time).head.data.take(4))
    val elapses = t.sample(now) // between two exchanges
    def start(value: Int): Unit = {
      t.set(0x0930, value, 2)
      assert(t.difference == 0 && t.speed == 0)
      t.set(0x0935, 0, 1)
    }
    for (by <- Seq(3200, -3200)) {
      start(0x1000)
      val late = t.sample(now + elapses - by)
      assert((late > 0) == (by > 0) && late.abs < 16384 && t.speed == ((late >> 4) & 0xffff).toInt)
      assert((bench.hostRead(0x0932) | bench.hostRead(0x0933) << 8) == t.speed, "the host sees it, too")
      for (far <- Seq(40000000, -40000000)) t.sample(now + far)
      assert(t.speed == ((late >> 4) & 0xffff).toInt, "a jump is no matter of speed")
    }
    start(0x0085)
    for (_ <- 1 to 3) t.sample(now + elapses - 3200)
    assert(t.speed == 6, "within the start - 0x7F")
    t.set(0x0935, 3, 1)
    assert(t.speed == 0, "its mean begins anew")
  }
  rule("DC-20, B-84: who may write what of the time loop", follows) { s =>
    import s._
    for ((address, count) <- Seq(0x0920 -> p.clockBytes, 0x0928 -> 4, 0x0930 -> 2, 0x0934 -> 2)) {
      val before = get(address, count).get
      hostPut(address, Seq.fill(count)(0x11): _*)
      assert(get(address, count).get == before, f"the host, 0x$address%04x")
    }
    for (address <- Seq(0x092c, 0x0932, 0x0914)) assert(!put(address, 1), f"0x$address%04x")
    assert(put(0x0930, 0xff, 0xff) && get(0x0930, 2).get == Seq(0xff, 0x7f))
    assert(put(0x0934, 0xff, 0xff) && get(0x0934, 2).get == Seq(0x0f, 0x0f))
  }

  rule("DC-24, B-112: the host compares a time with that of LATCH0", p => has(p) && p.hasTimeByPdi) { s =>
    import s._
    val t = new SystemTime(s)
    t.set(0x0920, 1000000, t.width)
    t.set(0x0934, 0, 1)
    for (single <- Seq(0, 1)) {
      assert(put(0x09a8, single))
      bench.setLatch(0, level = true)
      val latched = t.number(hostGet(0x09b0, 4))
      assert(latched > 1000000)
      bench.setLatch(0, level = false)
      for (reference <- Seq[BigInt](0, 1, 5000000, BigInt("80000000", 16))) {
        t.set(0x0910, reference, 4)
        bench.advanceUs(20)
        val late = latched - reference & 0xffffffffL
        assert(t.difference == (if (late.testBit(31)) late - (BigInt(1) << 32) else late), s"$reference")
      }
      val before = t.difference
      hostPut(0x0910, 1, 2, 3)
      bench.advanceUs(20)
      assert(t.difference == before, "not before the last byte")
      hostPut(0x0913, 0)
      bench.advanceUs(20)
      assert(t.difference == latched - 0x030201, "with those that are there")
    }
  }
  rule("DC-24, B-112: where the host has the time loop the bus only reads", p => has(p) && p.hasTimeByPdi) {
    s =>
      import s._
      for ((address, count) <- Seq(0x0920 -> p.clockBytes, 0x0928 -> 4, 0x0930 -> 2, 0x0934 -> 2)) {
        val before = get(address, count).get
        assert(!put(address, Seq.fill(count)(0x11): _*) && get(address, count).contains(before))
        hostPut(address, Seq.fill(count)(0x01): _*)
        assert(get(address, count).contains(Seq.fill(count)(0x01)), f"0x$address%04x")
      }
      assert(write(Bwr, 0, 0x0910, 0, 0, 0, 0).workingCounter == 0)
      for (address <- Seq(0x092c, 0x0932)) {
        hostPut(address, 0x11, 0x11)
        assert(get(address, 2).contains(Seq(0, 0)), f"0x$address%04x")
      }
  }
  rule("DC-25, B-112: the speed counter difference is set directly", p => has(p) && p.hasDirectSpeed) { s =>
    import s._
    val t = new SystemTime(s)
    def told(value: Int): Int = {
      t.set(0x0938, value & 0xffff, 2)
      bench.advanceUs(20)
      assert(t.number(get(0x0938, 2).get) == (value & 0xffff) && hostGet(0x0938, 2) == get(0x0938, 2).get)
      t.speed.toShort.toInt
    }
    def elapses: BigInt = {
      val before = t.local
      new Times(s).stamp()
      val first = t.local
      bench.advanceUs(1000)
      new Times(s).stamp()
      assert(before != first)
      t.local - first & t.mask
    }
    t.set(0x0935, 0, 1) // the mean is the last value
    val usual = elapses
    assert(told(0x123) == 0x123 && told(-0x456) == -0x456)
    for ((most, sign) <- Seq(0x7fff -> 1, -0x8000 -> -1)) {
      assert(told(most) == sign * (0x1000 - 0x7f), "within the start - 0x7F")
      // 1 ns every 0x81 cycles, and back every 0x1f83.
      val slower = (1000000 / p.clockPeriodNs * (1.0 / 0x81 - 1.0 / 0x1f83)).toInt
      val by     = (usual - elapses).toInt * sign
      assert((by - slower).abs < 60, s"$by ns, not $slower")
    }
    assert(told(0x200) == 0x200)
    t.set(0x0930, 0x1000, 2)
    bench.advanceUs(20)
    assert(t.speed == 0x200, "also behind a reset of the filters")
    if (follows(p)) {
      t.set(0x0934, 0, 1)
      val late = t.sample(0)
      assert(t.difference == late && t.speed == 0x200, "what is compared does not count")
      val before = t.local
      assert(told(0) == 0x200 && before != 0, "it goes on from there")
      def now     = t.number(exchange(t.time).head.data.take(4))
      val elapsed = t.sample(now)
      val behind  = t.sample(now + elapsed - 3200)
      assert(t.speed != 0x200, s"$behind ns count again")
    }
  }
  rule("DC-25, B-112: the side that has the time loop sets the speed", p => has(p) && p.hasDirectSpeed) { s =>
    import s._
    assert(put(0x0938, 1) == !p.hasTimeByPdi)
    hostPut(0x0939, 2)
    assert(get(0x0938, 2).contains(if (p.hasTimeByPdi) Seq(0, 2) else Seq(1, 0)))
  }
  rule("DC-25: without direct control there is no register for it", p => has(p) && !p.hasDirectSpeed) { s =>
    assert(s.get(0x0938, 2).isEmpty && !s.put(0x0938, 1))
  }
  rule("DC-09: no other frame is armed, and there is no 0x0936", several) { s =>
    import s._
    val times = new Times(s)
    import times._
    assert(get(0x0936, 1).isEmpty && !put(0x0936, 1))
    stamp()
    bench.advanceUs(20)
    nothingAt(nextPort)
    val own = port(nextPort)
    assert(own > port(0))
    for (_ <- 1 to 3) nothingAt(nextPort)
    assert(port(nextPort) == own, "the next ones do not count")
  }

  // ---- delays as a master calculates them ----

  /** What the receive times tell when frames come back to the ports behind port 0 so many us after they have
    * left: by how much longer that takes than at once, ns.
    */
  private def away(s: Steps, us: Int*): Seq[Int] = {
    import s._
    val times = new Times(s)
    import times._
    val order = Seq(3, 1, 2).filter(_ < p.ports)
    def measured(us: Seq[Int]) = {
      stamp()
      for ((port, us) <- order.zip(us)) {
        bench.advanceUs(us)
        nothingAt(port)
      }
      order.take(us.size).scanLeft(port(0))((_, y) => port(y)).map(_.toLong)
    }
    val (atOnce, later) = (measured(us.map(_ => 0)), measured(us))
    later.zip(atOnce).map { case (t, t0) => ((t - later.head) - (t0 - atOnce.head)).toInt }.tail
  }
  private def isNear(ns: Double, us: Double): Boolean = (ns - 1000 * us).abs < 100
  rule("DC-11, DC-12, DC-15: the times behind port 1 tell the delays of a line", several) { s =>
    // A frame is away from B for 150 us, from C for 60 us, behind which is the last slave, D.
    val Seq(b)   = away(s, 150)
    val Seq(c)   = away(s, 60)
    val (bc, cd) = ((b - c) / 2.0, c / 2.0)
    assert(isNear(cd, 30) && isNear(bc, 45), s"$bc, $cd ns")
    assert(isNear(bc + cd, 75), "from B to D")
  }
  rule(
    "DC-13, DC-14, DC-15: the times of three ports tell the delays of a tree",
    p => several(p) && p.ports == 3
  ) { s =>
    // Behind port 1 of B are C and D, behind port 2 E and F; A is in front of it.
    val Seq(b1, b2) = away(s, 60, 150)
    val Seq(e)      = away(s, 50)
    val Seq(a)      = away(s, 300)
    val (be, ab)    = ((b2 - b1 - e) / 2.0, (a - b2) / 2.0)
    assert(isNear(be, 50) && isNear(ab, 45), s"$be, $ab ns")
    assert(isNear(ab + b1 + be, 155), "from A to E, by all of the branch in front of that")
    val t = new SystemTime(s)
    if (has(s.p)) {
      t.set(0x0928, BigInt((ab + b1 + be).toInt), 4)
      val replies = s.exchange(t.time, Datagram(Bwr, 0, 0x0900, Seq(0)))
      val shown   = t.local - t.number(replies.head.data) & t.mask
      assert(isNear(shown.toDouble, 155), "which its system time is behind, in its frames")
    }
  }

  // ---- SYNC ----

  private def synchronises(p: EscParams) = built(p) && p.syncSignals > 0
  private def both(p: EscParams)         = built(p) && p.syncSignals > 1
  private def held(p: EscParams)         = synchronises(p) && p.syncPulse == 0

  /** The cyclic unit becomes active `us` after now; when. */
  private def begin(t: SystemTime, us: Int, cycle: Int, second: Int = 0, bits: Int = 7): BigInt = {
    val start = (t.hostTime + 1000 * us) & t.mask
    t.set(0x0990, start, t.width)
    t.set(0x09a0, cycle, 4)
    if (t.s.p.syncSignals > 1) t.set(0x09a4, second, 4)
    t.set(0x0981, bits, 1)
    start
  }
  rule(
    "DC-26, DC-28, DC-34: SYNC0 is active for the length of its pulses",
    p => synchronises(p) && !held(p)
  ) { s =>
    import s._
    val t = new SystemTime(s)
    assert(hostGet(0x0982, 2) == EtherCatFrame.little(p.syncPulse))
    begin(t, us = 100, cycle = 200000)
    assert(!bench.syncLevel(0))
    bench.advanceUs(110)
    assert(bench.syncLevel(0) && bench.hostRead(0x098e) == 1)
    bench.advanceUs(p.syncPulse / 100 + 5)
    assert(!bench.syncLevel(0) && bench.hostRead(0x098e) == 0)
    bench.advanceUs(195 - p.syncPulse / 100)
    assert(bench.syncLevel(0), "the next one")
    t.set(0x0981, 6, 1)
    bench.advanceUs(1)
    assert(!bench.syncLevel(0))
  }
  rule("DC-30, DC-35, IRQ-04: SYNC0 stays until the host reads its status", held) { s =>
    import s._
    val t = new SystemTime(s)
    begin(t, us = 100, cycle = 200000)
    bench.advanceUs(150)
    assert(bench.syncLevel(0) && (!p.hasApplicationLayer || (bench.hostRead(0x0220) & 4) == 4))
    assert(get(0x098e, 1).get == Seq(1))
    assert(bench.syncLevel(0), "the bus does not acknowledge")
    assert(t.acknowledges(0) && (!p.hasApplicationLayer || (bench.hostRead(0x0220) & 4) == 0))
    bench.advanceUs(200)
    assert(bench.syncLevel(0), "the next one")
    if (p.hasApplicationLayer) {
      hostPut(0x0204, 0x04, 0, 0, 0)
      assert(bench.interrupt)
      assert(t.acknowledges(0) && !bench.interrupt)
    }
  }
  rule(
    "DC-27, DC-29, DC-31, B-88: a single pulse at the start time, and another one by another activation",
    held
  ) { s =>
    import s._
    val t = new SystemTime(s)
    for (_ <- 1 to 2) {
      val start = begin(t, us = 100, cycle = 0)
      assert(t.number(get(0x0990, t.width).get) == start)
      assert(!bench.syncLevel(0))
      bench.advanceUs(180)
      assert(t.acknowledges(0))
      bench.advanceUs(300)
      assert(!bench.syncLevel(0))
      t.set(0x0990, t.hostTime + 50000 & t.mask, t.width)
      bench.advanceUs(100)
      assert(!bench.syncLevel(0), "a start time alone")
      t.set(0x0981, 0, 1)
    }
  }
  rule("DC-27, B-88: a frame that makes the unit active writes the start time behind that", held) { s =>
    import s._
    val t = new SystemTime(s)
    begin(t, us = 200, cycle = 0)
    t.set(0x0981, 0, 1)
    val start = t.hostTime + 100000 & t.mask
    exchange(Datagram(Bwr, 0, 0x0981, Seq(3)), Datagram(Bwr, 0, 0x0990, t.bytes(start, t.width)))
    assert(t.number(get(0x0990, t.width).get) == start)
    assert(!bench.syncLevel(0))
    bench.advanceUs(150)
    assert(t.acknowledges(0))
    t.set(0x0981, 0, 1)
  }
  rule("DC-27: a start in the past never comes, and another one does", held) { s =>
    import s._
    val t = new SystemTime(s)
    begin(t, us = -10, cycle = 100000)
    bench.advanceUs(400)
    assert(!bench.syncLevel(0))
    t.set(0x0981, 0, 1)
    begin(t, us = 50, cycle = 100000)
    bench.advanceUs(100)
    assert(bench.syncLevel(0))
  }
  rule("DC-32, DC-33: SYNC1 follows SYNC0 by its own cycle time", p => held(p) && both(p)) { s =>
    import s._
    val t = new SystemTime(s)
    begin(t, us = 100, cycle = 400000, second = 150000)
    bench.advanceUs(150)
    assert(bench.syncLevel(0) && !bench.syncLevel(1))
    bench.advanceUs(150)
    assert(t.acknowledges(1))
    t.set(0x0981, 3, 1)
    bench.advanceUs(500)
    assert(!bench.syncLevel(1), "it is not enabled")
  }
  rule("DC-40, B-89: the cyclic unit belongs to one side, SYNC1 to it or the other one", synchronises) { s =>
    import s._
    hostPut(0x0990, 1)
    assert(hostGet(0x0990, 1) == Seq(0))
    hostPut(0x0981, 1)
    assert(bench.hostRead(0x0981) == 0)
    bench.hostWrite(0x0980, 1)
    assert(bench.hostRead(0x0980) == 0, "the master decides")
    assert(put(0x0980, 1) && !put(0x0981, 1) && !put(0x0990, 1) && !put(0x09a0, 1))
    hostPut(0x0981, 3)
    hostPut(0x09a0, 5)
    assert(bench.hostRead(0x0981) == 3 && bench.hostRead(0x09a0) == 5)
    if (both(p)) {
      assert(put(0x0980, 3) && put(0x0981, 4) && bench.hostRead(0x0981) == 7, "each its own bits")
      hostPut(0x0981, 0)
      assert(bench.hostRead(0x0981) == 4)
      assert(put(0x09a4, 9) && !put(0x09a0, 9) && bench.hostRead(0x09a4) == 9)
    }
  }

  // ---- LATCH ----

  private def latches(p: EscParams)    = built(p) && p.latchSignals > 0
  private def twoLatches(p: EscParams) = built(p) && p.latchSignals > 1
  rule("DC-37, DC-39, DC-41: every edge leaves its system time", latches) { s =>
    import s._
    val t = new SystemTime(s)
    t.set(0x0920, 1000000, t.width)
    for (n <- 0 until p.latchSignals; high <- Seq(true, false, true)) {
      val before = t.hostTime
      bench.setLatch(n, high)
      val after = t.hostTime
      val time  = t.number(get(0x09b0 + 16 * n + (if (high) 0 else 8), t.width).get)
      assert(time >= before - 100 && time <= after)
      assert(bench.hostRead(0x09ae + n) == (if (high) 4 else 0), "the pin, and no event")
      bench.advanceUs(3)
    }
  }
  rule(
    "DC-38, DC-40: of single events the first one stays until its owner reads it",
    p => latches(p) && !p.acknowledgesByWrite
  ) { s =>
    import s._
    val t = new SystemTime(s)
    def events: (Int, Int) =
      if (p.hasApplicationLayer) (bench.hostRead(0x0210) & 1, bench.hostRead(0x0220) & 2) else (0, 0)
    def pulse(): Unit = for (high <- Seq(true, false)) {
      bench.setLatch(0, high)
      bench.advanceUs(2)
    }
    def status = {
      get(0x0000, 1) // events of the bus show with the next frame
      bench.hostRead(0x09ae)
    }
    assert(put(0x09a8, 3))
    pulse()
    val first = hostGet(0x09b0, t.width)
    assert(status == 3, "the host does not have it")
    if (p.hasApplicationLayer) assert(events == ((1, 0)))
    pulse()
    assert(hostGet(0x09b0, t.width) == first)
    spoiled(t.time.copy(address = 0x09b0L << 16))
    assert(status == 3)
    assert(get(0x09b0, t.width).get == first)
    assert(status == 2)
    assert(get(0x09b8, 1).isDefined && status == 0 && events == ((0, 0)))
    pulse()
    assert(status == 3 && t.number(get(0x09b0, t.width).get) > t.number(first))
    get(0x09b8, 1)
    // The same with the host.
    assert(put(0x0980, 0x10) && !put(0x09a8, 0))
    pulse()
    get(0x09b0, t.width)
    assert(status == 3)
    if (p.hasApplicationLayer) assert(events == ((0, 2)) && bench.interrupt)
    bench.hostRead(0x09b0)
    bench.hostRead(0x09b8)
    assert(status == 0 && events == ((0, 0)))
    hostPut(0x09a8, 0)
    pulse()
    assert(status == 0, "continuously")
  }
  rule("DC-41: LATCH1 has its own registers", twoLatches) { s =>
    import s._
    assert(put(0x09a9, 1))
    bench.setLatch(1, level = true)
    get(0x0000, 1)
    assert(hostGet(0x09ae, 2) == Seq(0, 5))
    assert(get(0x09c0, 1).isDefined && hostGet(0x09ae, 2) == Seq(0, 4))
  }

  // ---- extended activation ----

  private def extended(p: EscParams) = held(p) && p.hasEnhancedSync
  private def whole(p: EscParams)    = extended(p) && p.clockBits == 64

  /** 0x0984 without the pulses that are to come. */
  private def isImplausible(s: Steps): Boolean = (s.bench.hostRead(0x0984) & 4) == 4

  rule("DC-36: without extended activation there is nothing of it", p => synchronises(p) && !extended(p)) {
    s =>
      import s._
      assert(put(0x0981, 0xf8) && get(0x0981, 1).get == Seq(0) && get(0x0984, 1).isEmpty)
      assert((word(0x0008) & 0x0100) == 0)
  }
  rule("DC-36, B-99: the unit becomes active by the last byte of the start time", extended) { s =>
    import s._
    val t = new SystemTime(s)
    assert((word(0x0008) & 0x0100) == 0x0100)
    t.set(0x09a0, 5000000, 4)
    t.set(0x0981, 0x0e, 1)
    val start = t.hostTime + 200000 & t.mask
    val bytes = t.bytes(start, t.width)
    assert(put(0x0990, bytes.init: _*) && get(0x0981, 1).get == Seq(0x0e), "not by the others")
    assert(put(0x0990, bytes: _*) && get(0x0981, 1).get == Seq(0x0f))
    assert(bench.hostRead(0x0984) == (if (both(p)) 3 else 1), "the first pulses are to come")
    bench.advanceUs(220)
    assert(bench.syncLevel(0) && bench.hostRead(0x0984) == 0)
    val next = t.number(get(0x0990, t.width).get)
    assert(next == (start + 5000000 & t.mask))
    t.set(0x0990, t.hostTime + 100000, t.width)
    assert(t.number(get(0x0990, t.width).get) == next, "it is active")
  }
  rule("DC-36, B-99: the lower half of a start time is completed from the present one", whole) { s =>
    import s._
    val t = new SystemTime(s)
    // The time is at the end of its lower half, so that the start is behind that.
    t.set(0x0920, (BigInt(0x123456) << 32) - t.hostTime - 150000, 8)
    val start = t.hostTime + 300000
    assert(start >> 32 == 0x123456 && t.hostTime >> 32 == 0x123455)
    t.set(0x0981, 0x1a, 1)
    assert(put(0x0990, t.bytes(start & 0xffffffffL, 4): _*))
    assert(t.number(get(0x0990, 8).get) == start && get(0x0981, 1).get == Seq(0x1b))
    assert(!isImplausible(s))
    bench.advanceUs(320)
    assert(bench.syncLevel(0))
  }
  rule("DC-36, B-99: a start time that is not in the near future is told of, and waited for", extended) { s =>
    import s._
    val t      = new SystemTime(s)
    val second = BigInt(1000000000)
    t.set(0x0920, second * 100, t.width)
    def tells(ahead: BigInt, near: Boolean): Boolean = {
      t.set(0x0981, 0, 1)
      t.set(0x0990, t.hostTime + ahead & t.mask, t.width)
      t.set(0x0981, if (near) 0x43 else 0x03, 1)
      get(0x0000, 1) // time for it
      isImplausible(s)
    }
    for (near <- Seq(false, true)) {
      assert(!tells(second / 1000, near) && !tells(second * 2, near), s"near $near")
      assert(tells(-second / 1000, near) && tells(-second, near), s"near $near")
    }
    val isFar = p.clockBits == 32 // half the range
    assert(tells(second * 3, near = false) == isFar && tells(second * 3, near = true))
    bench.advanceUs(100)
    assert(!bench.syncLevel(0), "without the check it is waited for")
    assert(!tells(second, near = false), "until the next time")
  }
  rule("DC-36, B-99: with the check the pulses begin at once instead", extended) { s =>
    import s._
    val t = new SystemTime(s)
    t.set(0x09a0, 200000, 4)
    for (ahead <- Seq(-1000000, 1000000)) {
      t.set(0x0981, 0, 1)
      val start = t.hostTime + ahead & t.mask
      t.set(0x0990, start, t.width)
      t.set(0x0981, 0x23, 1)
      bench.advanceUs(40)
      assert(isImplausible(s) == (ahead < 0) && bench.syncLevel(0) == (ahead < 0))
      if (ahead < 0) {
        assert(t.acknowledges(0))
        bench.advanceUs(200)
        assert(bench.syncLevel(0), "the next one")
      }
    }
  }
  rule("DC-36, B-99: a pulse by hand on the signals that are enabled", p => extended(p) && both(p)) { s =>
    import s._
    val t = new SystemTime(s)
    t.set(0x0981, 0x82, 1)
    bench.advanceUs(1)
    assert(bench.syncLevel(0) && !bench.syncLevel(1) && get(0x0981, 1).get == Seq(0x02))
    assert(t.acknowledges(0) && !bench.syncLevel(0))
    t.set(0x0981, 0x86, 1)
    bench.advanceUs(1)
    assert(bench.syncLevel(0) && bench.syncLevel(1))
    t.set(0x0981, 0x04, 1)
    bench.advanceUs(1)
    assert(!bench.syncLevel(0) && bench.syncLevel(1), "SYNC0 is not enabled any more")
    t.set(0x0981, 0x00, 1)
    bench.advanceUs(1)
    assert(!bench.syncLevel(1))
    t.set(0x0981, 0x80, 1)
    bench.advanceUs(1)
    assert(!bench.syncLevel(0) && !bench.syncLevel(1))
  }

  // ---- switched by the EEPROM ----

  private def switched(p: EscParams) = p.savesClockPower

  /** Power-on with this word A0 in the EEPROM; SYNC0 is an event of the host until that reads its status. */
  private def start(s: Steps, a0: Int): Unit = {
    s.bench.powerOn(EepromImage(a0, 0x0800, 0).updated(14, 0xa4).updated(15, 0x88))
    s.eepromDone()
  }

  rule("DC-06, B-98: 0x0141[3:2] tell which units are there; either has the system time", switched) { s =>
    import s._
    for (a0 <- Seq(0x0000, 0x0400, 0x0800, 0x0c00)) {
      start(s, a0)
      val (sync, latch) = ((a0 & 0x400) != 0, (a0 & 0x800) != 0)
      val any           = sync || latch
      val readable = Seq(0x0900 -> true, 0x090c -> true, 0x0910 -> any, 0x0918 -> any, 0x0920 -> any) ++
        Seq(0x092c -> any, 0x0934 -> any, 0x0980 -> any, 0x0981 -> sync, 0x0990 -> sync, 0x0998 -> sync) ++
        Seq(0x09a0 -> sync, 0x09a8 -> latch, 0x09b0 -> latch, 0x09c8 -> latch)
      for ((address, there) <- readable)
        assert(get(address, 1).isDefined == there, f"A0 $a0%04x: 0x$address%04x is read")
      val writable = Seq(0x0900 -> true, 0x0910 -> any, 0x0918 -> false, 0x0930 -> any, 0x0981 -> sync) ++
        Seq(0x09a4 -> sync, 0x09a9 -> latch)
      for ((address, there) <- writable)
        assert(put(address, 0) == there, f"A0 $a0%04x: 0x$address%04x is written")
      assert(hostGet(0x0934, 1) == Seq(if (any) 4 else 0), "the host sees the same")
      assert(put(0x0980, 0x11) == any)
      hostPut(0x09a0, 0x55)
      hostPut(0x09a8, 0x01)
      assert(hostGet(0x09a0, 1) == Seq(if (sync) 0x55 else 0))
      assert(hostGet(0x09a8, 1) == Seq(if (latch) 0x01 else 0))
    }
  }
  rule("DC-06, B-98, SII-08: what a reload switches off is not active, and has no events", switched) { s =>
    import s._
    start(s, 0x0c00)
    val t      = new SystemTime(s)
    def events = bench.hostRead(0x0220) & 6
    def reload(a0: Int): Unit = {
      assert(put(0x0508, 0, a0 >> 8))
      for (command <- Seq(Seq(1, 2, 0, 0), Seq(0, 4, 0, 0))) {
        assert(put(0x0502, command: _*))
        eepromDone()
      }
      assert((bench.hostRead(0x0141) & 0x0c) == a0 >> 8, f"A0 $a0%04x")
    }
    assert(put(0x0980, 0x10) && get(0x0980, 1).get == Seq(0x10))
    hostPut(0x09a8, 1)
    begin(t, us = 100, cycle = 5000000)
    bench.setLatch(0, level = true)
    bench.advanceUs(150)
    assert(bench.syncLevel(0) && events == 6)
    reload(0x0800)
    assert(!bench.syncLevel(0) && events == 2)
    reload(0x0000)
    assert(events == 0)
    reload(0x0c00)
    assert(!bench.syncLevel(0) && events == 0 && get(0x0981, 1).get == Seq(0))
  }
}

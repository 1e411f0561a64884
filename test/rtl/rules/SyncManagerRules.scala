package flyframe.rules

import flyframe.model._
import flyframe.params.EscParams
import flyframe.protocol.Command._

/** SyncManagers: rule group SM. */
object SyncManagerRules extends Rules {
  private def some(p: EscParams)      = p.syncManagers >= 2 && p.ramKiB >= 1
  private def watchdogs(p: EscParams) = some(p) && p.hasWatchdogs

  /** There are addresses behind the RAM. */
  private def below(p: EscParams) = some(p) && p.ramKiB < 60

  // Control: who writes, and the mode.
  private val EcatBuffer  = 0x04
  private val PdiBuffer   = 0x00
  private val EcatMailbox = 0x06
  private val PdiMailbox  = 0x02
  private val BothEvents  = 0x30
  private val Sequential  = 0x80
  private val Area        = 0x1000

  private val directions = Seq(EcatBuffer, PdiBuffer, EcatMailbox, PdiMailbox)

  /** Steps with both sides in one shape: write what a side may, read what comes. */
  private class Sides(val s: Steps, control: Int, start: Int, length: Int) {
    private val byEcat = (control & 4) != 0
    def write(offset: Int, data: Int*): Unit =
      if (byEcat) s.put(start + offset, data: _*) else s.hostPut(start + offset, data: _*)

    /** Zeros where reading is denied. */
    def read(offset: Int, count: Int): Seq[Int] =
      if (byEcat) s.hostGet(start + offset, count)
      else s.get(start + offset, count).getOrElse(Seq.fill(count)(0))
    val whole: Seq[Int] = (1 to length).map(_ * 0x11 & 0xff)
    def fill(): Unit    = write(0, whole: _*)
  }
  private def sides(s: Steps, control: Int, length: Int = 4): Sides = {
    s.syncManager(0, Area, length, control)
    new Sides(s, control, Area, length)
  }

  rule("SM-01: until the start address is accessed, all other accesses are denied", some) { s =>
    for (control <- directions) {
      val c = sides(s, control)
      c.write(1, 0x55, 0x66, 0x77)
      c.fill()
      assert(s.bench.hostRead(0x0805) != 0)
      for (i <- 1 to 3) assert(c.read(i, 1) == Seq(0), s"control $control")
      assert(c.read(0, 4) == c.whole)
    }
  }
  rule("SM-01, SM-06: denied ECAT accesses write nothing and do not count", some) { s =>
    import s._
    syncManager(0, Area, 4, EcatMailbox)
    assert(!put(Area + 1, 1) && !put(Area + 3, 1))
    assert(put(Area, 9, 8, 7, 6))
    assert(!put(Area, 1, 2, 3, 4), "full")
    assert(hostGet(Area, 4) == Seq(9, 8, 7, 6))
  }
  rule("SM-02: an open buffer may be accessed in parts, repeatedly, over frames", some) { s =>
    for (control <- directions) {
      val c = sides(s, control)
      c.write(0, 0xaa)
      c.write(2, 0x33)
      c.write(0, 0x11, 0x99)
      c.write(1, 0x22)
      c.write(3, 0x44)
      assert(c.read(0, 2) == Seq(0x11, 0x22), s"control $control")
      assert(c.read(2, 1) == Seq(0x33))
      assert(c.read(0, 1) == Seq(0x11))
      assert(c.read(3, 1) == Seq(0x44))
    }
  }
  rule("SM-03: the end address closes, with state and events", some) { s =>
    import s._
    for (control <- directions) {
      val c = sides(s, control | BothEvents)
      c.write(0, 1, 2, 3)
      assert((bench.hostRead(0x0805) & 0x0b) == 0, s"control $control")
      c.write(3, 4)
      assert((bench.hostRead(0x0805) & 0x01) == 1, s"control $control")
      assert((bench.hostRead(0x0221) & 1) == (control >> 2 & 1), "to the side that reads")
      assert((bench.hostRead(0x0210) >> 4 & 1) == (1 - (control >> 2 & 1)))
      c.read(0, 3)
      assert((bench.hostRead(0x0805) & 0x03) == 0)
      c.read(3, 1)
      assert((bench.hostRead(0x0805) & 0x03) == 2)
    }
  }
  rule("SM-03, SM-09: the last SyncManager works and tells as the first does", some) { s =>
    import s._
    val n      = p.syncManagers - 1
    def events = word(0x0221)
    def status = bench.hostRead(0x0805 + 8 * n)
    for (control <- Seq(EcatBuffer, EcatMailbox)) {
      syncManager(n, Area, 4, control | BothEvents)
      for (round <- 1 to 4) {
        assert(put(Area, round, 2, 3, 4))
        assert(events == 1 << n && (status & 3) == 1, s"control $control")
        assert(hostGet(Area, 4) == Seq(round, 2, 3, 4))
        assert(events == 0 && (status & 3) == 2, s"control $control")
      }
    }
    for (control <- Seq(PdiBuffer, PdiMailbox)) {
      syncManager(n, Area, 4, control | BothEvents)
      for (round <- 1 to 4) {
        hostPut(Area, round, 2, 3, 4)
        assert(events == 0 && (status & 3) == 1, s"control $control")
        assert(get(Area, 4).contains(Seq(round, 2, 3, 4)))
        assert(events == 1 << n && (status & 3) == 2, s"control $control")
      }
    }
  }
  rule("B-18, B-52: a buffer ends with the address space", p => some(p) && p.ramKiB == 60) { s =>
    import s._
    val (start, length) = (0x9000, 0x3000)
    val wrapped = Seq(0x1fff, 0x1000) // where the third buffer would end if addresses wrapped, and before
    for (control <- Seq(EcatBuffer, PdiBuffer)) {
      wrapped.foreach(bench.hostWrite(_, 0x77))
      syncManager(0, start, length, control)
      val c = new Sides(s, control, start, length)
      for (round <- 1 to 3) { // the buffers 0x9000, 0xC000 and 0xF000
        c.write(0, round)
        c.write(length - 1, 0x10 + round)
        assert(bench.hostRead(0x0805) >> 4 == round - 1, s"control $control")
        assert(c.read(0, 1) == Seq(round), s"control $control")
        assert(c.read(length - 1, 1) == Seq(if (round < 3) 0x10 + round else 0), s"control $control")
      }
      assert(put(0x0806, 0))
      for ((address, byte) <- Seq(0x9000 -> 1, 0xbfff -> 0x11, 0xc000 -> 2, 0xefff -> 0x12, 0xf000 -> 3))
        assert(bench.hostRead(address) == byte, f"control $control, 0x$address%04x")
      assert(wrapped.forall(bench.hostRead(_) == 0x77), s"control $control")
    }
  }
  rule("SM-04, B-56: after the end address nothing more of it in the same frame", some) { s =>
    import s._
    for (control <- Seq(EcatBuffer, EcatMailbox)) {
      syncManager(0, Area, 2, control)
      def w(at: Int, data: Int*) = Datagram(Apwr, 0, Area + at, data)
      val r                      = exchange(w(0, 1, 2), w(1, 5), w(0, 3, 4), w(0, 6))
      assert(r.map(_.workingCounter) == Seq(1, 0, 0, 0))
      assert(hostGet(Area, 2) == Seq(1, 2))
    }
    for (control <- Seq(PdiBuffer, PdiMailbox)) {
      syncManager(0, Area, 2, control)
      hostPut(Area, 1, 2)
      def r(at: Int, count: Int) = Datagram(Aprd, 0, Area + at, Seq.fill(count)(0))
      assert(exchange(r(0, 2), r(1, 1), r(0, 2)).map(_.workingCounter) == Seq(1, 0, 0))
    }
  }
  rule("SM-05: ECAT closes with the end of a good frame, the host with the access", some) { s =>
    import s._
    syncManager(0, Area, 2, EcatBuffer)
    val r = exchange(Datagram(Apwr, 0, Area, Seq(1, 2)), Datagram(Aprd, 0, 0x0805, Seq(0)))
    assert(r(1).data.head == 0x30, "still nothing written")
    assert(bench.hostRead(0x0805) == 0x01)
    syncManager(0, Area, 2, PdiBuffer)
    hostPut(Area, 1, 2)
    assert(bench.hostRead(0x0805) == 0x01)
  }
  rule("SM-06: a denied read by the host gives 0", some) { s =>
    import s._
    syncManager(0, Area, 2, EcatMailbox)
    assert(put(Area, 0x11, 0x22))
    assert(bench.hostRead(Area + 1) == 0)
    assert(hostGet(Area, 2) == Seq(0x11, 0x22))
    assert(hostGet(Area, 2) == Seq(0, 0), "read already")
  }
  rule("SM-07: a bad frame that touched the buffer starts the access anew", some) { s =>
    import s._
    for (control <- Seq(EcatBuffer, EcatMailbox)) {
      syncManager(0, Area, 4, control)
      assert(put(Area, 1, 2))
      spoiled(Datagram(Apwr, 0, Area + 2, Seq(3)))
      assert(!put(Area + 2, 3, 4))
      assert(put(Area, 5, 6) && put(Area + 2, 7, 8))
      assert(hostGet(Area, 4) == Seq(5, 6, 7, 8))
    }
    for (control <- Seq(PdiBuffer, PdiMailbox)) {
      syncManager(0, Area, 4, control)
      hostPut(Area, 1, 2, 3, 4)
      assert(get(Area, 2).contains(Seq(1, 2)))
      spoiled(Datagram(Aprd, 0, Area + 2, Seq(0)))
      assert(get(Area + 2, 2).isEmpty)
      assert(get(Area, 4).contains(Seq(1, 2, 3, 4)))
    }
  }
  rule("SM-07: a bad frame that touched something else leaves it open", some) { s =>
    import s._
    syncManager(0, Area, 4, EcatBuffer)
    assert(put(Area, 1, 2))
    spoiled(Datagram(Apwr, 0, 0x0f80, Seq(3)))
    assert(put(Area + 2, 3, 4))
    assert(hostGet(Area, 4) == Seq(1, 2, 3, 4))
  }
  rule("SM-08: start, end and length need no alignment", some) { s =>
    import s._
    for ((start, length) <- Seq((0x1001, 3), (0x1003, 7), (0x1006, 2), (0x1005, 9))) {
      syncManager(0, start, length, EcatBuffer)
      for (round <- 1 to 4) {
        val data = (0 until length).map(_ * 7 + round & 0xff)
        assert(put(start, data: _*))
        assert(hostGet(start, length) == data)
      }
    }
  }
  rule("SM-09, SM-10: three buffers, length apart, reached through the first", some) { s =>
    import s._
    bench.reset()
    (0 until 0x28).foreach(i => bench.hostWrite(Area + i, 0xee))
    syncManager(0, Area, 0x0a, EcatBuffer)
    for (round <- 1 to 3) {
      assert(put(Area, Seq.fill(0x0a)(round): _*))
      bench.hostRead(Area) // the host takes what is newest
    }
    assert(put(0x0806, 0)) // plain memory again
    val content = hostGet(Area, 0x28)
    assert(content.grouped(0x0a).take(3).map(_.distinct.size).toSeq == Seq(1, 1, 1))
    assert(content.take(0x1e).distinct.toSet.subsetOf(Set(1, 2, 3)) && content.drop(0x1e).forall(_ == 0xee))
    assert(bench.hostRead(Area) == 1 && bench.hostRead(Area + 0x0a) == 2, "buffers 0 and 1 came first")
  }
  rule("SM-12, SM-13: the reader gets the newest complete data and keeps it", some) { s =>
    for (control <- Seq(EcatBuffer, PdiBuffer)) {
      val c = sides(s, control)
      c.write(0, 1, 1, 1, 1)
      assert(c.read(0, 2) == Seq(1, 1))
      c.write(0, 2, 2, 2, 2)
      assert(c.read(2, 1) == Seq(1), "the buffer taken")
      assert(c.read(3, 1) == Seq(1))
      c.write(0, 3, 3)
      assert(c.read(0, 4) == Seq(2, 2, 2, 2), "the newest complete")
      assert(c.read(0, 4) == Seq(2, 2, 2, 2), "again: nothing newer")
      c.write(2, 3, 3)
      assert(c.read(0, 4) == Seq(3, 3, 3, 3))
    }
  }
  rule("SM-13, OP-12: reading the first byte of an open buffer again takes nothing newer", some) { s =>
    for (control <- Seq(EcatBuffer, PdiBuffer)) {
      val c = sides(s, control)
      c.write(0, 1, 1, 1, 1)
      assert(c.read(0, 1) == Seq(1))
      c.write(0, 2, 2, 2, 2)
      assert(c.read(0, 4) == Seq(1, 1, 1, 1))
      assert(c.read(0, 4) == Seq(2, 2, 2, 2))
    }
  }
  rule("SM-14: neither side blocks the other, unread data are dropped", some) { s =>
    for (control <- Seq(EcatBuffer, PdiBuffer)) {
      val c = sides(s, control)
      for (round <- 1 to 7) c.write(0, round, round, round, round)
      assert(c.read(0, 1) == Seq(7))
      for (round <- 8 to 12) c.write(0, round, round, round, round)
      assert(c.read(1, 3) == Seq(7, 7, 7))
      assert(c.read(0, 4) == Seq(12, 12, 12, 12))
    }
  }
  rule("SM-15: the status shows the buffer written last, 3 for none", some) { s =>
    import s._
    syncManager(0, Area, 2, EcatBuffer)
    def last = bench.hostRead(0x0805) >> 4 & 3
    assert(last == 3)
    assert(put(Area, 1, 1) && last == 0)
    assert(put(Area, 2, 2) && last == 1)
    assert(put(Area, 3, 3) && last == 0, "NEXT was not taken")
    bench.hostRead(Area) // takes buffer 0
    assert(put(Area, 4, 4) && last == 1)
    assert(put(Area, 5, 5) && last == 2)
    syncManager(0, Area, 2, EcatMailbox)
    assert(last == 0, "a mailbox has none")
  }
  rule("SM-16: before the first complete write there is nothing to read", some) { s =>
    import s._
    syncManager(0, Area, 4, EcatBuffer)
    assert(put(Area, 1, 2, 3) && hostGet(Area, 4) == Seq(0, 0, 0, 0))
    assert(put(Area + 3, 4) && hostGet(Area, 4) == Seq(1, 2, 3, 4))
    syncManager(0, Area, 4, PdiBuffer)
    assert(get(Area, 4).isEmpty)
    hostPut(Area, 1, 2, 3, 4)
    assert(get(Area, 4).isDefined)
  }
  rule("SM-17, SM-18, SM-19: a mailbox has one buffer: empty, full, empty", some) { s =>
    import s._
    for (control <- Seq(EcatMailbox, PdiMailbox)) {
      val c      = sides(s, control)
      def status = bench.hostRead(0x0805)
      assert(status == 0 && c.read(0, 4) == Seq(0, 0, 0, 0))
      c.fill()
      assert(status == 0x09)
      c.write(0, 9, 9, 9, 9)
      assert(c.read(0, 4) == c.whole, "writing a full one is denied")
      assert(status == 0x02)
      assert(c.read(0, 4) == Seq(0, 0, 0, 0))
      c.write(0, 5, 6, 7, 8)
      assert(status == 0x09 && c.read(0, 4) == Seq(5, 6, 7, 8))
    }
    assert(put(0x0806, 0))
    assert(hostGet(Area, 4) == Seq(5, 6, 7, 8), "all in the same place")
  }
  rule("SM-20: full and empty need a good frame", some) { s =>
    import s._
    syncManager(0, Area, 2, PdiMailbox)
    hostPut(Area, 1, 2)
    spoiled(Datagram(Aprd, 0, Area, Seq(0, 0)))
    assert((bench.hostRead(0x0805) & 8) == 8)
    assert(get(Area, 2).contains(Seq(1, 2)))
    assert((bench.hostRead(0x0805) & 8) == 0)
    syncManager(0, Area, 2, EcatMailbox)
    spoiled(Datagram(Apwr, 0, Area, Seq(3, 4)))
    assert(bench.hostRead(0x0805) == 0)
    assert(put(Area, 5, 6) && hostGet(Area, 2) == Seq(5, 6))
  }
  rule(
    "SM-21: a complete write raises an event to the reading side, a complete read to the writing side",
    some
  ) { s =>
    import s._
    for (control <- directions) {
      val c      = sides(s, control | BothEvents)
      def events = (bench.hostRead(0x0805) & 3, bench.hostRead(0x0221) & 1, bench.hostRead(0x0210) >> 4 & 1)
      assert(events == ((0, 0, 0)))
      val byEcat = control >> 2 & 1
      c.fill()
      assert(events == ((1, byEcat, 1 - byEcat)))
      c.read(0, 1)
      assert(events == ((0, 0, 0)))
      c.read(1, 3)
      assert(events == ((2, 1 - byEcat, byEcat)))
      c.write(0, 1)
      assert(events == ((0, 0, 0)))
    }
  }
  rule("SM-21, B-57: a first byte and a last byte in one frame: end of one event, then the other", some) {
    s =>
      import s._
      syncManager(0, Area, 2, EcatMailbox)
      assert(put(Area, 1, 2) && hostGet(Area, 2) == Seq(1, 2) && bench.hostRead(0x0805) == 2)
      assert(put(Area, 3, 4) && bench.hostRead(0x0805) == 9)
      assert(hostGet(Area, 2) == Seq(3, 4))
      spoiled(Datagram(Apwr, 0, Area, Seq(5)))
      assert(bench.hostRead(0x0805) == 2, "a bad frame ends no event")
  }
  rule(
    "SM-22, WD-04, B-62: complete writes trigger the watchdog, reads and partial writes do not",
    watchdogs
  ) { s =>
    import s._
    assert(put(0x0420, 20, 0)) // 2 ms
    bench.advanceMs(3)
    def alive = get(0x0440, 1).get.head == 1
    syncManager(0, Area, 2, EcatBuffer | 0x40)
    assert(put(Area, 1) && !alive)
    assert(put(Area + 1, 2) && alive)
    bench.advanceMs(1)
    assert(alive && put(Area, 1, 2))
    bench.advanceMs(1)
    assert(alive)
    hostGet(Area, 2)
    bench.advanceMs(2)
    assert(!alive)
    syncManager(0, Area, 2, EcatBuffer)
    assert(put(Area, 1, 2) && !alive, "without trigger enable")
  }
  rule("SM-24, B-53: length 1 passes everything, events still work", some) { s =>
    import s._
    for (control <- Seq(EcatBuffer, EcatMailbox)) {
      syncManager(0, Area, 1, control | BothEvents)
      val status = if (control == EcatBuffer) 0x30 else 0
      assert(get(Area, 1).isDefined && bench.hostRead(0x0805) == status, "reading by the writing side")
      assert(put(Area, 5) && put(Area, 6))
      assert(bench.hostRead(0x0805) == (status | 1) && (bench.hostRead(0x0221) & 1) == 1)
      assert(bench.hostRead(Area) == 6 && bench.hostRead(0x0805) == (status | 2))
      bench.hostWrite(Area, 7)
      assert(get(Area, 1).contains(Seq(7)) && bench.hostRead(0x0805) == (status | 2))
      val twice = exchange(Datagram(Apwr, 0, Area, Seq(1)), Datagram(Apwr, 0, Area, Seq(2)))
      assert(twice.map(_.workingCounter) == Seq(1, 1) && bench.hostRead(Area) == 2)
    }
  }
  rule("SM-25: length 0 is like disabled", some) { s =>
    import s._
    syncManager(0, Area, 0, EcatMailbox | BothEvents)
    assert(put(Area, 1, 2) && get(Area, 2).contains(Seq(1, 2)))
    bench.hostWrite(Area + 1, 3)
    assert(hostGet(Area, 2) == Seq(1, 3) && bench.hostRead(0x0805) == 0)
  }
  rule("SM-26, SM-24: one-byte SyncManagers side by side trigger the watchdog", watchdogs) { s =>
    import s._
    assert(put(0x0420, 20, 0))
    bench.advanceMs(3)
    for (n <- 0 until 2) syncManager(n, Area + n, 1, EcatBuffer | 0x40)
    assert(get(0x0440, 1).contains(Seq(0)))
    assert(put(Area, 1, 2) && get(0x0440, 1).contains(Seq(1)))
    assert(hostGet(Area, 2) == Seq(1, 2))
  }
  rule("SM-27: deactivated by the host: reset, the whole area locked, nothing counts", some) { s =>
    import s._
    for ((control, size) <- Seq(EcatBuffer -> 12, EcatMailbox -> 4)) {
      (0 until 16).foreach(i => bench.hostWrite(Area + i, 0xee))
      syncManager(0, Area, 4, control | BothEvents)
      assert(put(Area, 1, 2, 3, 4) && (bench.hostRead(0x0805) & 1) == 1)
      bench.hostWrite(0x0807, 1)
      assert(bench.hostRead(0x0807) == 1 && get(0x0807, 1).contains(Seq(1)))
      assert(bench.hostRead(0x0805) == (if (control == EcatBuffer) 0x30 else 0))
      assert((bench.hostRead(0x0221) & 1) == 0 && (bench.hostRead(0x0210) & 0x10) == 0)
      for (i <- 0 until size) {
        assert(!put(Area + i, 9) && get(Area + i, 1).isEmpty && bench.hostRead(Area + i) == 0, s"byte $i")
        bench.hostWrite(Area + i, 9)
      }
      assert(get(Area + size, 1).isDefined)
      bench.hostWrite(0x0807, 0)
      assert(hostGet(Area, 4) == Seq(0, 0, 0, 0), "must be written first")
      assert(put(Area, 5, 6, 7, 8) && hostGet(Area, 4) == Seq(5, 6, 7, 8))
      assert(put(0x0806, 0))
      assert(hostGet(Area, 16).forall(_ != 9))
    }
  }
  rule("SM-27, B-50: a deactivated SyncManager that is not enabled locks nothing", some) { s =>
    import s._
    syncManager(0, Area, 4, EcatBuffer)
    assert(put(0x0806, 0))
    bench.hostWrite(0x0807, 1)
    assert(put(Area + 2, 1) && get(Area + 2, 1).contains(Seq(1)))
    assert(put(0x0806, 1) && !put(Area, 1))
    bench.hostWrite(0x0807, 0)
    assert(put(Area, 1))
  }
  rule("SM-28, HINT-07: disabled by ECAT: plain memory at once, buffer 0", some) { s =>
    import s._
    syncManager(0, Area, 4, EcatBuffer)
    assert(put(Area, 1, 2, 3, 4) && put(Area, 5, 6, 7, 8))
    assert(put(0x0806, 0))
    assert(get(Area + 1, 3).contains(Seq(2, 3, 4)) && hostGet(Area + 4, 4) == Seq(5, 6, 7, 8))
    assert(bench.hostRead(0x0805) == 0x30)
    assert(put(Area + 2, 9) && bench.hostRead(Area + 2) == 9)
  }
  rule("SM-28, B-40: start, length and control are writable only while disabled", some) { s =>
    import s._
    syncManager(0, Area, 4, EcatBuffer)
    for (at <- 0 to 4) assert(!put(0x0800 + at, 0xff), s"+$at")
    assert(hostGet(0x0800, 5) == Seq(0, 0x10, 4, 0, EcatBuffer))
    val r = exchange(Datagram(Apwr, 0, 0x0806, Seq(0)), Datagram(Apwr, 0, 0x0802, Seq(8)))
    assert(r.map(_.workingCounter) == Seq(1, 0), "the state before the frame decides")
    assert(put(0x0802, 8) && bench.hostRead(0x0802) == 8)
    hostPut(0x0800, 0xff, 0xff, 0xff, 0xff, 0xff)
    assert(hostGet(0x0800, 5) == Seq(0, 0x10, 8, 0, EcatBuffer), "the host cannot")
    assert(!put(0x0805, 0) && !put(0x0807, 1))
  }
  rule("B-103: the status tells which side has a buffer open", p => some(p) && p.tellsOpenBuffers) { s =>
    import s._
    for (mode <- directions) {
      val c        = sides(s, mode)
      def open     = bench.hostRead(0x0805) >> 6
      def isSeen() = assert(get(0x0805, 1).exists(_.head >> 6 == open))
      assert(open == 0)
      c.write(0, 1)
      assert(open == 2, s"mode $mode")
      isSeen()
      c.write(1, 2, 3)
      assert(open == 2)
      c.write(3, 4)
      assert(open == 0)
      c.read(0, 2)
      assert(open == 1)
      isSeen()
      if ((mode & 2) == 0) {
        c.write(0, 1)
        assert(open == 3)
      }
      c.read(2, 2)
      assert((open & 1) == 0)
    }
    syncManager(0, Area, 4, EcatBuffer)
    val status = Datagram(Aprd, 0, 0x0805, Seq(0))
    val seen   = exchange(Datagram(Apwr, 0, Area, Seq(1)), status)
    assert(seen(1).data == Seq(0x30) && get(0x0805, 1).contains(Seq(0xb0)), "not in its own frame")
    spoiled(Datagram(Apwr, 0, Area, Seq(1)))
    assert(get(0x0805, 1).contains(Seq(0x30)))
  }
  private def sequential(p: EscParams) = some(p) && p.hasSequentialMode
  rule("GEN-07, SM-32: the features tell of the sequential mode", some) { s =>
    assert((s.word(0x0008) >> 12 & 1) == s.p.sequentialMode)
  }
  rule("SM-32, SM-33, B-101: in sequential mode a buffer with a gap is not taken over", sequential) { s =>
    import s._
    for (mode <- Seq(EcatBuffer, EcatMailbox)) {
      syncManager(0, Area, 6, mode | BothEvents | Sequential)
      assert(put(Area, 1, 2) && put(Area + 4, 5, 6))
      assert((bench.hostRead(0x0805) & 0x0f) == 4 && get(0x0805, 1).exists(b => (b.head & 0x0f) == 4))
      assert((bench.hostRead(0x0221) & 1) == 0, "not written")
      assert(hostGet(Area, 6).forall(_ == 0))
      assert(!put(Area + 2, 3), "anew from the first byte on")
      assert(put(Area, 1, 2) && put(Area + 2, 3, 4) && put(Area + 1, 7, 8, 9) && put(Area + 4, 5, 6))
      assert((bench.hostRead(0x0805) & 0x07) == 1, "bytes may come again")
      assert(hostGet(Area, 6) == Seq(1, 7, 8, 9, 5, 6))
      assert(put(Area, 9, 9, 9, 9) && put(Area, 8) && put(Area + 4, 8, 8))
      assert((bench.hostRead(0x0805) & 0x05) == 4, "the first byte begins a sequence")
      assert(put(Area, 1, 2, 3) && put(Area + 4, 5) && put(Area + 3, 4) && put(Area + 5, 6))
      assert((bench.hostRead(0x0805) & 0x05) == 4, "not in order")
    }
  }
  rule("SM-32, B-101: without control bit 7, or where ECAT reads, gaps do not matter", sequential) { s =>
    import s._
    for (mode <- directions) {
      val c = sides(s, if ((mode & 4) == 0) mode | Sequential else mode)
      c.write(0, 1)
      c.write(3, 4)
      assert((bench.hostRead(0x0805) & 5) == 1, s"mode $mode")
      assert(c.read(0, 1) == Seq(1))
    }
  }
  rule("SM-34: in sequential mode a bad frame ends a buffer as it does without", sequential) { s =>
    import s._
    syncManager(0, Area, 6, EcatBuffer | Sequential)
    assert(put(Area, 1, 2))
    spoiled(Datagram(Apwr, 0, Area + 2, Seq(3, 4)))
    assert(!put(Area + 2, 3, 4) && !put(Area + 4, 5, 6))
    assert(put(Area, 1, 2) && put(Area + 2, 3, 4) && put(Area + 4, 5, 6))
    assert(hostGet(Area, 6) == Seq(1, 2, 3, 4, 5, 6))
  }

  private def delays(p: EscParams) = some(p) && p.hasDeactivationDelay
  private def delayed(s: Steps, control: Int): Unit = {
    s.syncManager(0, Area, 4, control)
    s.bench.hostWrite(0x0807, 0x40)
  }
  private def isActive(s: Steps) = {
    val shown = s.bench.hostRead(0x0807) & 0xc1
    assert(s.get(0x0807, 1).exists(b => (b.head & 0xc1) == shown))
    (shown & 0x80) != 0
  }
  rule("SM-29, SM-30: switched off by ECAT, the last buffer stays for the host", delays) { s =>
    import s._
    delayed(s, EcatBuffer | BothEvents)
    assert(put(Area, 1, 2, 3, 4) && put(Area, 5, 6, 7, 8) && !isActive(s))
    assert(hostGet(Area, 2) == Seq(5, 6))
    assert(put(0x0806, 0) && isActive(s))
    assert(bench.hostRead(0x0806) == 0 && get(0x0806, 1).contains(Seq(0)))
    assert(get(0x0805, 1).contains(Seq(0x30)) && (bench.hostRead(0x0805) & 0x3f) == 0x10)
    assert(hostGet(Area + 2, 2) == Seq(7, 8), "of the buffer that is open")
    assert(bench.hostRead(0x0805) == 0x12 && (get(0x0210, 1).get.head & 0x10) == 0, "ECAT sees no event")
    assert(hostGet(Area, 4) == Seq(5, 6, 7, 8), "also from its beginning")
    for (i <- 0 until 12) assert(!put(Area + i, 9), s"byte $i")
    assert(get(Area, 4).contains(Seq(1, 2, 3, 4)), "ECAT reads plain memory")
    assert(put(Area + 12, 9))
  }
  rule("SM-30: in sequential mode ECAT sees the status", p => delays(p) && sequential(p)) { s =>
    import s._
    delayed(s, EcatBuffer | Sequential)
    assert(put(Area, 1, 2, 3, 4) && put(0x0806, 0) && isActive(s))
    assert(get(0x0805, 1).contains(Seq(0x01)))
  }
  rule("SM-31: ECAT that switches it on again ends the delay, and begins anew", delays) { s =>
    import s._
    delayed(s, EcatBuffer)
    assert(put(Area, 1, 2, 3, 4) && hostGet(Area, 1) == Seq(1))
    assert(put(0x0806, 0) && isActive(s))
    assert(put(0x0806, 1) && !isActive(s))
    assert(bench.hostRead(0x0805) == 0x30 && hostGet(Area, 4).forall(_ == 0))
    assert(put(Area, 5, 6, 7, 8) && hostGet(Area, 4) == Seq(5, 6, 7, 8))
  }
  rule("SM-31, B-102: the host, or another start, length or control ends the delay", delays) { s =>
    import s._
    val ends = Seq[() => Unit](
      () => bench.hostWrite(0x0807, 0),
      () => bench.hostWrite(0x0807, 0x41),
      () => assert(put(0x0800, 0)),
      () => assert(put(0x0803, 0)),
      () => assert(put(0x0804, 0))
    )
    for ((end, i) <- ends.zipWithIndex) {
      bench.hostWrite(0x0807, 0)
      delayed(s, EcatBuffer)
      assert(put(Area, 1, 2, 3, 4) && put(Area, 5, 6, 7, 8) && put(0x0806, 0) && isActive(s))
      end()
      assert(!isActive(s), s"end $i")
      assert(hostGet(Area, 4) == Seq(1, 2, 3, 4) && put(Area + 5, 9), "plain memory")
      bench.hostWrite(0x0807, 0x40)
      assert(!isActive(s))
    }
  }
  rule("SM-31: a mailbox that the host has read ends the delay", delays) { s =>
    import s._
    delayed(s, EcatMailbox)
    assert(put(Area, 1, 2, 3, 4) && put(0x0806, 0) && isActive(s))
    assert(get(0x0805, 1).contains(Seq(0)) && bench.hostRead(0x0805) == 9)
    assert(hostGet(Area, 3) == Seq(1, 2, 3) && isActive(s))
    assert(bench.hostRead(Area + 3) == 4 && !isActive(s))
    assert(put(Area, 9) && bench.hostRead(Area) == 9)
  }
  rule("SM-29: no delay of what nobody has written, of the host's buffers, nor unless it is wanted", delays) {
    s =>
      import s._
      delayed(s, EcatBuffer)
      assert(put(Area, 1, 2) && put(0x0806, 0) && !isActive(s), "not written")
      delayed(s, PdiBuffer)
      hostPut(Area, 1, 2, 3, 4)
      assert(put(0x0806, 0) && !isActive(s), "the host writes")
      delayed(s, EcatMailbox)
      assert(put(Area, 1, 2, 3, 4) && hostGet(Area, 4) == Seq(1, 2, 3, 4))
      assert(put(0x0806, 0) && !isActive(s), "read")
      bench.hostWrite(0x0807, 0)
      syncManager(0, Area, 4, EcatBuffer)
      assert(put(Area, 1, 2, 3, 4) && put(0x0806, 0) && !isActive(s), "not wanted")
  }
  rule("SM-35: repeat request and acknowledge are kept, the request raises the event", some) { s =>
    import s._
    syncManager(1, Area, 4, PdiMailbox)
    bench.hostRead(0x080e)
    assert((bench.hostRead(0x0220) & 0x10) == 0)
    assert(put(0x080e, 3) && (bench.hostRead(0x0220) & 0x10) == 0x10)
    assert(bench.hostRead(0x080e) == 3 && (bench.hostRead(0x0220) & 0x10) == 0)
    hostPut(Area, 1, 2, 3, 4)
    bench.hostWrite(0x080f, 2)
    assert(get(0x080f, 1).contains(Seq(2)))
    assert(get(Area, 4).contains(Seq(1, 2, 3, 4)), "the bits change nothing else")
  }
  rule("OP-11, B-54: access in the wrong direction is denied", some) { s =>
    import s._
    for (control <- Seq(EcatBuffer, EcatMailbox)) {
      syncManager(0, Area, 4, control)
      assert(put(Area, 1, 2, 3, 4))
      assert(get(Area, 4).isEmpty)
      hostPut(Area, 9, 9, 9, 9)
      assert(hostGet(Area, 4) == Seq(1, 2, 3, 4))
    }
    syncManager(0, Area, 4, PdiBuffer)
    assert(!put(Area, 9, 9, 9, 9))
  }
  rule("FP-28, FP-30: part of a datagram in a SyncManager counts if any byte does", some) { s =>
    import s._
    syncManager(0, Area + 4, 4, EcatMailbox)
    bench.hostWrite(Area + 3, 0)
    assert(put(Area + 3, 1, 2, 3, 4, 5) && bench.hostRead(Area + 3) == 1)
    assert(hostGet(Area + 4, 4) == Seq(2, 3, 4, 5))
    assert(put(Area + 4, 2, 3, 4, 5))
    assert(put(Area + 3, 9, 9, 9) && bench.hostRead(Area + 3) == 9)
    assert(hostGet(Area + 4, 4) == Seq(2, 3, 4, 5))
  }
  rule("B-51: of overlapping areas the lowest number rules", some) { s =>
    import s._
    syncManager(1, Area, 8, EcatMailbox)
    syncManager(0, Area + 2, 2, EcatMailbox)
    assert(put(Area, 1, 2))
    assert(!put(Area + 3, 9), "that of the lower number, not open")
    assert(put(Area + 2, 3, 4, 5, 6, 7, 8))
    assert(bench.hostRead(0x0805) == 9 && bench.hostRead(0x080d) == 9)
  }
  rule("B-55: reading looks ahead, so that a cut frame has touched a byte that it does not hold", some) { s =>
    import s._
    syncManager(0, Area, 4, PdiMailbox)
    hostPut(Area, 1, 2, 3, 4)
    assert(get(Area, 1).isDefined)
    val bytes = EtherCatFrame(Seq(Datagram(Aprd, 0, Area + 1, Seq.fill(60)(0))))
    // Cut before the last byte of the header: bytes 0 to 24, without and with the high nibble of byte 24.
    val nibbles = bytes.take(26).flatMap(b => Seq(b & 0xf, b >> 4))
    marked(bench.send(0, WireFrame.ofNibbles(nibbles.take(49))))
    assert(get(Area + 1, 1).isDefined, "not begun")
    marked(bench.send(0, WireFrame.ofNibbles(nibbles.take(50))))
    assert(get(Area + 1, 1).isEmpty, "touched, closed")
    assert(get(Area, 4).contains(Seq(1, 2, 3, 4)))
  }
  rule("B-52: a SyncManager whose first buffer ends beyond the RAM never closes", below) { s =>
    import s._
    val end = 0x1000 + p.ramBytes
    for (control <- Seq(EcatBuffer, EcatMailbox)) {
      syncManager(0, end - 2, 4, control | BothEvents)
      val before = bench.hostRead(0x0805)
      assert(put(end - 2, 1, 2, 3, 4), "two bytes of it exist")
      assert(!put(end, 3) && !put(end, 3, 4))
      assert((bench.hostRead(0x0805) & 0x3f) == before && (bench.hostRead(0x0221) & 1) == 0)
      assert(hostGet(end - 2, 4) == Seq(0, 0, 0, 0), "not complete")
    }
    for (control <- Seq(PdiBuffer, PdiMailbox)) {
      syncManager(0, end - 2, 4, control)
      hostPut(end - 2, 1, 2, 3, 4)
      assert(get(end - 2, 4).isEmpty)
    }
    syncManager(0, end, 4, EcatMailbox)
    assert(!put(end, 1, 2, 3, 4), "no byte exists")
    syncManager(0, 0xfffe, 4, EcatMailbox)
    assert(!put(0xfffe, 1, 2, 3, 4))
    assert(put(0x1000, 1) && bench.hostRead(0x1000) == 1, "the others are not harmed")
  }
  rule("B-52: bytes of buffers 1 and 2 beyond the RAM have no data, all else goes its way", below) { s =>
    val end = 0x1000 + s.p.ramBytes
    for (control <- Seq(EcatBuffer, PdiBuffer); start <- Seq(end - 6, end - 5, end - 4)) {
      val inSecond = end - start - 4 // bytes of buffer 1 that exist
      def there(b: Int, data: Int*) = data.zipWithIndex.map { case (d, i) =>
        if (b == 0 || (b == 1 && i < inSecond)) d else 0
      }
      s.syncManager(0, start, 4, control)
      val c = new Sides(s, control, start, 4)
      for ((buffer, n) <- Seq(0, 1, 2, 0).zipWithIndex) {
        val data = Seq(n + 1, n + 2, n + 3, n + 4)
        c.write(0, data: _*)
        assert((s.bench.hostRead(0x0805) >> 4) == buffer, s"write $n")
        assert(c.read(0, 4) == there(buffer, data: _*), s"buffer $buffer")
      }
    }
  }
  rule("B-52: a write that finds no byte of its buffer does not count", below) { s =>
    import s._
    val start = 0x1000 + p.ramBytes - 4
    syncManager(0, start, 4, EcatBuffer)
    assert(put(start, 1, 2, 3, 4) && hostGet(start, 4) == Seq(1, 2, 3, 4))
    assert(!put(start, 5, 6, 7, 8))
  }
}

package flyframe.rules

import flyframe.params.EscParams
import flyframe.protocol.Command._

/** Acknowledging by a write: PDI-09, SM-36 to SM-38 and B-104. */
object AcknowledgeRules extends Rules {
  private def built(p: EscParams)       = p.acknowledgesByWrite
  private def application(p: EscParams) = built(p) && p.hasApplicationLayer
  private def managers(p: EscParams)    = built(p) && p.syncManagers >= 2 && p.ramKiB >= 1
  private def held(p: EscParams)        = built(p) && p.syncSignals > 0 && p.syncPulse == 0
  private def latches(p: EscParams)     = built(p) && p.latchSignals > 0

  private val Area        = 0x1000
  private val EcatBuffer  = 0x34
  private val EcatMailbox = 0x36

  /** Bit `n` of 0x0220. */
  private def event(s: Steps, n: Int): Boolean = (s.bench.hostRead(0x0220 + n / 8) >> (n % 8) & 1) == 1
  private def status(s: Steps): Int            = s.bench.hostRead(0x0805) & 0x3f

  rule("PDI-09, SM-38, B-104: 0x014E tells of it", built) { s =>
    import s._
    assert(word(0x014e) == (if (p.hasSii) 7 else 5) && get(0x014e, 2).contains(Seq(word(0x014e), 0)))
    assert(!put(0x014e, 0))
    hostPut(0x014e, 0xff, 0xff)
    assert(word(0x014e) == (if (p.hasSii) 7 else 5))
  }
  rule("PDI-09, AL-04: of AL control", application) { s =>
    import s._
    for ((byte, state) <- Seq(0 -> 2, 1 -> 4)) {
      assert(put(0x0120, state, 0) && bench.hostRead(0x0120) == state && event(s, 0), "not by reading")
      assert(!put(0x0120, 8))
      bench.hostWrite(0x0120 + byte, 0xff)
      assert(!event(s, 0) && get(0x0120, 2).contains(Seq(state, 0)), "what is written is not stored")
    }
    assert(put(0x0120, 8))
  }
  rule("PDI-09, B-60: of all activations at once, by a write to 0x0806", managers) { s =>
    import s._
    assert(put(0x0806, 1) && put(0x080e, 1))
    assert(bench.hostRead(0x0806) == 1 && bench.hostRead(0x080e) == 1 && event(s, 4), "not by reading")
    bench.hostWrite(0x080e, 0)
    assert(event(s, 4), "nor by a write to another one")
    bench.hostWrite(0x0806, 0)
    assert(!event(s, 4) && bench.hostRead(0x0806) == 1 && bench.hostRead(0x080e) == 1)
    assert(put(0x080e, 3))
    assert(event(s, 4), "a new one")
    bench.hostWrite(0x080e, 0)
    assert(event(s, 4))
    bench.hostWrite(0x0806, 0)
    assert(!event(s, 4))
  }
  rule("PDI-09, WD-05: of an expired watchdog", p => application(p) && p.hasWatchdogs && managers(p)) { s =>
    import s._
    assert(put(0x0400, 12498 & 0xff, 12498 >> 8) && put(0x0420, 1, 0))
    syncManager(0, Area, 2, 0x44)
    assert(put(Area, 1, 2))
    bench.advanceMs(3)
    bench.hostRead(0x0440)
    assert(event(s, 6))
    bench.hostWrite(0x0440, 0)
    assert(!event(s, 6) && get(0x0440, 1).contains(Seq(0)))
  }
  rule("PDI-09, DC-30: of a SYNC signal", held) { s =>
    import s._
    def wide(value: BigInt) = (0 until p.clockBytes).map(i => (value >> (8 * i) & 0xff).toInt)
    val now = hostGet(0x0910, p.clockBytes).zipWithIndex.map { case (b, i) => BigInt(b) << (8 * i) }.sum
    hostPut(0x0990, wide(now + 100000): _*)
    assert(put(0x0990, wide(now + 100000): _*) && put(0x0981, 3))
    bench.advanceUs(150)
    assert(bench.hostRead(0x098e) == 1 && bench.syncLevel(0))
    bench.hostWrite(0x098e, 0)
    bench.advanceUs(1)
    assert(bench.hostRead(0x098e) == 0 && !bench.syncLevel(0))
  }
  rule("PDI-09, DC-40: of a LATCH by the first byte of its time", latches) { s =>
    import s._
    assert(put(0x0980, 0x10))
    bench.hostWrite(0x09a8, 3)
    for ((time, bit, level) <- Seq((0x09b0, 1, true), (0x09b8, 2, false))) {
      bench.setLatch(0, level)
      hostGet(time, 4)
      assert((bench.hostRead(0x09ae) & 3) == bit, "not by reading")
      val first = hostGet(time, 4)
      bench.hostWrite(time + 1, 0)
      assert((bench.hostRead(0x09ae) & 3) == bit, "nor by the second byte")
      bench.hostWrite(time, 0)
      assert((bench.hostRead(0x09ae) & 3) == 0 && hostGet(time, 4) == first)
    }
  }
  rule("SM-36, B-104: a buffer that the host reads is open until it writes the last byte", managers) { s =>
    import s._
    syncManager(0, Area, 4, EcatBuffer)
    assert(put(Area, 1, 2, 3, 4))
    hostPut(Area, 9, 9, 9, 9)
    assert(status(s) == 0x01, "it has not been opened")
    for (_ <- 1 to 2) assert(hostGet(Area, 4) == Seq(1, 2, 3, 4))
    assert(status(s) == 0x00 && !event(s, 8))
    assert(put(Area, 5, 6, 7, 8) && hostGet(Area, 4) == Seq(1, 2, 3, 4), "it is still open")
    hostPut(Area, 9, 9, 9)
    assert(hostGet(Area, 4) == Seq(1, 2, 3, 4), "not the last byte")
    bench.hostWrite(Area + 3, 9)
    assert((status(s) & 0x0f) == 0x03 && hostGet(Area, 4) == Seq(5, 6, 7, 8), "closed, and not stored")
  }
  rule("SM-36, B-104: an open buffer that is read again keeps the event of a newer one", managers) { s =>
    import s._
    syncManager(0, Area, 4, EcatBuffer)
    assert(put(Area, 1, 2, 3, 4) && event(s, 8))
    assert(bench.hostRead(Area) == 1 && !event(s, 8))
    assert(put(Area, 5, 6, 7, 8) && event(s, 8))
    assert(hostGet(Area, 4) == Seq(1, 2, 3, 4) && event(s, 8), "what is read is the old one")
    bench.hostWrite(Area + 3, 0)
    assert(event(s, 8) && hostGet(Area, 4) == Seq(5, 6, 7, 8) && !event(s, 8))
  }
  rule("SM-36: a mailbox that the host reads is full until it writes the last byte", managers) { s =>
    import s._
    syncManager(1, Area, 4, EcatMailbox)
    for (n <- 1 to 2) {
      assert(put(Area, n, 2, 3, 4) && event(s, 9))
      assert(hostGet(Area, 4) == Seq(n, 2, 3, 4) && !event(s, 9))
      assert(!put(Area, 5, 6, 7, 8))
      bench.hostWrite(Area + 3, 9)
      assert(hostGet(Area, 4) == Seq(0, 0, 0, 0), "empty")
    }
    assert(put(Area, 5, 6, 7, 8))
  }
  rule("SM-36, B-104: what the host writes is closed as ever, and ECAT closes by reading", managers) { s =>
    import s._
    for (control <- Seq(0x30, 0x32)) {
      syncManager(0, Area, 4, control)
      hostPut(Area, 1, 2, 3, 4)
      assert((status(s) & 3) == 1 && get(Area, 4).contains(Seq(1, 2, 3, 4)) && (status(s) & 3) == 2)
    }
  }
  rule("SM-36, B-104: of one byte reading is the beginning, and a write the end", managers) { s =>
    import s._
    syncManager(0, Area, 1, EcatBuffer)
    assert(put(Area, 7) && (status(s) & 3) == 1)
    assert(bench.hostRead(Area) == 7 && (status(s) & 3) == 0)
    bench.hostWrite(Area, 9)
    assert((status(s) & 3) == 2 && bench.hostRead(Area) == 7, "it is not stored")
  }
  rule("SM-37: a word that is read opens the buffer that begins within it", p => managers(p) && p.lanes > 1) {
    s =>
      import s._
      syncManager(0, Area - 1 + p.lanes, 2, EcatMailbox) // its first byte is the last one of a word
      syncManager(1, Area, p.lanes - 1, EcatMailbox)
      assert(put(Area - 1 + p.lanes, 8, 9) && put(Area, Seq.fill(p.lanes - 1)(5): _*))
      assert(bench.hostReadWord(Area) == Seq.fill(p.lanes - 1)(5) :+ 8)
      assert(bench.hostRead(Area + p.lanes) == 9, "of the second one, which is open")
      bench.hostWrite(Area + p.lanes, 0)
      assert((bench.hostRead(0x0805) & 8) == 0 && (bench.hostRead(0x080d) & 8) == 8, "each by itself")
      bench.hostWrite(Area + p.lanes - 2, 0)
      assert((bench.hostRead(0x080d) & 8) == 0)
  }
}

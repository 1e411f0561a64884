package flyframe.rules

import flyframe.model._
import flyframe.params.EscParams
import flyframe.protocol.Command._

/** Write protection of registers and of the whole controller: SYS-02, SYS-03, OP-22 and B-110. */
object ProtectionRules extends Rules {
  private def built(p: EscParams) = p.hasWriteProtection && p.maxSubTelegrams > 2

  private val (registerEnable, registers) = (0x0020, 0x0021)
  private val (escEnable, everything)     = (0x0030, 0x0031)
  private val (station, alias)            = (0x0010, 0x0012)
  private val (userRam, processRam)       = (0x0f80, 0x1000)

  private def setting(address: Int, data: Int*): Datagram = Datagram(Apwr, 0, address, data)

  /** The working counters of one frame. */
  private def counters(s: Steps)(datagrams: Datagram*): Seq[Int] =
    s.exchange(datagrams: _*).map(_.workingCounter)

  rule("SYS-02, OP-22: protected registers are written by a frame that has enabled it, RAM by any", built) {
    s =>
      import s._
      assert(put(station, 1) && put(registers, 1))
      assert(!put(station, 2) && word(station) == 1, "without")
      for ((value, n) <- Seq(1, 0, 0xfe).zipWithIndex) {
        val frame = Seq(setting(registerEnable, value), setting(station, 3 + n), setting(station + 1, 0))
        assert(counters(s)(frame: _*) == Seq(1, 1, 1) && word(station) == 3 + n, s"enabled by $value")
        assert(!put(station, 2) && word(station) == 3 + n, "in the frame behind it")
      }
      assert(counters(s)(setting(station, 2), setting(registerEnable, 1)) == Seq(0, 1), "enabled too late")
      assert(word(station) == 5)
      assert(!put(0x0300, 0), "a counter")
      assert(
        put(userRam, 7) && put(processRam, 8) && hostGet(userRam, 1) ++ hostGet(processRam, 1) == Seq(7, 8)
      )
  }
  rule("SYS-02: what is switched off by an enabled frame needs no enable any more", built) { s =>
    import s._
    assert(put(registers, 1) && !put(registers, 0) && bench.hostRead(registers) == 1)
    assert(put(escEnable, 1) && !put(registers, 0), "the other enable")
    assert(counters(s)(setting(registerEnable, 1), setting(registers, 0)) == Seq(1, 1))
    assert(bench.hostRead(registers) == 0 && put(station, 9) && word(station) == 9)
  }
  rule("SYS-02, B-110: the enable counts from the next byte on, and for its frame only", built) { s =>
    import s._
    assert(put(registers, 1))
    spoiled(setting(registerEnable, 1))
    assert(!put(station, 3), "enabled by a bad frame before")
    assert(put(registerEnable, 1, 0) && bench.hostRead(registers) == 0, "both bytes in one datagram")
  }
  rule("SYS-03, OP-22: while all is protected only the enables are written by any frame", built) { s =>
    import s._
    assert(put(userRam, 1) && put(processRam, 2) && put(station, 3) && put(everything, 1))
    for (address <- Seq(userRam, processRam, station, registers, everything)) assert(!put(address, 0))
    assert(hostGet(userRam, 1) ++ hostGet(processRam, 1) ++ hostGet(station, 1) == Seq(1, 2, 3))
    assert(get(processRam, 1).contains(Seq(2)), "reading")
    assert(counters(s)(setting(registerEnable, 1), setting(userRam, 0)) == Seq(1, 0), "the other enable")
    assert(
      counters(s)(setting(escEnable, 0), setting(processRam, 4), setting(station, 5)) == Seq(1, 1, 1)
    )
    assert(hostGet(processRam, 1) ++ hostGet(station, 1) == Seq(4, 5))
    assert(!put(processRam, 0) && counters(s)(setting(escEnable, 1), setting(everything, 0)) == Seq(1, 1))
    assert(put(processRam, 6) && hostGet(processRam, 1) == Seq(6))
  }
  rule("SYS-03: with both protections registers need both enables, RAM needs that of all", built) { s =>
    import s._
    assert(
      put(registers, 1, 0) && counters(s)(setting(registerEnable, 1), setting(everything, 1)) == Seq(1, 1)
    )
    assert(counters(s)(setting(registerEnable, 1), setting(station, 1), setting(userRam, 1)) == Seq(1, 0, 0))
    assert(counters(s)(setting(escEnable, 1), setting(station, 2), setting(userRam, 2)) == Seq(1, 0, 1))
    assert(
      counters(s)(setting(registerEnable, 1), setting(escEnable, 1), setting(station, 3)) == Seq(1, 1, 1)
    )
    assert(word(station) == 3 && bench.hostRead(userRam) == 2)
  }
  rule("SYS-02, SYS-03: what is refused does not count, what is read does", built) { s =>
    import s._
    val both = Datagram(Aprw, 0, processRam, Seq(5))
    assert(put(processRam, 4) && put(everything, 1))
    assert(one(both).workingCounter == 1 && counters(s)(setting(escEnable, 1), both) == Seq(1, 3))
    // Of a datagram in which a byte may be written that byte counts.
    assert(put(escEnable - 1, 0, 1, 0) && bench.hostRead(everything) == 0, "enabled by its second byte")
  }
  rule("SYS-02, SYS-03: the host writes what it may", built) { s =>
    import s._
    assert(put(registers, 1) && counters(s)(setting(registerEnable, 1), setting(everything, 1)) == Seq(1, 1))
    hostPut(alias, 0x34)
    hostPut(processRam, 0x56)
    for (address <- Seq(registerEnable, registers, escEnable, everything)) hostPut(address, 0)
    assert(bench.hostRead(alias) == 0x34 && bench.hostRead(processRam) == 0x56)
    assert(hostGet(registers, 1) ++ hostGet(everything, 1) == Seq(1, 1))
  }
  rule("B-110: an enable shows until the next frame, and only while there is something to enable", built) {
    s =>
      import s._
      def shown(datagrams: Datagram*) =
        exchange(datagrams :+ Datagram(Aprd, 0, registerEnable, Seq(0)): _*).last.data.head
      assert(shown(setting(registerEnable, 1)) == 0 && bench.hostRead(registerEnable) == 0)
      assert(put(registers, 1) && shown() == 0)
      assert(shown(setting(registerEnable, 0)) == 1 && bench.hostRead(registerEnable) == 1)
      assert(bench.hostRead(escEnable) == 0 && shown() == 0 && bench.hostRead(registerEnable) == 0)
      assert(counters(s)(setting(registerEnable, 1), setting(registers, 0)) == Seq(1, 1))
      assert(bench.hostRead(registerEnable) == 0)
  }
  rule(
    "SYS-03, SM-01: a refused byte does not open a buffer, nor close one",
    p => built(p) && p.syncManagers > 0
  ) { s =>
    import s._
    def full = (bench.hostRead(0x0805) & 8) != 0
    syncManager(0, processRam, 4, 0x26) // a mailbox that the bus writes
    assert(put(everything, 1) && !put(processRam, 1, 2, 3, 4) && !full)
    assert(
      counters(s)(setting(processRam, 1), setting(escEnable, 1), setting(processRam + 1, 2, 3, 4)) == Seq(
        0,
        1,
        0
      )
    )
    assert(counters(s)(setting(escEnable, 1), setting(processRam, 1, 2, 3)) == Seq(1, 1))
    assert(!put(processRam + 3, 4) && !full, "open, but its end is refused")
    assert(counters(s)(setting(escEnable, 1), setting(processRam + 3, 4)) == Seq(1, 1) && full)
    assert(hostGet(processRam, 4) == Seq(1, 2, 3, 4))
  }
  rule("SYS-03, FMMU-05: what a FMMU leads to is protected, too", p => built(p) && p.fmmus > 0) { s =>
    import s._
    fmmu(0, 0x10000, 4, processRam, 2)
    assert(put(processRam, 1, 2, 3, 4) && put(everything, 1))
    assert(logical(Lwr, 0x10000, 5, 6, 7, 8).workingCounter == 0)
    assert(hostGet(processRam, 4) == Seq(1, 2, 3, 4))
    assert(counters(s)(setting(escEnable, 1), Datagram(Lwr, 0x10000L, Seq(5, 6, 7, 8))) == Seq(1, 1))
    assert(hostGet(processRam, 4) == Seq(5, 6, 7, 8))
  }
  rule("SYS-02: digital outputs are registers", p => built(p) && p.digitalOutputs > 0) { s =>
    import s._
    assert(put(0x0f00, 1) && put(registers, 1) && !put(0x0f00, 2) && bench.hostRead(0x0f00) == 1)
    assert(counters(s)(setting(registerEnable, 1), setting(0x0f00, 2)) == Seq(1, 1))
    assert(bench.hostRead(0x0f00) == 2)
  }
  rule("SYS-02, DC-07: a refused write has no receive times kept", p => built(p) && p.hasClocks) { s =>
    import s._
    assert(put(0x0900, 0) && put(registers, 1))
    val before = hostGet(0x0918, 4)
    bench.advanceUs(20)
    assert(!put(0x0900, 0) && hostGet(0x0918, 4) == before)
    assert(counters(s)(setting(registerEnable, 1), setting(0x0900, 0)) == Seq(1, 1))
    assert(hostGet(0x0918, 4) != before)
  }
}

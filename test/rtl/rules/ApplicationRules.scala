package flyframe.rules

import flyframe.model.Datagram
import flyframe.params.EscParams
import flyframe.protocol.Command._

/** AL control and status, events and interrupts: rule groups AL and IRQ. */
object ApplicationRules extends Rules {
  private def al(p: EscParams)        = p.hasApplicationLayer
  private def managers(p: EscParams)  = al(p) && p.syncManagers >= 2 && p.ramKiB >= 1
  private def watchdogs(p: EscParams) = al(p) && p.hasWatchdogs
  private def two(p: EscParams)       = al(p) && p.ports >= 2

  rule("AL-01, AL-02: after reset AL control and status are Init, the code is 0", al) { s =>
    import s._
    assert(get(0x0120, 2).contains(Seq(1, 0)))
    assert(get(0x0130, 2).contains(Seq(1, 0)))
    assert(get(0x0134, 2).contains(Seq(0, 0)))
    assert(word(0x0130) == 1)
  }
  rule("AL-03, AL-04: every state is stored and signalled, whatever it is", al) { s =>
    import s._
    for (state <- Seq(2, 4, 8, 1, 3, 1, 15, 0x12)) {
      assert(put(0x0120, state, 0))
      assert((bench.hostRead(0x0220) & 1) == 1)
      assert(bench.hostRead(0x0120) == state)
      assert((bench.hostRead(0x0220) & 1) == 0)
      assert(bench.hostRead(0x0130) == 1, "only the host writes the status")
    }
  }
  rule("AL-04: until the host has read AL control it cannot be written, which does not count", al) { s =>
    import s._
    assert(put(0x0120, 2, 0))
    assert(!put(0x0120, 4, 0))
    assert(!put(0x0121, 0))
    assert(get(0x0120, 1).contains(Seq(2)), "ECAT reading does not open it")
    assert(!put(0x0120, 4))
    assert(bench.hostRead(0x0120) == 2)
    assert(put(0x0120, 4))
    assert(bench.hostRead(0x0120) == 4)
  }
  rule("AL-04, B-40: the state before the frame decides for the whole frame", al) { s =>
    import s._
    val r = exchange(Datagram(Apwr, 0, 0x0120, Seq(2)), Datagram(Apwr, 0, 0x0120, Seq(4)))
    assert(r.map(_.workingCounter) == Seq(1, 1))
    assert(bench.hostRead(0x0120) == 4)
  }
  rule("AL-04, FP-33: a bad frame writes no AL control and raises no event", al) { s =>
    import s._
    spoiled(Datagram(Apwr, 0, 0x0120, Seq(2, 0)))
    assert((bench.hostRead(0x0220) & 1) == 0)
    assert(bench.hostRead(0x0120) == 1)
  }
  rule("AL-05, AL-07: without emulation AL status does not follow AL control", al) { s =>
    import s._
    assert(put(0x0120, 0x12))
    assert(get(0x0130, 1).contains(Seq(1)))
  }
  rule("AL-06: the host writes status and code, also unasked; ECAT cannot", al) { s =>
    import s._
    hostPut(0x0130, 0x14, 0x00)
    hostPut(0x0134, 0x1b, 0x80)
    assert(get(0x0130, 6).contains(Seq(0x14, 0, 0, 0, 0x1b, 0x80)))
    assert(!put(0x0130, 1, 0) && !put(0x0134, 0, 0))
    hostPut(0x0130, 0xff, 0xff)
    assert(word(0x0130) == 0x7f, "reserved bits")
  }

  rule("IRQ-01: the interrupt is the OR of requests and mask, a level", al) { s =>
    import s._
    assert(!bench.interrupt)
    assert(put(0x0120, 2))
    assert(bench.interrupt)
    bench.hostWrite(0x0204, 0)
    assert(!bench.interrupt)
    bench.hostWrite(0x0204, 1)
    assert(bench.interrupt)
    bench.hostRead(0x0120)
    assert(!bench.interrupt)
  }
  rule("IRQ-01: masks after reset, and what of them is writable", al) { s =>
    import s._
    val sms    = ((1L << p.syncManagers) - 1) << 8
    def mask   = hostGet(0x0204, 4).zipWithIndex.map { case (b, i) => b.toLong << 8 * i }.sum
    val clocks = (if (p.latchSignals > 0) 2 else 0) | (0 until p.syncSignals).map(4 << _).sum
    assert(mask == (sms | clocks | 1))
    hostPut(0x0204, 0xff, 0xff, 0xff, 0xff)
    assert(mask == (sms | clocks | 0x71))
    assert(!put(0x0204, 0) && mask == (sms | clocks | 0x71), "ECAT cannot write it")
    assert(put(0x0200, 0xa5, 0x5a))
    assert(word(0x0200) == 0x5aa5)
    bench.hostWrite(0x0200, 0)
    assert(word(0x0200) == 0x5aa5, "the host cannot write it")
  }
  rule("IRQ-02, B-60: the activation event lasts until all changed ones were read", managers) { s =>
    import s._
    def event = bench.hostRead(0x0220) >> 4 & 1
    assert(event == 0)
    assert(put(0x0806, 1) && put(0x080e, 1))
    assert(event == 1)
    assert(bench.hostRead(0x0806) == 1 && event == 1)
    assert(bench.hostRead(0x080e) == 1 && event == 0)
    assert(put(0x0806, 1) && event == 0, "not changed")
    assert(put(0x0806, 3) && event == 1)
    assert(get(0x0806, 1).contains(Seq(3)) && event == 1, "ECAT reading ends nothing")
    assert(bench.hostRead(0x0806) == 3 && event == 0)
    spoiled(Datagram(Apwr, 0, 0x0806, Seq(0)))
    assert(event == 0)
  }
  rule("IRQ-02: a SyncManager's event ends with the first byte of the next access", managers) { s =>
    import s._
    syncManager(1, 0x1000, 4, 0x36) // mailbox, ECAT writes, both events
    def event = bench.hostRead(0x0221) >> 1 & 1
    assert(put(0x1000, 1, 2, 3, 4))
    assert(event == 1)
    assert(bench.hostRead(0x1000) == 1 && event == 0)
    def forMaster = bench.hostRead(0x0210) >> 5 & 1
    assert(hostGet(0x1001, 3) == Seq(2, 3, 4) && event == 0 && forMaster == 1, "read completely")
    assert(put(0x1000, 5) && forMaster == 0)
  }
  rule(
    "IRQ-02, B-61: the watchdog event ends with the host's read of 0x0440",
    p => watchdogs(p) && managers(p)
  ) { s =>
    import s._
    assert(put(0x0420, 10, 0)) // 1 ms
    syncManager(0, 0x1000, 2, 0x44)
    assert(put(0x1000, 1, 2))
    assert((bench.hostRead(0x0220) & 0x40) == 0)
    bench.advanceMs(2)
    assert((bench.hostRead(0x0220) & 0x40) == 0x40)
    assert(get(0x0440, 1).contains(Seq(0)) && (bench.hostRead(0x0220) & 0x40) == 0x40)
    assert(bench.hostRead(0x0440) == 0 && (bench.hostRead(0x0220) & 0x40) == 0)
  }
  rule("IRQ-03: reading any byte of AL control acknowledges", al) { s =>
    import s._
    assert(put(0x0120, 2))
    assert(bench.hostRead(0x0121) == 0)
    assert((bench.hostRead(0x0220) & 1) == 0)
    bench.hostRead(0x011f)
    assert(put(0x0120, 4))
    bench.hostRead(0x0122)
    assert((bench.hostRead(0x0220) & 1) == 1, "a neighbour is no part of it")
  }
  rule("IRQ-05: an acknowledging read returns the value and clears in one step", al) { s =>
    import s._
    hostPut(0x0130, 2)
    val r = exchange(
      Datagram(Aprd, 0, 0x0210, Seq(0, 0)),
      Datagram(Aprd, 0, 0x0130, Seq(0, 0)),
      Datagram(Aprd, 0, 0x0210, Seq(0, 0))
    )
    assert((r.head.data.head & 8) == 8 && r(1).data == Seq(2, 0))
    assert((r(2).data.head & 8) == 8, "ends with the frame")
    assert((bench.hostRead(0x0210) & 8) == 0)
  }
  rule("IRQ-06, IRQ-02: polling 0x0220 acknowledges nothing", al) { s =>
    import s._
    assert(put(0x0120, 2))
    for (_ <- 0 until 3) assert((bench.hostRead(0x0220) & 1) == 1)
    assert(get(0x0220, 4).exists(b => (b.head & 1) == 1))
    assert((bench.hostRead(0x0220) & 1) == 1)
  }
  rule("IRQ-07: a SyncManager requests only if enabled to, and after a complete access", managers) { s =>
    import s._
    for ((control, al, ecat) <- Seq((0x04, 0, 0), (0x14, 0, 0), (0x24, 1, 0), (0x34, 1, 0))) {
      syncManager(0, 0x1000, 4, control)
      assert(put(0x1000, 1, 2, 3))
      assert((bench.hostRead(0x0221) & 1) == 0 && (bench.hostRead(0x0210) & 0x10) == 0, "not complete")
      spoiled(Datagram(Apwr, 0, 0x1000, Seq(1, 2, 3, 4)))
      assert((bench.hostRead(0x0221) & 1) == 0 && (bench.hostRead(0x0210) & 0x10) == 0, "not successful")
      assert(put(0x1000, 1, 2, 3, 4))
      assert((bench.hostRead(0x0221) & 1) == al)
      assert((bench.hostRead(0x0210) >> 4 & 1) == ecat)
    }
  }
  rule("IRQ-08, B-43: every datagram's IRQ field is ORed with request and mask", al) { s =>
    import s._
    hostPut(0x0130, 2)
    get(0x0110, 2)
    assert(word(0x0210) == 8)
    assert(read(Nop, 0, 0, 1).irq == 0, "masked")
    assert(put(0x0200, 8, 0))
    val nop = Datagram(Nop, 0, 0, Seq(0))
    val r   = exchange(nop.copy(irq = 0x8001), nop, Datagram(Fprd, 0x7777, 0, Seq(0)))
    assert(r.map(_.irq) == Seq(0x8009, 8, 8))
    assert(exchange(nop, Datagram(Aprd, 0, 0x0131, Seq(0)), nop).map(_.irq) == Seq(8, 8, 8))
    assert(exchange(nop).map(_.irq) == Seq(0))
    assert(put(0x0200, 0, 0))
  }
  rule("IRQ-08, B-42: DL status and AL status events rise with a change and end with an ECAT read", two) {
    s =>
      import s._
      assert((word(0x0210) & 4) == 4, "the first link after reset")
      assert(get(0x0111, 1).isDefined && (word(0x0210) & 4) == 0)
      bench.setLink(1, up = false)
      assert((word(0x0210) & 4) == 4)
      bench.setLink(1, up = true)
      assert((word(0x0210) & 4) == 4)
      spoiled(Datagram(Aprd, 0, 0x0110, Seq(0, 0)))
      assert((word(0x0210) & 4) == 4, "a bad frame acknowledges nothing")
      bench.hostRead(0x0110)
      assert((word(0x0210) & 4) == 4, "nor does the host")
      get(0x0110, 1)
      assert((word(0x0210) & 4) == 0)
      hostPut(0x0130, 1)
      assert((word(0x0210) & 8) == 0, "the value did not change")
      hostPut(0x0130, 4)
      assert((word(0x0210) & 8) == 8)
      get(0x0130, 1)
      assert((word(0x0210) & 8) == 0)
  }
  rule("IRQ-09, WD-07: the watchdog status of the host is part of DL status", watchdogs) { s =>
    import s._
    bench.hostRead(0x0000)
    assert((get(0x0110, 1).get.head & 2) == 2)
    assert(put(0x0410, 10, 0))
    bench.advanceMs(2)
    assert((get(0x0110, 1).get.head & 2) == 0)
    assert(get(0x0448, 1).contains(Seq(0)) && get(0x0443, 1).contains(Seq(1)))
  }
  rule("IRQ-09, B-42: the expiry of the host's watchdog raises the DL status event", watchdogs) { s =>
    import s._
    def event = (get(0x0210, 1).get.head & 4) != 0 // read by the bus, as the host's accesses trigger
    assert(put(0x0410, 10, 0))
    for (step <- Seq(() => bench.hostRead(0x0000), () => bench.advanceMs(2), () => bench.hostRead(0x0000))) {
      step()
      get(0x0110, 2)
      assert(!event, "read")
    }
    bench.advanceMs(2)
    assert(event, "expired")
    get(0x0110, 1)
    assert(!event, "read")
    bench.hostRead(0x0000)
    assert(event, "runs again")
  }
}

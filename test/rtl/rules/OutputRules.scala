package flyframe.rules

import flyframe.model.Datagram
import flyframe.params.EscParams
import flyframe.protocol.Command._

/** Digital outputs at 0x0F00: SM-26, PDI-11, and the one register that FMMUs write bit by bit. */
object OutputRules extends Rules {
  private def some(p: EscParams) =
    p.digitalOutputs == 4 && p.hasWatchdogs && p.syncManagers >= 1 && p.ramKiB >= 1
  private def bits(p: EscParams) = some(p) && p.hasBitwiseFmmus
  private val Write              = 2

  rule("SM-26, PDI-11, WD-05, B-68: digital outputs are driven while the process data watchdog runs", some) {
    s =>
      import s._
      assert(put(0x0420, 10, 0) && bench.outputs.isEmpty, "not before a trigger")
      syncManager(0, 0x0f00, 1, 0x44)
      syncManager(1, 0x0f01, 1, 0x44)
      assert(put(0x0f00, 0x5a) && bench.outputs.contains(0x5a))
      assert(put(0x0f01, 0x81) && bench.outputs.contains(0x815a))
      bench.advanceMs(2)
      assert(bench.outputs.isEmpty && get(0x0440, 1).contains(Seq(0)))
      assert(get(0x0f00, 4).contains(Seq(0x5a, 0x81, 0, 0)), "the register stays")
      assert(put(0x0f00, 0x5b) && bench.outputs.contains(0x815b))
      bench.setLoaded(false)
      assert(bench.outputs.isEmpty, "local configuration not loaded")
  }
  rule("SM-26, SM-21: a write to an output byte raises the event of its SyncManager", some) { s =>
    import s._
    syncManager(0, 0x0f02, 1, 0x64)
    assert(put(0x0f02, 1) && (bench.hostRead(0x0221) & 1) == 1)
    assert(bench.hostRead(0x0f02) == 1 && (bench.hostRead(0x0221) & 1) == 0, "the host reads it")
  }
  rule("PDI-11, FP-33: the host only reads the outputs, a bad frame changes none", some) { s =>
    import s._
    assert(put(0x0f00, 1, 2, 3, 4))
    bench.hostWrite(0x0f00, 9)
    spoiled(Datagram(Apwr, 0, 0x0f01, Seq(9)))
    assert(hostGet(0x0f00, 5) == Seq(1, 2, 3, 4, 0) && !put(0x0f04, 1) && get(0x0f04, 1).isEmpty)
  }
  rule("FMMU-03, FMMU-10: the vector writes 14 bits of the digital outputs and no other", bits) { s =>
    import s._
    fmmu(0, 0x00010011L, 3, (3, 0, 1), 0x0f01, Write)
    assert(put(0x0f00, 0xff, 0xff, 0xff, 0xff))
    assert(logical(Lwr, 0x00010011L, 0, 0, 0).workingCounter == 1)
    assert(get(0x0f00, 4).contains(Seq(0xff, 0x01, 0x80, 0xff)))
    assert(put(0x0f00, 0, 0, 0, 0))
    assert(logical(Lwr, 0x00010011L, 0xff, 0xff, 0xff).workingCounter == 1)
    assert(get(0x0f00, 4).contains(Seq(0, 0xfe, 0x7f, 0)))
  }
  rule("FMMU-10: FMMUs and datagrams of one frame write different bits of one output byte", bits) { s =>
    import s._
    assert(put(0x0f00, 0x81))
    fmmu(0, 0x100, 1, (4, 6, 1), 0x0f00, Write)
    fmmu(1, 0x110, 1, (0, 1, 5), 0x0f00, Write)
    syncManager(0, 0x0f00, 1, 0x44)
    val replies = exchange(Datagram(Lwr, 0x100L, Seq(0x50)), Datagram(Lwr, 0x110L, Seq(0x02)))
    assert(replies.map(_.workingCounter) == Seq(1, 1))
    assert(get(0x0f00, 1).contains(Seq(0x81 | 0x5 << 1 | 0x2 << 5)))
  }

  private def general(p: EscParams) = p.generalOutputs > 0
  rule(
    "PDI-10, FP-37: bus and host write the general purpose outputs, at the end of the frame or access",
    general
  ) { s =>
    import s._
    val count                   = p.generalOutputs
    val some                    = Seq.tabulate(count)(i => 0x81 + i * 0x11 & 0xff)
    val others                  = some.map(~_ & 0xff)
    def number(bytes: Seq[Int]) = bytes.zipWithIndex.map { case (b, i) => BigInt(b) << 8 * i }.sum
    assert(bench.generalOutputs == 0)
    assert(put(0x0f10, some: _*) && bench.generalOutputs == number(some))
    hostPut(0x0f10, others: _*)
    assert(bench.generalOutputs == number(others) && get(0x0f10, count).contains(others))
    assert(hostGet(0x0f10, count) == others)
    spoiled(Datagram(Apwr, 0, 0x0f10, Seq(0x55)))
    assert(bench.generalOutputs == number(others), "a bad frame")
    bench.setLoaded(false)
    assert(bench.generalOutputs == number(others), "no watchdog, and no EEPROM")
    bench.setLoaded(true)
    assert(!put(0x0f10 + count, 1) || count == 8)
  }
  rule("PDI-10: bus and host see the general purpose inputs, and do not write them", _.generalInputs > 0) {
    s =>
      import s._
      val count = p.generalInputs
      for (seed <- Seq(0x00, 0xff, 0x5a, 0x81)) {
        val bytes = Seq.tabulate(count)(i => seed ^ (i * 0x1d & 0xff))
        bench.setGeneralInputs(bytes.zipWithIndex.map { case (b, i) => BigInt(b) << 8 * i }.sum)
        assert(get(0x0f18, count).contains(bytes) && hostGet(0x0f18, count) == bytes)
      }
      val before = hostGet(0x0f18, count)
      bench.hostWrite(0x0f18, 0x33)
      assert(!put(0x0f18, 0x77) && hostGet(0x0f18, count) == before)
      assert(get(0x0f18 + count, 1).isEmpty || count == 8)
  }
}

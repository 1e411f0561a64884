package flyframe.rules

import flyframe.model._
import flyframe.params.EscParams
import flyframe.protocol.Command._

/** The reset sequences: SYS-04 and B-72. */
object ResetRules extends Rules {
  private def built(p: EscParams) = p.hasResetRegisters
  private val sequence            = Seq(0x52, 0x45, 0x53)

  rule("SYS-04, B-72: three frames with the sequence ask for a reset", built) { s =>
    import s._
    for ((byte, progress) <- sequence.zip(1 to 3)) {
      assert(!bench.resetRequested && put(0x0040, byte) && bench.hostRead(0x0040) == progress)
    }
    assert(bench.resetRequested)
    get(0, 1)
    get(0, 1)
    assert(bench.resetRequested, "until the reset")
    bench.reset()
    assert(!bench.resetRequested && bench.hostRead(0x0040) == 0)
  }
  rule("SYS-04, B-72: three commands of the host with the sequence ask for a reset", built) { s =>
    import s._
    for (byte <- sequence) {
      assert(!bench.resetRequested)
      bench.hostWrite(0x0041, byte)
    }
    assert(bench.resetRequested && get(0x0041, 1).contains(Seq(3)))
    bench.hostRead(0)
    assert(bench.resetRequested)
  }
  rule("SYS-04, B-72: a frame that does not write the next value ends the sequence", built) { s =>
    import s._
    val bytes = EtherCatFrame(Seq(Datagram(Apwr, 0, 0x0040, Seq(sequence(1)))))
    val others = Seq[() => Any](
      () => get(0, 1),
      () => put(0x0040, 0x52),
      () => put(0x0041, 0x45),
      () => put(0x0040, 0),
      () => bench.send(0, WireFrame.ofBytes(bytes ++ Fcs.of(bytes).map(_ ^ 0x10)))
    )
    for (other <- others) {
      assert(put(0x0040, sequence.head))
      other()
      assert(put(0x0040, sequence(1)) && bench.hostRead(0x0040) == 0)
    }
    for (_ <- 0 until 2; byte <- sequence.take(2)) assert(put(0x0040, byte))
    assert(bench.hostRead(0x0040) == 0 && !bench.resetRequested, "the first value is not the third")
  }
  rule("SYS-04, B-72: a frame goes on by one value only", p => built(p) && p.maxSubTelegrams > 1) { s =>
    import s._
    exchange(sequence.take(2).map(byte => Datagram(Apwr, 0, 0x0040, Seq(byte))): _*)
    assert(bench.hostRead(0x0040) == 0)
    assert(put(0x0040, sequence.head) && bench.hostRead(0x0040) == 1)
  }
  rule("SYS-04, B-72: any other command of the host ends its sequence, frames do not", built) { s =>
    import s._
    for (other <- Seq[() => Any](() => bench.hostRead(0x0041), () => bench.hostWrite(0x0f80, 0))) {
      bench.hostWrite(0x0041, sequence.head)
      other()
      bench.hostWrite(0x0041, sequence(1))
      assert(get(0x0041, 1).contains(Seq(0)))
    }
    for (byte <- sequence) {
      bench.hostWrite(0x0041, byte)
      get(0, 1)
    }
    assert(bench.resetRequested)
  }
  rule(
    "SYS-04, B-72, B-62: an access that a SyncManager denies is a command of the host, too",
    p => built(p) && p.syncManagers > 0
  ) { s =>
    import s._
    syncManager(0, 0x1000, 4, 0x26) // a mailbox that the host reads, and empty
    for (other <- Seq[() => Any](() => bench.hostRead(0x1000), () => bench.hostWrite(0x1000, 1))) {
      bench.hostWrite(0x0041, sequence.head)
      other()
      bench.hostWrite(0x0041, sequence(1))
      assert(get(0x0041, 1).contains(Seq(0)))
    }
    // An access that is allowed is none of the sequence, either.
    bench.hostWrite(0x0041, sequence.head)
    bench.hostWrite(0x0f80, 7)
    bench.hostWrite(0x0041, sequence(1))
    assert(get(0x0041, 1).contains(Seq(0)))
  }
}

package flyframe.can

/** Conformance cases 7.5: an error-passive receiver. */
abstract class PassiveReceiverCases extends CanCases {
  import CanCases._

  /** A bad frame at a passive receiver; the next bit is the first of its flag. */
  private def passive(t: LowerTester): Unit = {
    passiveReceiver(t)
    badFrame(t)
  }

  /** The next frame is acknowledged: what went before has ended when it should. */
  private def acknowledges(t: LowerTester, gap: Int = 3): Unit = {
    t.quietly("1" * gap)
    t.sendAcked(Wires.head)
    t.intermission()
    assert(t.received() == Seq(Frames.head))
  }

  /** The delimiter begins with the next bit: dominant in its last one makes an overload flag at once. */
  private def delimiterIsHere(t: LowerTester): Unit = {
    t.quietly("1111111" + "0")
    t.activeFlag()
    t.delimiter()
    acknowledges(t)
  }

  "CC-7.5.1: an active flag over the passive one" should "end with it" in all(Seq(1, 3, 6)) { (t, bit) =>
    passive(t)
    t.quietly("1" * (bit - 1) + "0" * 6)
    t.delimiter()
    acknowledges(t)
  }

  "CC-7.5.2: a frame behind 8 and 2 bits" should "be received" in each { t =>
    passive(t)
    t.quietly("1" * 6)
    t.delimiter()
    acknowledges(t, gap = 2)
  }

  "CC-7.5.3: 1, 4 and 7 dominant bits behind the flag" should "be no error" in all(Seq(1, 4, 7)) {
    (t, bits) =>
      passive(t)
      t.quietly("1" * 6 + "0" * bits)
      t.delimiter()
      acknowledges(t, gap = 2)
      assert(t.counters.sum == 18) // those that made it passive, and that of the bad frame
  }

  "CC-7.5.4: nine bad frames" should "meet no active flag" in each { t =>
    passiveReceiver(t)
    for (_ <- 1 to 9) {
      badFrame(t)
      t.quietly("1" * (6 + 8 + 3))
    }
    assert(t.state == CanState.Passive)
  }

  "CC-7.5.5: 5 dominant bits in the flag" should "let it begin anew" in all(Seq(1, 3, 6)) { (t, bit) =>
    passive(t)
    // From bit 6 on the flag has five recessive bits in front of them, which are one short of its end.
    t.quietly("1" * (bit - 1) + "0" * 5 + "1" * 6)
    delimiterIsHere(t)
  }

  "CC-7.5.6: dominant delimiter bits 2, 4 and 7" should "let the passive flag begin anew" in
    all(Seq(2, 4, 7)) { (t, bit) =>
      passive(t)
      t.quietly("1" * 6 + "1" * (bit - 1) + "0" + "1" * 6)
      delimiterIsHere(t)
    }

  "CC-7.5.7: 17 recessive bits against flags" should "make it passive, and it receives" in each { t =>
    badFrame(t)
    t.play("R" * 16, "0" * 16)
    t.quietly("1" * 6)
    t.delimiter()
    t.intermission()
    assert(t.state == CanState.Passive)
    acknowledges(t, gap = 0)
  }
}

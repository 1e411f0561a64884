package flyframe.can

/** Conformance cases 8.3 and 8.4: error frames and overload frames of a transmitter. */
abstract class SenderErrorCases extends CanCases {
  import CanCases._

  /** The next bit is the first of a flag, as the frame was disturbed. */
  private def disturbed(t: LowerTester, wire: Wire): Unit = {
    t.request(wire.frame)
    t.awaitSof()
    t.hearWrong(wire.levels, wire.at("dlc", 1))
  }

  private def repeats(t: LowerTester, wire: Wire): Unit = {
    t.hear(wire)
    t.idle(20)
    assert((t.sent, t.pending) == (1, 0))
  }

  /** The others say SOF in the third bit of the intermission, and no more. */
  private def joined(t: LowerTester, wire: Wire): Unit = {
    t.quietly("110")
    t.hearRest(wire)
    t.idle(20)
    assert(t.pending == 0)
  }

  "CC-8.3.1: a flag lengthened by 1, 4 and 7 bits" should "be followed by recessive, and it repeats" in
    all(Seq(1, 4, 7)) { (t, more) =>
      disturbed(t, Wires.head)
      t.activeFlag()
      t.quietly("0" * more)
      t.delimiter()
      t.intermission()
      repeats(t, Wires.head)
    }

  "CC-8.3.2: SOF of another in intermission bit 3 behind an error frame" should
    "be followed by its identifier" in all(Wires) { (t, wire) =>
      disturbed(t, wire)
      t.activeFlag()
      t.delimiter()
      joined(t, wire)
    }

  "CC-8.3.3: flag bits 1, 4 and 6, heard recessive," should "let the flag begin anew" in
    all(Seq(1, 4, 6)) { (t, bit) =>
      disturbed(t, Wires.head)
      t.play("1" * (bit - 1) + "R", "0" * bit)
      t.errorFrame()
      repeats(t, Wires.head)
    }

  "CC-8.3.4: dominant delimiter bits 2, 4 and 7" should "let the flag begin anew" in
    all(Seq(2, 4, 7)) { (t, bit) =>
      disturbed(t, Wires.head)
      t.activeFlag()
      t.quietly("1" * (bit - 1) + "0")
      t.errorFrame()
      repeats(t, Wires.head)
    }

  // ---- 8.4 ----

  /** The controller has sent a frame, and the first `bit` bits of the intermission are over. */
  private def dominantBehindFrame(t: LowerTester, bit: Int): Unit = {
    t.request(Frames.head)
    t.awaitSof()
    t.hearRest(Wires.head)
    t.quietly("1" * (bit - 1) + "0")
  }

  private def settles(t: LowerTester): Unit = {
    t.delimiter()
    t.idle(20)
    assert((t.sent, t.pending) == (1, 0))
  }

  "CC-8.4.1: dominant in intermission bits 1 and 2" should "make an overload frame" in all(Seq(1, 2)) {
    (t, bit) =>
      dominantBehindFrame(t, bit)
      t.activeFlag()
      settles(t)
      assert(t.counters.forall(_ == 0))
  }

  "CC-8.4.2: dominant in the eighth delimiter bit" should "make an overload frame" in each { t =>
    disturbed(t, Wires.head)
    t.activeFlag()
    t.quietly("11111110") // of the error delimiter
    t.activeFlag()
    t.quietly("11111110") // of the overload delimiter
    t.activeFlag()
    t.delimiter()
    t.intermission()
    repeats(t, Wires.head)
    assert(t.counters.sum == 1)
  }

  "CC-8.4.3: SOF of another in intermission bit 3 behind an overload frame" should
    "be followed by its identifier" in all(JoiningFrames) { (t, frame) =>
      val order = Seq(Frames.head, frame).sortBy(_.order).map(Wire(_))
      t.request(Frames.head, frame)
      t.awaitSof()
      t.hearRest(order.head)
      t.quietly("0")
      t.activeFlag()
      t.delimiter()
      joined(t, order.last)
    }

  "CC-8.4.4: overload flag bits 1, 3 and 6, heard recessive," should "make an error frame" in
    all(Seq(1, 3, 6)) { (t, bit) =>
      dominantBehindFrame(t, 1)
      t.play("1" * (bit - 1) + "R", "0" * bit)
      t.activeFlag()
      settles(t)
      assert(t.lastError == ((CanError.Bit, true, CanField.OverloadFlag, bit - 1)))
    }

  "CC-8.4.5: dominant overload delimiter bits 2, 4 and 7" should "make an error frame" in
    all(Seq(2, 4, 7)) { (t, bit) =>
      dominantBehindFrame(t, 1)
      t.activeFlag()
      t.quietly("1" * (bit - 1) + "0")
      t.activeFlag()
      settles(t)
      assert(t.lastError == ((CanError.Form, true, CanField.OverloadDelim, bit - 1)))
    }
}

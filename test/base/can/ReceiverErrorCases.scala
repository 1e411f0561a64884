package flyframe.can

/** Conformance cases 7.2 to 7.4: errors that a receiver finds, its error frames and overload frames. */
abstract class ReceiverErrorCases extends CanCases {
  import CanCases._

  /** An error frame follows; then all is as before, and nothing of the wrong frame was received. */
  private def isRefused(t: LowerTester, kind: Int): Unit = {
    t.errorFrame()
    assert(t.lastError._1 == kind && !t.lastError._2)
    assert(t.rxLevel == 0)
  }

  private def goesOn(t: LowerTester): Unit = {
    t.sendAcked(Wires.head)
    t.intermission()
    assert(t.received() == Seq(Frames.head))
  }

  // ---- 7.2 ----

  "CC-7.2.1: the own ACK bit, heard recessive," should "be a bit error" in all(Wires) { (t, wire) =>
    t.quietly(wire.levels)
    t.play("1R", "10")
    isRefused(t, CanError.Bit)
    goesOn(t)
  }

  private def stuffErrors(wires: Seq[Wire]): Unit = all(wires) { (t, wire) =>
    for (at <- wire.stuffBits) {
      t.sendWrong(wire.levels, at)
      isRefused(t, CanError.Stuff)
    }
    goesOn(t)
  }
  "CC-7.2.2: each stuff bit of base frames, inverted," should "be an error" in stuffErrors(BaseVectors)
  "CC-7.2.3: each stuff bit of extended frames, inverted," should "be an error" in stuffErrors(ExtVectors)

  /** A frame with a wrong CRC: flag behind the ACK delimiter. */
  private def crcError(t: LowerTester, levels: String, ack: String): Unit = {
    t.quietly(levels + ack)
    isRefused(t, CanError.Crc)
  }

  "CC-7.2.5: a wrong CRC" should "be answered behind the ACK delimiter" in all(Frames) { (t, frame) =>
    for (bit <- 0 until 15) crcError(t, Wire(frame, crcError = 1 << bit).levels, Wire.Ack)
    crcError(t, Wire(frame, crcError = 1).levels, Wire.Acked) // dominant in the ACK slot is no error for it
    // SOF is missing; the stuffing is right nevertheless.
    crcError(t, Wire(base(1, 0x55)).levels.tail, Wire.Ack)
    goesOn(t)
  }

  "CC-7.2.6: CRC error and bad CRC delimiter" should "give one flag" in all(Frames) { (t, frame) =>
    t.quietly(Wire(frame, crcError = 4).levels + "0")
    isRefused(t, CanError.Form)
    assert(t.rec == 1)
    goesOn(t)
  }

  "CC-7.2.7: a dominant CRC delimiter" should "be an error" in all(Wires) { (t, wire) =>
    t.quietly(wire.levels + "0")
    isRefused(t, CanError.Form)
    goesOn(t)
  }

  "CC-7.2.9: a dominant ACK delimiter" should "be an error" in all(Wires) { (t, wire) =>
    t.quietly(wire.levels)
    t.play("110", "101")
    isRefused(t, CanError.Form)
    goesOn(t)
  }

  private def badEof(t: LowerTester, wire: Wire, bit: Int): Unit = {
    t.quietly(wire.levels)
    t.play(Wire.Ack, Wire.Acked)
    t.quietly("1" * (bit - 1) + "0")
    isRefused(t, CanError.Form)
  }

  "CC-7.2.10: dominant in EOF bits 1 to 5" should "be an error" in all(Wires) { (t, wire) =>
    for (bit <- 1 to 5) badEof(t, wire, bit)
    goesOn(t)
  }

  "CC-7.2.11: dominant in EOF bit 6" should "be an error, and the frame not accepted" in all(Wires) {
    (t, wire) =>
      badEof(t, wire, 6)
      goesOn(t)
  }

  // ---- 7.3 ----

  "CC-7.3.1: a flag lengthened by 1, 4 and 7 bits" should "be followed by recessive only" in
    all(Seq(1, 4, 7)) { (t, more) =>
      badFrame(t)
      t.activeFlag()
      t.quietly("0" * more)
      t.delimiter()
      t.intermission()
      goesOn(t)
    }

  "CC-7.3.2: a frame two bits behind the delimiter" should "be received" in all(Wires) { (t, wire) =>
    badFrame(t)
    t.activeFlag()
    t.delimiter()
    t.quietly("11")
    t.sendAcked(wire)
    t.intermission()
    assert(t.received() == Seq(wire.frame))
  }

  "CC-7.3.3: flag bits 1, 3 and 6, heard recessive," should "let the flag begin anew" in
    all(Seq(1, 3, 6)) { (t, bit) =>
      badFrame(t)
      t.play("1" * (bit - 1) + "R", "0" * bit)
      isRefused(t, CanError.Bit)
      goesOn(t)
    }

  "CC-7.3.4: dominant delimiter bits 2, 4 and 7" should "let the flag begin anew" in
    all(Seq(2, 4, 7)) { (t, bit) =>
      badFrame(t)
      t.activeFlag()
      t.quietly("1" * (bit - 1) + "0")
      isRefused(t, CanError.Form)
      goesOn(t)
    }

  // ---- 7.4 ----

  /** A good frame, and the first `bits` of its intermission are recessive but for the last one. */
  private def dominantBehindFrame(t: LowerTester, bit: Int): Unit = {
    t.sendAcked(Wires.head)
    t.quietly("1" * (bit - 1) + "0")
  }

  /** An overload frame follows, and nothing was an error. */
  private def overloads(t: LowerTester): Unit = {
    t.activeFlag()
    t.delimiter()
    t.intermission()
    t.received()
    goesOn(t)
  }

  "CC-7.4.1: dominant in intermission bits 1 and 2" should "make an overload frame" in all(Seq(1, 2)) {
    (t, bit) =>
      dominantBehindFrame(t, bit)
      overloads(t)
      assert(t.counters.forall(_ == 0))
  }

  "CC-7.4.2: dominant in the last EOF bit" should "make an overload frame" in all(Wires) { (t, wire) =>
    t.quietly(wire.levels)
    t.play(Wire.Ack, Wire.Acked)
    t.quietly("1111110")
    overloads(t)
    assert(t.counters.forall(_ == 0))
  }

  "CC-7.4.3: dominant in the eighth delimiter bit" should "make an overload frame" in each { t =>
    badFrame(t)
    t.activeFlag()
    t.quietly("11111110") // of the error delimiter
    t.activeFlag()
    t.quietly("11111110") // of the overload delimiter
    overloads(t)
    assert(t.counters.sum == 1)
  }

  "CC-7.4.4: overload flag bits 1, 3 and 6, heard recessive," should "make an error frame" in
    all(Seq(1, 3, 6)) { (t, bit) =>
      dominantBehindFrame(t, 1)
      t.play("1" * (bit - 1) + "R", "0" * bit)
      t.errorFrame()
      assert(t.lastError == ((CanError.Bit, false, CanField.OverloadFlag, bit - 1)))
    }

  "CC-7.4.5: dominant overload delimiter bits 2, 4 and 7" should "make an error frame" in
    all(Seq(2, 4, 7)) { (t, bit) =>
      dominantBehindFrame(t, 1)
      t.activeFlag()
      t.quietly("1" * (bit - 1) + "0")
      t.errorFrame()
      assert(t.lastError == ((CanError.Form, false, CanField.OverloadDelim, bit - 1)))
    }

  "CC-7.4.6: dominant in the intermission behind an error frame" should "make an overload frame" in
    all(Seq(1, 2)) { (t, bit) =>
      badFrame(t)
      t.activeFlag()
      t.delimiter()
      t.quietly("1" * (bit - 1) + "0")
      overloads(t)
      assert(t.counters.sum == 1)
    }

  "CC-7.4.7: dominant in the intermission behind an overload frame" should "make an overload frame" in
    all(Seq(1, 2)) { (t, bit) =>
      dominantBehindFrame(t, 1)
      t.activeFlag()
      t.delimiter()
      t.quietly("1" * (bit - 1) + "0")
      overloads(t)
      assert(t.counters.forall(_ == 0))
    }
}

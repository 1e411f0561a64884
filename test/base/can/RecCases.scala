package flyframe.can

/** Conformance cases 7.6: the receive error counter. */
abstract class RecCases extends CanCases {
  import CanCases._

  /** REC is 9: an error, and a recessive bit in its flag. */
  private def toNine(t: LowerTester): Unit = {
    badFrame(t)
    t.play("R", "0")
    t.errorFrame()
    assert(t.rec == 9)
  }

  /** An overload flag begins with the next bit, and REC is 0. */
  private def overload(t: LowerTester): Unit = {
    t.sendAcked(Wires.head)
    t.quietly("0")
  }

  private def headAndAck(t: LowerTester, wire: Wire): Unit = {
    t.quietly(wire.levels)
    t.play("11", "10")
  }

  /** Recessive follows, until the bus is idle; REC is `expected`, and TEC 0. */
  private def settles(t: LowerTester, expected: Int): Unit = {
    t.delimiter()
    t.intermission()
    assert((t.rec, t.tec) == (expected, 0))
  }

  "CC-7.6.1: a recessive bit in an active flag" should "add 8" in all(Seq(1, 3, 6)) { (t, bit) =>
    badFrame(t)
    t.play("1" * (bit - 1) + "R", "0" * bit)
    t.activeFlag()
    settles(t, 9)
  }

  "CC-7.6.2: a recessive bit in an overload flag" should "add 8" in all(Seq(1, 3, 6)) { (t, bit) =>
    overload(t)
    t.play("1" * (bit - 1) + "R", "0" * bit)
    t.activeFlag()
    settles(t, 8)
  }

  "CC-7.6.3: each eighth dominant bit behind an error flag" should "add 8" in
    all(Seq(7 -> 9, 8 -> 17, 15 -> 17, 16 -> 25)) { case (t, (bits, expected)) =>
      badFrame(t)
      t.activeFlag()
      t.quietly("0" * bits)
      settles(t, expected) // with the 8 for the first of them
    }

  "CC-7.6.4: each eighth dominant bit behind an overload flag" should "add 8" in
    all(Seq(7 -> 0, 8 -> 8, 15 -> 8, 16 -> 16)) { case (t, (bits, expected)) =>
      overload(t)
      t.activeFlag()
      t.quietly("0" * bits)
      settles(t, expected)
    }

  "CC-7.6.5: the own ACK bit, heard recessive," should "add 1" in all(Wires) { (t, wire) =>
    t.quietly(wire.levels)
    t.play("1R", "10")
    t.activeFlag()
    settles(t, 1)
  }

  "CC-7.6.6: a dominant CRC delimiter" should "add 1" in all(Wires) { (t, wire) =>
    t.quietly(wire.levels + "0")
    t.activeFlag()
    settles(t, 1)
  }

  "CC-7.6.7: a dominant ACK delimiter" should "add 1 to what ACK has taken away" in all(Wires) { (t, wire) =>
    toNine(t)
    headAndAck(t, wire)
    t.quietly("0")
    t.activeFlag()
    settles(t, 9)
  }

  "CC-7.6.8: dominant EOF bits 2, 3 and 5" should "add 1 to what ACK has taken away" in
    all(for (w <- Wires; bit <- Seq(2, 3, 5)) yield (w, bit)) { case (t, (wire, bit)) =>
      toNine(t)
      headAndAck(t, wire)
      t.quietly("1" + "1" * (bit - 1) + "0")
      t.activeFlag()
      settles(t, 9)
    }

  /** A stuff bit of each field and level, as far as the vectors have one. */
  private val stuffBits = (for {
    wire <- BaseVectors ++ ExtVectors
    at   <- wire.stuffBits
  } yield (wire, at)).distinctBy { case (wire, at) =>
    (wire.frame.extended, wire.bits(at).part, wire.bits(at).level)
  }

  "CC-7.6.9: a stuff error in each field" should "add 1" in {
    val fields = stuffBits.map { case (wire, at) => wire.bits(at).part -> wire.bits(at).level }.toSet
    for (part <- Seq("id", "ext", "data", "crc"); level <- "01") assert(fields(part -> level))
    assert(fields.exists(_._1 == "dlc"))
    all(stuffBits) { case (t, (wire, at)) =>
      t.sendWrong(wire.levels, at)
      t.activeFlag()
      settles(t, 1)
    }
  }

  "CC-7.6.10: a CRC error" should "add 1" in all(Frames) { (t, frame) =>
    t.quietly(Wire(frame, crcError = 0x10).levels + Wire.Ack)
    t.activeFlag()
    settles(t, 1)
  }

  "CC-7.6.11: dominant right behind the error flag" should "add 8" in each { t =>
    badFrame(t)
    t.activeFlag()
    t.quietly("0")
    settles(t, 9)
  }

  "CC-7.6.12: dominant error delimiter bits 2 and 7" should "add 1" in all(Seq(2, 7)) { (t, bit) =>
    badFrame(t)
    t.activeFlag()
    t.quietly("1" * (bit - 1) + "0")
    t.activeFlag()
    settles(t, 2)
  }

  "CC-7.6.13: dominant overload delimiter bits 2 and 7" should "add 1" in all(Seq(2, 7)) { (t, bit) =>
    overload(t)
    t.activeFlag()
    t.quietly("1" * (bit - 1) + "0")
    t.activeFlag()
    settles(t, 1)
  }

  "CC-7.6.14: a good frame" should "take 1 away" in all(Wires) { (t, wire) =>
    toNine(t)
    t.sendAcked(wire)
    t.intermission()
    assert(t.rec == 8)
  }

  "CC-7.6.15: a good frame at a passive receiver" should "bring REC to 119, and it is active" in each { t =>
    passiveReceiver(t)
    assert((t.state, t.rec) == (CanState.Passive, 129))
    t.sendAcked(Wires.head)
    t.intermission()
    assert((t.state, t.rec) == (CanState.Active, 119))
  }

  "CC-7.6.16: a dominant last EOF bit" should "not count" in all(Wires) { (t, wire) =>
    toNine(t)
    headAndAck(t, wire)
    t.quietly("1" + "1111110")
    t.activeFlag()
    settles(t, 8) // one less by the good frame
  }

  "CC-7.6.17: an overload flag of 13 bits" should "not count" in each { t =>
    toNine(t)
    overload(t)
    t.activeFlag()
    t.quietly("0" * 7)
    settles(t, 8)
  }

  "CC-7.6.18: dominant bits 2 to 7 behind the error flag" should "not count" in each { t =>
    badFrame(t)
    t.activeFlag()
    t.quietly("0" * 7)
    settles(t, 9) // as with the first one alone
  }

  "CC-7.6.19: a dominant last bit of the error delimiter" should "not count" in each { t =>
    badFrame(t)
    t.activeFlag()
    t.quietly("11111110")
    t.activeFlag()
    settles(t, 1)
  }

  "CC-7.6.20: a dominant last bit of the overload delimiter" should "not count" in each { t =>
    toNine(t)
    overload(t)
    t.activeFlag()
    t.quietly("11111110")
    t.activeFlag()
    settles(t, 8)
  }

  "CC-7.6.21: an own frame that is sent" should "not count" in all(Wires) { (t, wire) =>
    toNine(t)
    t.request(wire.frame)
    t.awaitSof()
    t.hearRest(wire)
    t.intermission()
    assert((t.rec, t.tec, t.sent) == (9, 0, 1))
  }

  "CC-7.6.23: a protocol exception" should "not count" in all(Frames) { (t, frame) =>
    toNine(t)
    t.quietly(Wire(frame, fdf = '1').levels + Wire.Acked + Wire.Eof + Wire.Intermission)
    assert((t.rec, t.tec) == (9, 0))
  }
}

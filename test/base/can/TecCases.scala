package flyframe.can

/** Conformance cases 8.6: the transmit error counter. */
abstract class TecCases extends CanCases {
  import CanCases._

  private val wire = Wires.head

  private def begins(t: LowerTester, wire: Wire = wire): Unit = {
    t.request(wire.frame)
    t.awaitSof()
  }

  /** The next bit is the first of an error flag, and TEC is 8 more. */
  private def disturbed(t: LowerTester): Unit = {
    begins(t)
    t.hearWrong(wire.levels, wire.at("dlc"))
  }

  /** The next bit is the first of an overload flag. */
  private def overload(t: LowerTester): Unit = {
    begins(t)
    t.hearRest(wire)
    t.quietly("0")
  }

  /** Recessive follows, until the bus is idle; TEC is `expected`, and REC 0. */
  private def settles(t: LowerTester, expected: Int): Unit = {
    t.delimiter()
    t.idle(3 + 8)
    assert((t.tec, t.rec) == (expected, 0))
  }

  /** A passive transmitter with TEC 135, one attempt a frame. */
  private def passive(t: LowerTester): Unit = {
    passiveSender(t)
    t.setControl(1 | OneShot)
    t.idle(3)
  }

  /** The frame is on the wire, up to an ACK slot in which nobody answers. */
  private def unanswered(t: LowerTester): Unit = {
    begins(t)
    t.play("1" * (wire.levels.length - 1), wire.levels.tail)
    t.quietly("11")
  }

  "CC-8.6.1: a recessive bit in an error flag" should "add 8" in oneShot(Seq(1, 3, 6)) { (t, bit) =>
    disturbed(t)
    t.play("1" * (bit - 1) + "R", "0" * bit)
    t.activeFlag()
    settles(t, 16)
  }

  "CC-8.6.2: a recessive bit in an overload flag" should "add 8" in oneShot(Seq(1, 3, 6)) { (t, bit) =>
    overload(t)
    t.play("1" * (bit - 1) + "R", "0" * bit)
    t.activeFlag()
    settles(t, 8)
  }

  "CC-8.6.3: each eighth dominant bit behind an active flag" should "add 8" in
    oneShot(Seq(7 -> 8, 8 -> 16, 15 -> 16, 16 -> 24)) { case (t, (bits, expected)) =>
      disturbed(t)
      t.activeFlag()
      t.quietly("0" * bits)
      settles(t, expected)
    }

  "CC-8.6.4: each eighth dominant bit behind a passive flag" should "add 8" in
    all(Seq(1 -> 0, 6 -> 0, 8 -> 8, 9 -> 8, 16 -> 16)) { case (t, (bits, more)) =>
      passive(t)
      disturbed(t)
      t.quietly("1" * 6 + "0" * bits)
      settles(t, 135 + 8 + more)
    }

  "CC-8.6.5: each eighth dominant bit behind an overload flag" should "add 8" in
    oneShot(Seq(7 -> 0, 8 -> 8, 23 -> 16)) { case (t, (bits, expected)) =>
      overload(t)
      t.activeFlag()
      t.quietly("0" * bits)
      settles(t, expected)
    }

  private val wrongBits = for {
    w           <- Wires
    (part, bit) <- Seq("sof" -> 0, "id" -> 0, "dlc" -> 0, "data" -> 0, "crc" -> 3)
  } yield (w, w.at(part, bit))

  "CC-8.6.6: a wrong SOF, ID, DLC, data and CRC bit" should "add 8" in oneShot(wrongBits) {
    case (t, (w, at)) =>
      // Of the arbitration only dominant bits can be wrong.
      val wrong = if (at > 0 && at < 11) w.levels.indexOf("0", at) else at
      t.request(w.frame)
      if (wrong == 0) t.awaitSof(sof = 'R')
      else {
        t.awaitSof()
        t.hearWrong(w.levels, wrong)
      }
      t.activeFlag()
      settles(t, 8)
  }

  "CC-8.6.7: dominant delimiters and EOF bits 1, 4 and 7" should "add 8" in
    oneShot(Seq("0", "100", "1010", "1011110", "1011111110")) { (t, tail) =>
      begins(t)
      t.play("1" * (wire.levels.length - 1), wire.levels.tail)
      t.quietly(tail)
      t.activeFlag()
      settles(t, 8)
    }

  "CC-8.6.8: a missing acknowledgement" should "add 8" in eachWith(OneShot) { t =>
    unanswered(t)
    t.activeFlag()
    settles(t, 8)
  }

  "CC-8.6.9: dominant error delimiter bits" should "add 8" in oneShot(Seq(2, 4, 7)) { (t, bit) =>
    disturbed(t)
    t.activeFlag()
    t.quietly("1" * (bit - 1) + "0")
    t.activeFlag()
    settles(t, 16)
  }

  "CC-8.6.10: dominant overload delimiter bits" should "add 8" in oneShot(Seq(2, 4, 7)) { (t, bit) =>
    overload(t)
    t.activeFlag()
    t.quietly("1" * (bit - 1) + "0")
    t.activeFlag()
    settles(t, 8)
  }

  "CC-8.6.11: a frame sent by an active transmitter" should "take 1 away" in oneShot(Wires) { (t, w) =>
    disturbed(t)
    t.errorFrame()
    begins(t, w)
    t.hearRest(w)
    t.intermission()
    assert((t.tec, t.sent) == (7, 1))
  }

  "CC-8.6.12: a frame sent by a passive transmitter" should "take 1 away" in all(Wires) { (t, w) =>
    passive(t)
    begins(t, w)
    t.hearRest(w)
    t.intermission()
    assert((t.tec, t.sent) == (134, 1))
  }

  "CC-8.6.13: an overload flag of 13 bits" should "not count" in eachWith(OneShot) { t =>
    overload(t)
    t.activeFlag()
    t.quietly("0" * 7)
    settles(t, 0)
  }

  "CC-8.6.14: an error flag of 13 bits" should "not count" in eachWith(OneShot) { t =>
    disturbed(t)
    t.activeFlag()
    t.quietly("0" * 7)
    settles(t, 8)
  }

  "CC-8.6.15: a dominant last bit of the error delimiter" should "not count" in eachWith(OneShot) { t =>
    disturbed(t)
    t.activeFlag()
    t.quietly("11111110")
    t.activeFlag()
    settles(t, 8)
  }

  "CC-8.6.16: a dominant last bit of the overload delimiter" should "not count" in eachWith(OneShot) { t =>
    disturbed(t)
    t.errorFrame()
    overload(t)
    t.activeFlag()
    t.quietly("11111110")
    t.activeFlag()
    settles(t, 7) // one less by the frame
  }

  "CC-8.6.17: a missing acknowledgement of a passive transmitter" should "not count" in each { t =>
    passive(t)
    unanswered(t)
    t.quietly("1" * 6)
    settles(t, 135)
    assert(t.failed == 1)
  }

  "CC-8.6.18: such a one with dominant bits in the flag" should "add 8, once" in
    all(for (bit <- Seq(1, 3, 6); dominant <- Seq("0", "00")) yield (bit, dominant)) {
      case (t, (bit, dominant)) =>
        passive(t)
        unanswered(t)
        t.quietly("1" * (bit - 1) + dominant + "1" * 6)
        settles(t, 135 + 8)
    }

  "CC-8.6.19: a recessive stuff bit of the arbitration, heard dominant," should "not count" in
    oneShot(Seq(base(0x07a, 0x11), ext(0x01e51234, 0x11), ext(0x15540123, 0x11))) { (t, frame) =>
      val w  = Wire(frame)
      val at = w.stuffBits.find(i => w.bits(i).level == '1').get
      assert(Set("id", "ext")(w.bits(at).part))
      disturbed(t)
      t.errorFrame()
      begins(t, w)
      t.hearWrong(w.levels, at)
      t.activeFlag()
      settles(t, 8)
      assert(t.lastError._1 == CanError.Stuff && t.lastError._2)
    }

  "CC-8.6.20: a frame received" should "not count" in oneShot(Wires) { (t, w) =>
    disturbed(t)
    t.errorFrame()
    t.sendAcked(w)
    t.intermission()
    assert((t.tec, t.rec) == (8, 0))
  }

  "CC-8.6.21: an error behind a lost arbitration" should "not count" in eachWith(OneShot) { t =>
    disturbed(t)
    t.errorFrame()
    val winner = Wire(base(wire.frame.id - 1, 0x12))
    val lost   = winner.at("id", 10) + 1
    begins(t)
    t.play(winner.levels.slice(1, lost), wire.levels.slice(1, lost))
    val bad = winner.stuffBits.find(_ >= lost).get
    t.quietly(winner.levels.slice(lost, bad) + Wire.not(winner.levels(bad)))
    t.activeFlag()
    t.delimiter()
    t.intermission()
    assert((t.tec, t.rec) == (8, 1))
  }
}

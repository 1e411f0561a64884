package flyframe.can

/** Conformance cases 8.5: a transmitter that is error passive, and bus-off. */
abstract class PassiveSenderCases extends CanCases {
  import CanCases._

  private val Suspend = "1" * 8

  /** The frame of a passive transmitter is disturbed; the next bit is the first of its flag. */
  private def disturbed(t: LowerTester, wire: Wire = Wires.head): Unit = {
    passiveSender(t)
    t.request(wire.frame)
    t.awaitSof()
    t.hearWrong(wire.levels, wire.at("dlc"))
  }

  /** Error delimiter, intermission and suspend; then it repeats at once. */
  private def repeats(t: LowerTester, wire: Wire = Wires.head): Unit = {
    t.delimiter()
    t.intermission()
    t.quietly(Suspend)
    sends(t, wire)
  }

  private def sends(t: LowerTester, wire: Wire): Unit = {
    t.hear(wire)
    t.idle(20)
    assert(t.pending == 0)
  }

  /** A passive transmitter has sent a frame, and has another one. */
  private def sentOneOfTwo(t: LowerTester): Unit = {
    passiveSender(t)
    t.request(Frames: _*)
    t.awaitSof()
    t.hearRest(first)
  }
  private val Seq(first, second) = Wires.sortBy(_.frame.order)

  private val others = Wire(base(0x7f0, 0x12)) // loses against ours, if they begin together

  "CC-8.5.1: an active flag over the passive one" should "end with it" in all(Seq(1, 3, 6)) { (t, bit) =>
    disturbed(t)
    t.quietly("1" * (bit - 1) + "0" * 6)
    repeats(t)
  }

  "CC-8.5.2: a frame behind 8 and 2 bits" should "be received" in each { t =>
    disturbed(t)
    t.quietly("1" * 6)
    t.delimiter()
    t.quietly("11")
    t.sendAcked(others)
    t.intermission()
    sends(t, Wires.head) // a receiver does not suspend
    assert(t.received() == Seq(others.frame))
  }

  "CC-8.5.3: 1, 4 and 7 dominant bits behind the flag" should "be no error" in all(Seq(1, 4, 7)) {
    (t, bits) =>
      disturbed(t)
      t.quietly("1" * 6 + "0" * bits)
      repeats(t)
      assert(t.tec == 135 + 8 - 1)
  }

  "CC-8.5.4: a frame in bits 1, 4 and 8 of suspend" should "be received" in all(Seq(1, 4, 8)) { (t, bit) =>
    sentOneOfTwo(t)
    t.intermission()
    t.quietly("1" * (bit - 1))
    t.sendAcked(others)
    t.intermission()
    sends(t, second)
    assert(t.received() == Seq(others.frame))
  }

  "CC-8.5.5: an error frame" should "be followed by suspend" in all(Wires) { (t, wire) =>
    disturbed(t, wire)
    t.quietly("1" * 6)
    repeats(t, wire)
  }

  "CC-8.5.6: an overload frame" should "be followed by suspend" in each { t =>
    sentOneOfTwo(t)
    t.quietly("0")
    t.activeFlag() // an overload flag is dominant, whatever the state
    repeats(t, second)
  }

  "CC-8.5.7: an own frame" should "be followed by suspend" in each { t =>
    sentOneOfTwo(t)
    t.intermission()
    t.quietly(Suspend)
    sends(t, second)
  }

  "CC-8.5.8: a lost arbitration" should "be followed by no suspend" in each { t =>
    passiveSender(t)
    val winner = Wire(base(Frames.head.id - 1, 0x12))
    val to     = winner.at("id", 10) + 1
    t.request(Frames.head)
    t.awaitSof()
    t.play(winner.levels.slice(1, to), Wires.head.levels.slice(1, to))
    t.quietly(winner.levels.drop(to))
    t.play(Wire.Ack, Wire.Acked)
    t.quietly(Wire.Eof + Wire.Intermission)
    sends(t, Wires.head)
    assert(t.received() == Seq(winner.frame))
  }

  "CC-8.5.9: dominant in intermission bit 3 and in bits 1 and 7 of suspend" should
    "be received, and not joined" in all(Seq(2, 3, 9)) { (t, recessive) =>
      sentOneOfTwo(t)
      t.quietly("1" * recessive)
      t.sendAcked(others)
      t.intermission()
      sends(t, second)
      assert(t.received() == Seq(others.frame))
    }

  /** Bus-off with a frame pending. */
  private def busOff(t: LowerTester): Unit = {
    t.request(Frames.head)
    t.awaitSof()
    becomesBusOff(t, Wires.head.levels)
    t.quietly("1" * 30)
    assert((t.state, t.tec) == (CanState.BusOff, 256))
  }

  "CC-8.5.10: bus-off" should "leave out ACK and frames" in each { t =>
    busOff(t)
    t.quietly(others.levels + Wire.Acked + Wire.Eof + Wire.Intermission)
    t.command(1)
    t.quietly(others.levels + Wire.Acked + Wire.Eof + Wire.Intermission)
    t.idle(64)
    assert((t.state, t.rxLevel, t.pending) == (CanState.BusOff, 0, 1))
  }

  "CC-8.5.11: 128 times 11 recessive bits" should "end bus-off, no fewer" in each { t =>
    busOff(t)
    t.command(1)
    t.quietly("0" + "1" * 10 + "0" + "1" * 21 + "0")
    t.quietly(("1" * 11 + "0") * 126)
    t.quietly("1" * 11)
    sends(t, Wires.head)
    assert((t.state, t.tec, t.rec) == (CanState.Active, 0, 0))
  }

  "CC-8.5.12: 5 dominant, 5 recessive, 6 dominant bits" should "end the flag" in each { t =>
    disturbed(t)
    t.quietly("0" * 5 + "1" * 5 + "0" * 6)
    repeats(t)
  }

  "CC-8.5.13: dominant delimiter bits 2, 4 and 7" should "let the passive flag begin anew" in
    all(Seq(2, 4, 7)) { (t, bit) =>
      disturbed(t)
      t.quietly("1" * 6 + "1" * (bit - 1) + "0" + "1" * 6)
      repeats(t)
    }

  "CC-8.5.14: an error of a passive transmitter" should "cost 31 bits at most" in each { t =>
    disturbed(t)
    t.quietly("1" * 6 + "0" * 6)
    repeats(t) // 6 + 6 + 8 + 3 + 8
  }

  "CC-8.5.15: a wrong bit and 15 of its flags" should "make it passive, and suspend follows" in each { t =>
    t.request(Frames.head)
    t.awaitSof()
    becomesPassive(t, Wires.head.levels)
    t.quietly("1" * 6)
    repeats(t)
    assert((t.state, t.tec) == (CanState.Active, 127))
  }
}

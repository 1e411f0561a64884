package flyframe.can

/** Rules of errors and confinement (CAN-20 to CAN-35, CB-05, CB-07, CB-14). */
abstract class ErrorRules extends CanCases {
  import CanCases._

  private val wire  = Wires.head
  private val stuff = Ours.stuffBits.head

  private def begins(t: LowerTester): Unit = {
    t.request(wire.frame)
    t.awaitSof()
  }

  /** Up to the end of the CRC. */
  private def sendsAll(t: LowerTester): Unit = {
    begins(t)
    t.play("1" * (wire.levels.length - 1), wire.levels.tail)
  }

  // What is wrong, what makes it so up to the bit with the error, and what is recorded then.
  private val errors: Seq[(String, LowerTester => Unit, (Int, Boolean, Int, Int))] = Seq(
    (
      "an own bit",
      t => { begins(t); t.hearWrong(wire.levels, wire.at("data", 9)) },
      (CanError.Bit, true, CanField.Data + 1, 1)
    ),
    ("a stuff bit received", t => t.sendWrong(Ours.levels, stuff), (CanError.Stuff, false, CanField.Ide, 0)),
    (
      "a delimiter received",
      t => t.quietly(wire.levels + "0"),
      (CanError.Form, false, CanField.CrcDelimiter, 0)
    ),
    (
      "a CRC received",
      t => t.quietly(Wire(wire.frame, crcError = 2).levels + Wire.Ack),
      (CanError.Crc, false, CanField.AckDelimiter, 0)
    ),
    (
      "a missing acknowledgement",
      t => { sendsAll(t); t.quietly("11") },
      (CanError.Ack, true, CanField.AckSlot, 0)
    )
  )

  "CAN-20: each type of error" should "be counted and recorded, and the flag begin with the next bit" in
    oneShot(errors) { case (t, (_, happens, record)) =>
      happens(t)
      t.errorFrame()
      t.idle(10)
      assert(t.lastError == record)
      assert(
        t.counters.take(5) == (CanError.Bit to CanError.Ack).map(kind => if (kind == record._1) 1 else 0)
      )
    }

  "CAN-20: a wrong bit in ACK slot and arbitration" should "be no bit error" in each { t =>
    sendsAll(t)
    t.quietly(Wire.Acked + Wire.Eof + Wire.Intermission)
    begins(t)
    val winner = Wire(base(0))
    val to     = wire.levels.zip(winner.levels).indexWhere { case (a, b) => a != b } + 1
    t.play(winner.levels.slice(1, to), wire.levels.slice(1, to))
    t.quietly(winner.levels.drop(to))
    t.play(Wire.Ack, Wire.Acked)
    t.quietly(Wire.Eof + Wire.Intermission)
    assert(t.counters.take(5).sum == 0)
  }

  "CAN-21: an active flag" should "last six bits, and the delimiter begin when the others let go" in
    all(0 to 6) { (t, more) =>
      badFrame(t)
      t.activeFlag()
      t.quietly("0" * more + "1" * 7 + "0") // dominant in bit 8 of the delimiter
      t.activeFlag()
      t.delimiter()
    }

  "CAN-21: a passive flag" should "be over when six equal bits have been heard" in
    all(Seq("111111", "000000", "1000000", "0111111", "001100111111")) { (t, flag) =>
      passiveReceiver(t)
      badFrame(t)
      t.quietly(flag)
      t.quietly("1111111" + "0") // overload shows where the delimiter ends
      t.activeFlag()
      t.delimiter()
    }

  "CAN-30, CAN-32: REC" should "count as a receiver's errors ask" in each { t =>
    badFrame(t)        // 1
    t.play("1R", "00") // 9
    t.activeFlag()
    t.quietly("0" * 9)    // 17, 25
    t.quietly("11" + "0") // 26
    t.activeFlag()
    t.delimiter()
    t.intermission()
    assert((t.rec, t.tec) == (26, 0))
    t.sendAcked(wire)
    t.intermission()
    assert((t.rec, t.tec) == (25, 0))
  }

  "CAN-31, CAN-32: TEC" should "count as a transmitter's errors ask" in each { t =>
    begins(t)
    t.hearWrong(wire.levels, wire.at("dlc")) // 8
    t.play("1R", "00")                       // 16
    t.activeFlag()
    t.quietly("0" * 9)    // 24
    t.quietly("11" + "0") // 32
    t.errorFrame()
    t.hear(wire) // 31
    t.intermission()
    assert((t.tec, t.rec) == (31, 0))
  }

  // Frames with a recessive stuff bit next to RTR, whether it stands behind it, and what TEC is then.
  private val besideRtr = Seq(
    (base(0x7e0), "id", 0),
    (base(0x7f0), "rtr", 8),
    (ext(0x0aaaaae0), "ext", 0),
    (ext(0x0aaaaaf0), "rtr", 8)
  )

  "CAN-31: a recessive stuff bit, heard dominant," should "count behind RTR, and in front of it not" in
    oneShot(besideRtr) { case (t, (frame, part, tec)) =>
      val wire = Wire(frame)
      val at   = wire.stuffBits.find(i => wire.bits(i).level == '1' && wire.bits(i).part == part).get
      t.request(frame)
      t.awaitSof()
      t.hearWrong(wire.levels, at)
      t.errorFrame()
      assert(t.tec == tec)
      assert(t.lastError._1 == (if (tec == 0) CanError.Stuff else CanError.Bit))
    }

  "CAN-33: warning, passive, bus-off" should "begin at 96, 128 and 256" in each { t =>
    begins(t)
    t.hearWrong(wire.levels, wire.at("dlc"))
    t.play("R" * 10, "0" * 10) // 88
    t.activeFlag()
    t.delimiter()
    t.intermission()
    t.play("1", "0")
    // No warning with 87, one with 95 + 8.
    t.hearFrom(wire, 1)
    t.intermission()
    assert((t.tec, t.status) == (87, CanState.Active))
    begins(t)
    t.hearWrong(wire.levels, wire.at("dlc"))
    t.activeFlag()
    t.delimiter()
    t.intermission()
    t.hear(wire)
    t.intermission()
    assert((t.tec, t.status) == (94, CanState.Active))
    begins(t)
    t.hearWrong(wire.levels, wire.at("dlc"))
    t.errorFrame()
    t.hear(wire)
    t.intermission()
    assert((t.tec, t.status) == (101, CanState.Active | 4))
    begins(t)
    t.hearWrong(wire.levels, wire.at("dlc")) // 109
    t.play("RRR", "000")                     // 117, 125, 133: the flag that begins now is passive
    t.quietly("1" * (6 + 8 + 3 + 8))
    t.hear(wire)
    t.quietly("1" * 11)
    assert((t.tec, t.status) == (132, CanState.Passive | 4))
    begins(t)
    t.hearWrong(wire.levels, wire.at("dlc"))  // 140
    t.quietly("1" * 6 + "0" * (14 * 8) + "1") // 252
    t.quietly("1" * (7 + 3 + 8))
    t.play("1", "0")
    t.hearWrong(wire.levels, wire.at("dlc")) // 256 and more
    t.idle(40)
    assert((t.tec, t.status, t.counter("bus_offs")) == (256, CanState.BusOff | 4, 1))
  }

  "CAN-33: the warning" should "be there with 96, and not with 95" in eachWith(OneShot) { t =>
    begins(t)
    t.hearWrong(wire.levels, wire.at("dlc"))
    t.play("R" * 11, "0" * 11) // 8 + 11 x 8
    t.errorFrame()
    assert((t.tec, t.status) == (96, CanState.Active | 4))
    begins(t)
    t.hearRest(wire)
    t.intermission()
    assert((t.tec, t.status) == (95, CanState.Active))
  }

  "CAN-33: REC 128" should "make it passive, and 127 not" in each { t =>
    badFrame(t)
    t.play("R" * 15, "0" * 15) // 121
    t.activeFlag()
    for (_ <- 122 to 127) {
      t.quietly("110")
      t.activeFlag()
    }
    t.delimiter()
    t.intermission()
    assert((t.rec, t.state) == (127, CanState.Active))
    badFrame(t)
    t.quietly("1" * (6 + 8 + 3)) // the flag is passive already
    assert((t.rec, t.state) == (128, CanState.Passive))
  }

  private def busOff(t: LowerTester): Unit = {
    begins(t)
    becomesBusOff(t, wire.levels)
  }

  "CAN-34: bus-off" should "last until the host asks for its end, and 128 times 11 recessive bits" in each {
    t =>
      busOff(t)
      t.idle(11 * 130)
      assert(t.state == CanState.BusOff)
      t.command(1)
      t.quietly("0" + ("1" * 11) * 127 + "1" * 10 + "0" + "1" * 11)
      t.hear(wire)
      t.intermission()
      assert((t.state, t.tec, t.rec, t.sent) == (CanState.Active, 0, 0, 1))
  }

  "CAN-34, CB-14: recovery by itself" should "begin with bus-off" in eachWith(RecoversItself) { t =>
    busOff(t)
    t.quietly(("1" * 11 + "0") * 127 + "1" * 10 + "0" + "1" * 11)
    t.hear(wire)
  }

  it should "go on when the host wants it no more" in eachWith(RecoversItself) { t =>
    busOff(t)
    t.quietly("1" * 11 * 5 + "1" * 10)
    t.setControl(1)
    t.quietly("1" + ("0" + "1" * 11) * 60)
    assert(t.state == CanState.BusOff)
    t.quietly("0" + "1" * 10 + ("0" + "1" * 11) * 61)
    assert(t.state == CanState.BusOff)
    t.quietly("0" + "1" * 11)
    t.hear(wire)
  }

  "CAN-35: a node alone" should "become passive, and never bus-off" in each { t =>
    begins(t)
    t.play("1" * (wire.levels.length - 1), wire.levels.tail)
    for (n <- 1 to 40) {
      t.quietly("11")
      // The sixteenth attempt makes it passive: 16 x 8.
      if (n < 16) t.errorFrame() else t.quietly("1" * (6 + 8 + 3 + 8))
      t.play("1" * wire.levels.length, wire.levels)
    }
    t.quietly(Wire.Acked + Wire.Eof)
    t.idle(20)
    assert((t.tec, t.state, t.sent, t.counter("ack_errors")) == (127, CanState.Active, 1, 40))
  }

  "CB-05: what is several errors" should "be recorded as one" in oneShot(Wires) { (t, wire) =>
    def sends(): Unit = {
      t.request(wire.frame)
      t.awaitSof()
    }
    // A dominant fixed bit is a form error for the transmitter, too.
    sends()
    t.play("1" * (wire.levels.length - 1), wire.levels.tail)
    t.quietly("100")
    t.errorFrame()
    assert(t.lastError == ((CanError.Form, true, CanField.AckDelimiter, 0)))
    // A dominant ACK delimiter behind a wrong CRC.
    t.quietly(Wire(wire.frame, crcError = 1).levels + "110")
    t.errorFrame()
    assert(t.lastError == ((CanError.Crc, false, CanField.AckDelimiter, 0)))
    assert(t.counters.take(5) == Seq(0, 0, 1, 1, 0))
    // A recessive stuff bit of the transmitter, heard dominant: behind the arbitration a bit error.
    val vector = Wire(base(0x41f, 0))
    val at     = vector.stuffBits.find(i => vector.bits(i).part == "dlc" && vector.bits(i).level == '1').get
    t.request(vector.frame)
    t.awaitSof()
    t.hearWrong(vector.levels, at)
    t.errorFrame()
    assert(t.lastError._1 == CanError.Bit)
  }

  "CB-07: counters" should "stop at 256 and 255" in each { t =>
    badFrame(t)
    t.play("R" * 16, "0" * 16)
    t.quietly("1" * 6 + "0" * (8 * 20)) // with 129 + 8 + 160 it would be 297
    t.quietly("1" * (8 + 3))
    assert((t.rec, t.state) == (255, CanState.Passive))
    begins(t)
    t.hearWrong(wire.levels, wire.at("dlc"))
    t.quietly("1" * 6 + "0" * (8 * 40))
    t.idle(20)
    assert((t.tec, t.state) == (256, CanState.BusOff))
    t.quietly(Ours.levels.take(stuff) + "0" * 30 + "1" * 30)
    assert((t.tec, t.rec) == (256, 255))
  }

  "CB-14: recover" should "have no effect but in bus-off" in each { t =>
    t.command(1)
    busOff(t)
    t.idle(11 * 130)
    assert(t.state == CanState.BusOff)
  }
}

package flyframe.can

/** Conformance cases 7.1: receiving good frames. */
abstract class ReceptionCases extends CanCases {
  import CanCases._

  /** The others send each frame, which is acknowledged and received as it was sent. */
  private def receivesAll(t: LowerTester, wires: Seq[Wire]): Unit = for (wire <- wires) {
    t.sendAcked(wire)
    t.intermission()
    assert(t.received() == Seq(wire.frame))
  }

  private def allPass(t: LowerTester): Unit = assert((t.state, t.tec, t.rec) == (CanState.Active, 0, 0))

  "CC-7.1.1: base frames of all lengths" should "be acknowledged and received" in each { t =>
    receivesAll(t, allLengths(extended = false, 711).map(Wire(_)))
    allPass(t)
  }

  "CC-7.1.2: extended frames of all lengths" should "be acknowledged and received" in each { t =>
    receivesAll(t, allLengths(extended = true, 712).map(Wire(_)))
    allPass(t)
  }

  // Own frame, the one it loses to, and the bit in which it loses.
  private val losses = Seq(
    (remote(0x2a5), base(0x2a5, 1), "rtr", 0),
    (ext(0x2a5 << 18 | 0x12345, 2), base(0x2a5, 1), "srr", 0),
    (ext(0x2a5 << 18 | 0x12345, 2), remote(0x2a5), "ide", 0),
    (base(0x2a5, 2), base(0x2a4, 1), "id", 10),
    (ext(0x0a5a1235, 2), ext(0x0a5a1234, 1), "ext", 17),
    (remote(0x0a5a1234, extended = true), ext(0x0a5a1234, 1), "rtr", 0)
  )

  "CC-7.1.3: who loses arbitration" should "receive the winner, and repeat its own at idle" in
    all(losses) { case (t, (own, winner, part, index)) =>
      val (lost, won) = (Wire(own), Wire(winner))
      val to          = lost.at(part, index) + 1
      t.request(own)
      t.awaitSof()
      t.play(won.levels.slice(1, to), lost.levels.slice(1, to))
      t.quietly(won.levels.drop(to))
      t.play(Wire.Ack, Wire.Acked)
      t.quietly(Wire.Eof + Wire.Intermission)
      t.hear(lost)
      t.intermission()
      assert(t.received() == Seq(winner))
      assert((t.sent, t.pending) == (1, 0))
    }

  "CC-7.1.5: SRR and r0 of either level" should "be accepted" in each { t =>
    receivesAll(t, for (srr <- Seq('0', '1'); r0 <- Seq('0', '1')) yield Wire(Frames(1), srr = srr, r0 = r0))
  }

  /** What follows FDF in a CAN FD frame: nominal bits, and data that are so fast that many of its dominant
    * bits meet no sample point.
    */
  private def fdPayload(t: LowerTester): Unit = {
    t.quietly("01010001")
    val quantaOfBit = Seq(2, 3, 5).filter(t.rate.setting.length % _ == 0).max
    val text        = "0110100111000101101011111000001" * 3
    t.quanta(text.flatMap(_.toString * quantaOfBit), "1" * (text.length * quantaOfBit))
    t.quietly("0")
  }

  private def exception(wire: Wire) = wire.levels.take(wire.at("fdf") + 1)

  "CC-7.1.6: FDF" should "neither be answered nor count, and the next frame be received" in
    all(Frames) { (t, frame) =>
      val fd = Wire(frame, fdf = '1')
      // A frame of CAN 2.0 but for this bit, and one of CAN FD; somebody else acknowledges.
      t.quietly(fd.levels + Wire.Acked + Wire.Eof + Wire.Intermission)
      receivesAll(t, Seq(Wire(frame)))
      t.idle(3)
      t.quietly(exception(fd))
      fdPayload(t)
      t.quietly(Wire.Acked + Wire.Eof + Wire.Intermission)
      receivesAll(t, Seq(Wire(frame)))
      allPass(t)
    }

  "CC-7.1.7: behind it 11 recessive bits" should "be needed to take part again" in all(Frames) { (t, frame) =>
    val fd = Wire(frame, fdf = '1').levels + Wire.Acked + Wire.Eof
    for (gap <- Seq(4, 3)) {
      t.quietly(fd + "1" * gap)
      t.sendAcked(Wires.head)
      t.intermission()
    }
    assert(t.received().size == 2)
    t.idle(3)
    t.quietly(fd + "11")
    t.quietly(Wires.head.levels + Wire.Acked + Wire.Eof + Wire.Intermission)
    t.sendAcked(Wires.last)
    t.intermission()
    assert(t.received() == Seq(Wires.last.frame))
    allPass(t)
  }

  "CC-7.1.8: DLC 9 to 15" should "mean eight bytes, and be reported" in each { t =>
    val data = Seq(1, 2, 3, 0xf4, 5, 6, 7, 0xf8)
    receivesAll(t, for (dlc <- 9 to 15; f <- Frames) yield Wire(f.copy(dlc = dlc, data = data)))
  }

  "CC-7.1.9: a frame behind 2 and 3 bits of intermission" should "be received" in all(Seq(2, 3)) { (t, gap) =>
    t.sendAcked(Wires.head)
    t.quietly("1" * gap)
    t.sendAcked(Wires.last)
    t.intermission()
    assert(t.received() == Frames)
  }

  "CC-7.1.10: stuff bits of base frames" should "be accepted" in each(receivesAll(_, BaseVectors))

  "CC-7.1.11: stuff bits of extended frames" should "be accepted" in each(receivesAll(_, ExtVectors))

  "CC-7.1.12: dominant in the last EOF bit" should "make an overload frame behind a valid one" in
    all(Wires) { (t, wire) =>
      t.quietly(wire.levels)
      t.play(Wire.Ack, Wire.Acked)
      t.quietly(Wire.Eof.init + "0")
      t.activeFlag()
      t.delimiter()
      t.intermission()
      assert(t.received() == Seq(wire.frame))
      allPass(t)
      t.sendAcked(wire)
    }
}

package flyframe.can

/** Conformance cases 8.1 and 8.2: sending, and the errors that a transmitter finds. */
abstract class SendingCases extends CanCases {
  import CanCases._

  /** The controller sends each frame, and is acknowledged. */
  private def sendsAll(t: LowerTester, wires: Seq[Wire]): Unit = for (wire <- wires) {
    t.request(wire.frame)
    t.awaitSof()
    t.hearRest(wire)
    t.intermission()
    assert((t.sent, t.pending, t.failed) == (1, 0, 0))
  }

  /** It repeats its frame at once, and that is all. */
  private def repeats(t: LowerTester, wire: Wire): Unit = {
    t.hear(wire)
    t.idle(20)
    assert((t.sent, t.pending, t.failed) == (1, 0, 0))
  }

  // ---- 8.1 ----

  "CC-8.1.1: base frames of all lengths" should "be sent" in
    each(sendsAll(_, allLengths(extended = false, 811).map(Wire(_))))

  "CC-8.1.2: extended frames of all lengths" should "be sent" in
    each(sendsAll(_, allLengths(extended = true, 812).map(Wire(_))))

  /** The frame that wins over `frame` in a bit of its arbitration. */
  private def winner(frame: CanFrame, part: String, index: Int): CanFrame = part match {
    case "srr" => base(frame.baseId, 0x33)
    case "ide" => remote(frame.baseId)
    case _ =>
      val width = if (frame.extended) 29 else 11
      val bit   = width - 1 - (if (part == "ext") 11 + index else index)
      frame.copy(id = frame.id >> bit + 1 << bit + 1)
  }

  private def collisions(frames: Seq[CanFrame]): Unit = each { t =>
    for (frame <- frames) {
      val own   = Wire(frame)
      val parts = Set("id", "srr", "ide", "ext")
      for (
        at <- own.bits.indices; bit = own.bits(at) if parts(bit.part) && bit.level == '1' && !bit.isStuff
      ) {
        val other = Wire(winner(frame, bit.part, bit.index))
        t.request(frame)
        t.awaitSof()
        t.play(other.levels.slice(1, at + 1), own.levels.slice(1, at + 1))
        t.quietly(other.levels.drop(at + 1))
        t.play(Wire.Ack, Wire.Acked)
        t.quietly(Wire.Eof + Wire.Intermission)
        repeats(t, own)
        assert(t.received() == Seq(other.frame))
      }
    }
  }

  "CC-8.1.3: a collision on each recessive bit of base frames" should "make it receiver, and it repeats" in
    collisions(Seq(base(0x7ef, 0x55), base(0x010, 0x55)))

  "CC-8.1.4: a collision on each recessive bit of extended frames" should
    "make it receiver, and it repeats" in collisions(Seq(ext(0x1fbfffff, 0x55), ext(0x00400000, 0x55)))

  "CC-8.1.5: dominant in the first bit of the intermission" should "make an overload frame, and no repeat" in
    all(Wires) { (t, wire) =>
      t.request(wire.frame)
      t.awaitSof()
      t.hearRest(wire)
      t.quietly("0")
      t.activeFlag()
      t.delimiter()
      t.idle(20)
      assert((t.sent, t.pending, t.tec) == (1, 0, 0))
    }

  "CC-8.1.6: stuff bits of base frames" should "be sent" in each(sendsAll(_, BaseVectors))

  "CC-8.1.7: stuff bits of extended frames" should "be sent" in each(sendsAll(_, SendableExtVectors))

  "CC-8.1.8: SOF of another in intermission bit 3" should "be followed by its identifier" in
    all(JoiningFrames) { (t, frame) =>
      t.request(Frames.head, frame)
      val order = Seq(Frames.head, frame).sortBy(_.order).map(Wire(_))
      t.awaitSof()
      t.hearRest(order.head)
      t.quietly("110")
      t.hearRest(order.last)
      t.idle(20)
      assert((t.sent, t.tec) == (3, 0))
    }

  // ---- 8.2 ----

  /** A bit of each level in each field; in the arbitration dominant ones only. */
  private def kinds(wire: Wire): Seq[Int] = {
    val arbitration = Set("sof", "id", "srr", "ide", "ext", "rtr")
    val all = for {
      at <- wire.bits.indices; bit = wire.bits(at)
      if !bit.isStuff && (bit.level == '0' || !arbitration(bit.part))
    } yield at
    all.distinctBy(at => (wire.bits(at).part, wire.bits(at).level))
  }

  private def bitErrors(wire: Wire): Unit = {
    assert(kinds(wire).size >= 10)
    all(kinds(wire)) { (t, at) =>
      t.request(wire.frame)
      if (at == 0) t.awaitSof(sof = 'R')
      else {
        t.awaitSof()
        t.hearWrong(wire.levels, at)
      }
      t.errorFrame()
      repeats(t, wire)
      assert(t.lastError._1 == CanError.Bit && t.lastError._2)
    }
  }

  "CC-8.2.1: a wrong bit in each field of a base frame" should "be an error, and it repeats" in
    bitErrors(Wires.head)

  "CC-8.2.2: a wrong bit in each field of an extended frame" should "be an error, and it repeats" in
    bitErrors(Wires.last)

  private def stuffErrors(wires: Seq[Wire]): Unit =
    oneShot(wires.flatMap(w => w.stuffBits.grouped(10).map(w -> _))) { case (t, (wire, bits)) =>
      for (at <- bits) {
        t.request(wire.frame)
        t.awaitSof()
        t.hearWrong(wire.levels, at)
        t.errorFrame()
        assert(t.failed == 1)
      }
    }

  "CC-8.2.3: each stuff bit of base frames, equal to its five," should "be an error" in
    stuffErrors(BaseVectors)

  "CC-8.2.4: each stuff bit of extended frames, equal to its five," should "be an error" in
    stuffErrors(SendableExtVectors)

  // Bits behind the CRC: what the others do, up to the wrong bit.
  private val tails = Seq("0", "100", "1010", "1011110", "1011111110")

  "CC-8.2.5: dominant delimiters and EOF bits 1, 4 and 7" should "be an error, and it repeats" in
    all(for (w <- Wires; tail <- tails) yield (w, tail)) { case (t, (wire, tail)) =>
      t.request(wire.frame)
      t.awaitSof()
      t.play("1" * (wire.levels.length - 1), wire.levels.tail)
      t.quietly(tail)
      t.errorFrame()
      repeats(t, wire)
      assert(t.lastError._1 == CanError.Form && t.lastError._2)
    }

  "CC-8.2.6: a missing acknowledgement" should "be an error right behind the slot, and it repeats" in
    all(Wires) { (t, wire) =>
      t.request(wire.frame)
      t.awaitSof()
      t.play("1" * (wire.levels.length - 1), wire.levels.tail)
      t.quietly("11")
      t.errorFrame()
      repeats(t, wire)
      assert(t.lastError == ((CanError.Ack, true, CanField.AckSlot, 0)))
    }
}

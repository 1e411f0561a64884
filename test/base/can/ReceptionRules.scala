package flyframe.can

import flyframe.params.CanParams
import flyframe.registers.CanRegisters
import scala.util.Random

/** Rules of frames received and of records (CAN-43, CAN-44, CAN-46, CB-10, CB-11). */
abstract class ReceptionRules extends CanCases {
  import CanCases._

  private def receive(t: LowerTester, frame: CanFrame): Unit = {
    t.sendAcked(Wire(frame))
    t.intermission()
  }

  private val in = CanFiltersModel.InUse

  "CAN-43: without a filter in use" should "nothing be accepted" in each { t =>
    t.setFilter(0, 0, 0)
    for (frame <- Frames) receive(t, frame)
    assert(t.rxLevel == 0)
  }

  "CAN-43: the lowest filter that matches" should "win and be reported" in each { t =>
    val count = CanParams().filters
    t.setFilter(0, 0, 0)
    t.setFilter(2, in | 0x120, 0x7f0 | 3 << 30)   // base data frames 0x120 to 0x12f
    t.setFilter(3, in | 0x123, 0x7ff)             // 0x123 of any kind, and extended ones that end so
    t.setFilter(5, in | 1 << 31, 1 << 31)         // all extended ones
    t.setFilter(count - 1, in | 1 << 30, 1 << 30) // all remote frames
    val expected = Seq(
      base(0x123)                            -> Some(2),
      base(0x12f, 1)                         -> Some(2),
      base(0x130)                            -> None,
      remote(0x123)                          -> Some(3),
      remote(0x124)                          -> Some(count - 1),
      ext(0x123)                             -> Some(3),
      ext(0x1000924)                         -> Some(5),
      ext(0x1000123)                         -> Some(3),
      remote(0x1fffffff, extended = true, 8) -> Some(5)
    )
    for ((frame, filter) <- expected) receive(t, frame)
    val taken = Seq.fill(t.rxLevel)(t.takeBytes())
    assert(taken.map(b => CanFrame.of(b) -> Some(b(5))) == expected.filter(_._2.isDefined))
  }

  "CAN-43: filters at random" should "let pass what they say" in at(Rate.Fast) { t =>
    val random = new Random(43)
    for (_ <- 1 to 5) {
      // Few different bits, so that much matches.
      def word = (random.nextInt(4) << 30) | (random.nextInt(4) << 16) | random.nextInt(4)
      val entries = Seq.fill(CanParams().filters) {
        val used = if (random.nextInt(3) == 0) in else 0
        (used | word, word | 1)
      }
      for (((value, mask), n) <- entries.zipWithIndex) t.setFilter(n, value, mask)
      for (_                  <- 1 to 8) {
        val w     = word
        val frame = CanFrame(w & (if (w < 0) 0x1fffffff else 0x7ff), w < 0, (w >> 30 & 1) == 1, 0, Nil)
        receive(t, frame)
        val matching = entries.indexWhere { case (value, mask) =>
          (value & in) != 0 && ((value ^ frame.word) & mask & 0xdfffffff) == 0
        }
        assert(t.rxLevel == (if (matching < 0) 0 else 1))
        if (matching >= 0) assert(t.takeBytes()(5) == matching)
      }
    }
  }

  "CAN-43: filters that change within a frame" should "act on it by their values of before or after" in
    at(Rate.Fast) { t =>
      val random = new Random(44)
      var (old, is) =
        (0, 0) // frames that were accepted by the values of before, of after, where these differ
      val all     = in           -> 0
      val none    = (in | 0x7ff) -> 0x7ff
      def one     = Seq(all, none, (in | 1 << 31) -> (1 << 31), (in | 1) -> 1, 0 -> 0)(random.nextInt(5))
      val entries = Array.fill(CanParams().filters)(none)
      for (((value, mask), n) <- entries.zipWithIndex) t.setFilter(n, value, mask)
      for (_                  <- 1 to 150) {
        val id    = random.nextInt(0x7ff)
        val frame = if (random.nextBoolean()) base(id) else ext(id)
        def first(of: Seq[(Int, Int)]) = of.indexWhere { case (value, mask) =>
          (value & in) != 0 && ((value ^ frame.word) & mask & 0xdfffffff) == 0
        }
        val before = first(entries.toSeq)
        val n      = random.nextInt(4)
        entries(n) = one
        val after  = first(entries.toSeq)
        val wire   = Wire(frame)
        val moment = random.nextInt(wire.levels.length)
        t.quietly(wire.levels.take(moment))
        t.setFilter(n, entries(n)._1, entries(n)._2)
        t.quietly(wire.levels.drop(moment))
        t.play(Wire.Ack, Wire.Acked)
        t.quietly(Wire.Eof)
        t.intermission()
        val taken = if (t.rxLevel == 0) -1 else t.takeBytes()(5)
        assert(t.rxLevel == 0 && (taken == before || taken == after), s"$before, $after")
        if (before != after) if (taken == before) old += 1 else is += 1
      }
      info(s"by those of before: $old, by those of after: $is")
      assert(old + is > 20)
    }

  "CB-11: an entry" should "be in force when its last byte is written, and not before" in each { t =>
    val start = CanRegisters.FilterStarts.head
    // Entry 0 lets all pass. With these bytes it would let nothing pass.
    t.device.write(start, Seq(0x77, 7, 0, 0x20, 0xff, 7, 0))
    receive(t, base(0x123))
    assert(t.rxLevel == 1)
    assert(t.device.read(start, 8) == Seq(0, 0, 0, 0x20, 0, 0, 0, 0))
    t.device.write(start + 7, Seq(0))
    receive(t, base(0x123))
    assert(t.rxLevel == 1)
    assert(t.device.read(start, 8) == Seq(0x77, 7, 0, 0x20, 0xff, 7, 0, 0))
    receive(t, base(0x777))
    assert(t.rxLevel == 2)
    assert(t.received() == Seq(base(0x123), base(0x777)))
  }

  "CAN-44: a full FIFO" should "keep what is in it, and count what it drops" in at(Rate.Fast) { t =>
    val size = CanParams().rxFrames
    for (n <- 0 until size + 3) receive(t, base(n, n & 0xff))
    assert((t.rxLevel, t.counter("overruns")) == (size, 3))
    assert(CanFrame.of(t.takeBytes()) == base(0, 0))
    assert(t.rxLevel == size - 1)
    receive(t, ext(99))
    assert((t.rxLevel, t.counter("overruns")) == (size, 3))
    assert(t.received() == (1 until size).map(n => base(n, n & 0xff)) :+ ext(99))
    assert(t.takeBytes() == Seq.fill(16)(0)) // an empty one
    t.release()
    assert(t.rxLevel == 0)
  }

  "CAN-44: frames" should "stand in it as the register map says" in each { t =>
    t.setFilter(0, 0, 0)
    t.setFilter(7, in, 0)
    receive(t, CanFrame(0x1abcdef0, extended = true, remote = false, 11, 1 to 8))
    receive(t, remote(0x7ff, dlc = 5))
    def withoutTime = t.takeBytes().patch(6, Nil, 2)
    assert(withoutTime == Seq(0xf0, 0xde, 0xbc, 0x9a, 11, 7) ++ (1 to 8))
    assert(withoutTime == Seq(0xff, 0x07, 0, 0x40, 5, 7) ++ Seq.fill(8)(0))
  }

  /** Field and bit that a record names for a bit of a frame. */
  private def place(bit: WireBit): (Int, Int) = bit.part match {
    case "sof"         => CanField.Sof                    -> 0
    case "id"          => CanField.Id                     -> bit.index
    case "srr"         => CanField.RtrOrSrr               -> 0
    case "ide"         => CanField.Ide                    -> 0
    case "ext"         => CanField.IdExtension            -> bit.index
    case "fdf"         => CanField.Fdf                    -> 0
    case "r0"          => CanField.R0                     -> 0
    case "dlc"         => CanField.Dlc                    -> bit.index
    case "data"        => (CanField.Data + bit.index / 8) -> bit.index % 8
    case "crc"         => CanField.Crc                    -> bit.index
    case _ /* "rtr" */ => CanField.RtrOrSrr               -> 0
  }

  "CAN-46, CB-10: a wrong bit of an own frame" should "be recorded with its field and bit" in
    at(Rate.Fast, OneShot) { first =>
      for (frame <- Seq(base(0x2a5, 0x3c, 0x5a), ext(0x0a5a1234, 0, 1, 2, 3, 4, 5, 6, 7))) {
        val wire        = Wire(frame)
        val arbitration = Set("id", "srr", "ide", "ext", "rtr")
        val bits = wire.bits.indices.filter { i =>
          val b = wire.bits(i)
          i > 0 && !b.isStuff && (b.level == '0' || !arbitration(b.part))
        }
        for (some <- bits.grouped(10)) at(first.rate, OneShot) { t =>
          for (i <- some) {
            t.request(frame)
            t.awaitSof()
            t.hearWrong(wire.levels, i)
            t.errorFrame()
            val (field, bit) =
              if (frame.extended && wire.bits(i).part == "rtr") (CanField.Rtr, 0) else place(wire.bits(i))
            assert(t.lastError == ((CanError.Bit, true, field, bit)), wire.bits(i))
          }
        }
      }
    }

  "CAN-46, CB-10: a stuff error" should "be recorded with the bit behind it" in
    all(BaseVectors.take(3) ++ ExtVectors.take(3)) { (t, wire) =>
      for (i <- wire.stuffBits) {
        t.sendWrong(wire.levels, i)
        t.errorFrame()
        val next = wire.bits.lift(i + 1)
        val (field, bit) = next.fold(CanField.CrcDelimiter -> 0) { b =>
          if (wire.frame.extended && b.part == "rtr") (CanField.Rtr, 0) else place(b)
        }
        assert(t.lastError == ((CanError.Stuff, false, field, bit)))
      }
    }

  "CAN-46, CB-10: a wrong bit behind the CRC" should "be recorded with its field and bit" in
    oneShot(
      Seq(
        "0"          -> (CanField.CrcDelimiter -> 0),
        "100"        -> (CanField.AckDelimiter -> 0),
        "1010"       -> (CanField.Eof          -> 0),
        "1011111110" -> (CanField.Eof          -> 6)
      )
    ) { case (t, (tail, (field, bit))) =>
      val wire = Wires.head
      t.request(wire.frame)
      t.awaitSof()
      t.play("1" * (wire.levels.length - 1), wire.levels.tail)
      t.quietly(tail)
      t.errorFrame()
      assert(t.lastError == ((CanError.Form, true, field, bit)))
    }

  "CAN-46, CB-10: a wrong bit of flags and delimiters" should "be recorded with its field and bit" in each {
    t =>
      badFrame(t)
      t.play("11R", "000")
      t.activeFlag()
      t.quietly("1")
      assert(t.lastError == ((CanError.Bit, false, CanField.ActiveErrorFlag, 2)))
      t.idle(12)
      badFrame(t)
      t.activeFlag()
      t.quietly("1110")
      t.activeFlag()
      t.quietly("1")
      assert(t.lastError == ((CanError.Form, false, CanField.ErrorDelimiter, 3)))
      t.idle(12)
  }

  // Own frame, the winner, and the bit that decides.
  private val losses = Seq(
    (ext(0x1fbfffff), base(0), 1),
    (ext(0x1fbfffff), base(0x7ee), 11),
    (ext(0x1fb80000), base(0x7ee), 12),
    (ext(0x1fb80000), remote(0x7ee), 13),
    (ext(0x1fba0000), ext(0x1fb80000), 14),
    (ext(0x1fb80001), ext(0x1fb80000), 31),
    (remote(0x1fb80000, extended = true), ext(0x1fb80000), 32),
    (remote(0x7ee), base(0x7ee), 12)
  )

  "CAN-46, CB-10: a lost arbitration" should "be recorded with its bit" in all(losses) {
    case (t, (frame, winner, bit)) =>
      val (own, won) = (Wire(frame), Wire(winner))
      val to         = own.levels.zip(won.levels).indexWhere { case (a, b) => a != b } + 1
      assert(t.lostBit == 0)
      t.request(frame)
      t.awaitSof()
      t.play(won.levels.slice(1, to), own.levels.slice(1, to))
      t.quietly(won.levels.drop(to))
      t.play(Wire.Ack, Wire.Acked)
      t.quietly(Wire.Eof)
      t.intermission()
      t.hear(own)
      t.intermission()
      assert((t.lostBit, t.counter("lost_arbitrations")) == (bit, 1))
      t.command(2)
      assert((t.lostBit, t.counter("lost_arbitrations")) == (0, 0))
  }

  "CAN-46: counters" should "stop at 255, and be cleared by the host" in at(Rate.Fast) { t =>
    passiveReceiver(t)
    badFrame(t)
    for (_ <- 1 to 260) t.quietly("1" * 6 + "10") // a flag, and the second bit of its delimiter
    t.quietly("1" * (6 + 8 + 3))
    assert(t.counters == Seq(16, 2, 255, 0, 0, 0, 0, 0))
    t.command(2)
    assert(t.counters.forall(_ == 0))
    assert((t.lastError, t.lostBit) == ((0, false, 0, 0), 0))
    assert(t.rec == 255)
  }
}

package flyframe.can

import flyframe.registers.CanRegisters
import scala.util.Random

/** Rules of the frames (CAN-07 to CAN-14). */
abstract class FrameRules extends CanCases {
  import CanCases._

  /** Any frame. */
  private def any(random: Random): CanFrame = {
    val extended = random.nextBoolean()
    val isRemote = random.nextInt(4) == 0
    val dlc      = random.nextInt(16)
    val id       = random.nextInt() & (if (extended) 0x1fffffff else 0x7ff)
    // Long runs of equal bits now and then.
    def byte = Seq(0, 0xff, random.nextInt(256), random.nextInt(256))(random.nextInt(4))
    CanFrame(id, extended, isRemote, dlc, Seq.fill(CanFrame.size(dlc, isRemote))(byte))
  }

  private def sends(t: LowerTester, wire: Wire): Unit = {
    t.request(wire.frame)
    t.awaitSof()
    t.hearRest(wire)
    t.intermission()
  }

  private def receives(t: LowerTester, wire: Wire): Unit = {
    t.sendAcked(wire)
    t.intermission()
    assert(t.received() == Seq(wire.frame))
  }

  "CAN-07: frames of any kind" should "be sent and received bit by bit as the standard says" in each { t =>
    val random = new Random(7)
    for (_ <- 1 to 60) {
      sends(t, Wire(any(random)))
      receives(t, Wire(any(random)))
    }
    assert((t.tec, t.rec, t.counters.sum) == (0, 0, 0))
  }

  "CAN-08: a recessive FDF" should "be no error, whatever follows" in all(Frames) { (t, frame) =>
    val wire   = Wire(frame, fdf = '1')
    val random = new Random(8)
    for (_ <- 1 to 10) {
      t.quietly(wire.levels.take(wire.at("fdf") + 1))
      t.quietly(Seq.fill(40)(if (random.nextBoolean()) '1' else '0').mkString + "0" * 20 + "1" * 11)
      receives(t, Wire(frame))
    }
    assert((t.tec, t.rec, t.counters.sum) == (0, 0, 0))
  }

  // Vectors of the specification: SOF to the end of the CRC, with stuff bits.
  private val vectors = Seq(
    (base(0x123, 0xde, 0xad), 0x0b6e, 51),
    (ext(0x10503fe7, 0 to 7: _*), 0x4097, 130),
    (ext(0, Seq.fill(8)(0): _*), 0x3daf, 137)
  )

  "CAN-09: the vectors of the specification" should "be sent and received" in
    all(vectors) { case (t, (frame, crc, bits)) =>
      val wire = Wire(frame)
      assert(wire.crc == crc && wire.levels.length == bits)
      if (bits == 51) assert(wire.levels == "000100100011000001101101111010101101000101101101110")
      sends(t, wire)
      receives(t, wire)
    }

  "CAN-10: a controller that starts within a frame" should "wait for 11 recessive bits" in all(Wires) {
    (t, wire) =>
      t.setControl(0)
      t.quietly(wire.levels.take(20))
      // The others are recessive while the host writes.
      t.setControl(1)
      t.quietly("0" + wire.levels.drop(25) + Wire.Acked + Wire.Eof + "11")
      t.quietly(Ours.levels + Wire.Acked + Wire.Eof + Wire.Intermission)
      assert(t.received() == Nil)
      receives(t, wire)
      assert(t.counters.sum == 0)
  }

  "CAN-10: the frame that waits" should "begin behind the eleventh bit" in each { t =>
    t.setControl(0)
    t.request(Frames.head)
    t.setControl(1)
    t.quietly("0" + "1" * 10 + "0" + "1" * 11)
    t.hear(Wires.head)
  }

  "CAN-11: a lost arbitration" should "make it receiver without a gap, and count" in each { t =>
    val other = Wire(ext(0x0a5a1000, 0x77))
    val own   = Wires.last
    val to    = own.levels.zip(other.levels).indexWhere { case (a, b) => a != b } + 1
    t.request(own.frame)
    for (n <- 1 to 3) {
      if (n == 1) t.awaitSof() else t.play("1", "0")
      t.play(other.levels.slice(1, to), own.levels.slice(1, to))
      t.quietly(other.levels.drop(to))
      t.play(Wire.Ack, Wire.Acked)
      t.quietly(Wire.Eof)
      t.intermission()
    }
    t.hear(own)
    t.intermission()
    assert(t.received() == Seq.fill(3)(other.frame))
    assert((t.counter("lost_arbitrations"), t.sent, t.counter("bit_errors")) == (3, 1, 0))
    assert(t.lostBit == 14 + own.bits(to - 1).index)
  }

  "CAN-12: a passive node that hears dominant in intermission bit 3" should "not begin its own frame" in
    each { t =>
      passiveReceiver(t)
      t.request(Frames.head)
      t.awaitSof()
      t.hearRest(Wires.head)
      t.quietly("1" * 11)
      // A transmitter suspends; a receiver does not, but does not join, either.
      t.request(Frames.head)
      t.awaitSof()
      t.hearWrong(Wires.head.levels, Wires.head.at("dlc"))
      t.quietly("1" * 6)
      t.delimiter()
      t.quietly("11")
      t.sendAcked(Wire(base(0x7f0)))
      t.intermission()
      t.hear(Wires.head)
    }

  "CAN-12: a request that comes while such a frame is received" should "wait for its end" in at(Rate.Slow) {
    t =>
      t.setSlot(0, Frames.head)
      t.sendAcked(Wires.head)
      t.quietly("11")
      t.quietly(Wires.last.levels)
      t.play(Wire.Ack, Wire.Acked)
      val eof = t.device.cycle
      t.device.write(CanRegisters.PortStarts.head + CanRegisters.Requests, Seq(1))
      t.until(eof + 10 * t.rate.bitCycles)
      t.hear(Wires.head)
      assert(t.received() == Frames)
  }

  "CAN-12: an active node with nothing to send" should "take dominant in intermission bit 3 as SOF" in each {
    t =>
      t.sendAcked(Wires.head)
      t.quietly("11")
      t.sendAcked(Wires.last)
      t.quietly("111")
      assert(t.received() == Frames)
  }

  // Registers are looked at a third of a bit later, as an access may take its time.
  for ((bits, frames) <- Seq(5 -> 0, 6 -> 1))
    s"CAN-13: a frame received, behind $bits EOF bits," should s"have been valid $frames times" in
      at(Rate.Slow) { t =>
        t.quietly(Wires.head.levels)
        t.play(Wire.Ack, Wire.Acked)
        t.quietly("1" * bits)
        t.quanta("1" * 8)
        assert(t.rxLevel == frames)
      }

  for ((bits, frames) <- Seq(6 -> 0, 7 -> 1))
    s"CAN-13: a frame sent, behind $bits EOF bits," should s"have been valid $frames times" in
      at(Rate.Slow) { t =>
        t.request(Frames.head)
        t.awaitSof()
        t.play("1" * (Wires.head.levels.length - 1), Wires.head.levels.tail)
        t.quietly(Wire.Acked + "1" * bits)
        t.quanta("1" * 8)
        assert(t.sent == frames)
      }

  "CAN-13: dominant in the last EOF bit" should "be an overload at receivers, an error at the transmitter" in
    each { t =>
      t.quietly(Wires.head.levels)
      t.play(Wire.Ack, Wire.Acked)
      t.quietly("1111110")
      t.activeFlag()
      t.delimiter()
      t.intermission()
      assert((t.received(), t.counters.sum) == (Seq(Frames.head), 0))
      t.request(Frames.head)
      t.awaitSof()
      t.play("1" * (Wires.head.levels.length - 1), Wires.head.levels.tail)
      t.quietly(Wire.Acked + "1111110")
      t.errorFrame()
      t.hear(Wires.head)
      t.intermission()
      assert((t.sent, t.counter("form_errors"), t.tec) == (1, 1, 7))
    }

  "CAN-14: the ACK slot" should "be dominant if the CRC is right, and only then" in all(Frames) {
    (t, frame) =>
      for (wrong <- Seq(0, 1, 0x4000, 0x2a2a)) {
        t.quietly(Wire(frame, crcError = wrong).levels)
        if (wrong == 0) {
          t.play(Wire.Ack, Wire.Acked)
          t.quietly(Wire.Eof)
        } else {
          t.quietly(Wire.Acked) // of others, who got it right
          t.activeFlag()
          t.delimiter()
        }
        t.intermission()
      }
      assert(t.received() == Seq(frame))
  }
}

package flyframe.can

import flyframe.params.CanParams
import flyframe.registers.CanRegisters
import scala.util.Random

/** Rules of frames to send (CAN-40 to CAN-42, CAN-45, CB-06, CB-08, CB-09, CB-12, CB-13). */
abstract class SlotRules extends CanCases {
  import CanCases._

  private val wire = Wires.head

  private def winsAgainst(t: LowerTester, own: Wire): Unit = {
    val winner = Wire(base(0, 0x99))
    val to     = own.levels.zip(winner.levels).indexWhere { case (a, b) => a != b } + 1
    t.play(winner.levels.slice(1, to), own.levels.slice(1, to))
    t.quietly(winner.levels.drop(to))
    t.play(Wire.Ack, Wire.Acked)
    t.quietly(Wire.Eof + Wire.Intermission)
  }

  "CAN-40: a frame" should "be repeated until it is sent" in each { t =>
    t.request(wire.frame)
    t.awaitSof()
    for (n <- 1 to 3) {
      winsAgainst(t, wire)
      t.play("1", "0")
      t.hearWrong(wire.levels, wire.at("crc", 2))
      t.errorFrame()
      t.play("1", "0")
    }
    t.hearRest(wire)
    t.idle(20)
    assert((t.pending, t.sent, t.failed) == (0, 1, 0))
  }

  "CAN-40: with one shot a frame that loses" should "fail" in eachWith(OneShot) { t =>
    t.request(wire.frame)
    t.awaitSof()
    winsAgainst(t, wire)
    t.idle(20)
    assert((t.pending, t.sent, t.failed) == (0, 0, 1))
  }

  "CAN-40: with one shot a frame that is disturbed" should "fail" in eachWith(OneShot) { t =>
    t.request(wire.frame)
    t.awaitSof()
    t.hearWrong(wire.levels, wire.at("crc", 2))
    t.errorFrame()
    t.idle(20)
    assert((t.pending, t.sent, t.failed) == (0, 0, 1))
  }

  "CAN-40: a frame that waits" should "be aborted at once" in each { t =>
    t.setControl(0)
    t.request(Frames: _*)
    t.abort(1)
    assert((t.pending, t.failed) == (2, 1))
    t.setControl(1)
    t.awaitSof()
    t.hearRest(Wires.last)
    t.idle(20)
    assert((t.pending, t.sent, t.failed) == (0, 2, 1))
  }

  for (isGood <- Seq(true, false))
    s"CAN-40: a frame aborted on the wire, and ${if (isGood) "sent" else "disturbed"}," should
      "end as this attempt does" in at(Rate.Slow) { t =>
        t.request(wire.frame)
        t.awaitSof()
        val sof = t.device.cycle - t.rate.bitCycles
        t.play("1" * 20, wire.levels.slice(1, 21))
        t.abort(1)
        assert((t.pending, t.failed) == (1, 0))
        t.until(sof + 22 * t.rate.bitCycles)
        if (isGood) t.hearFrom(wire, 22)
        else {
          val bad = wire.levels.indexOf("0", 24)
          t.play("1" * (bad - 22) + "R", wire.levels.slice(22, bad + 1))
          t.activeFlag()
        }
        t.idle(30)
        assert((t.pending, t.sent, t.failed) == (if (isGood) (0, 1, 0) else (0, 0, 1)))
        // The abort is over: the next frame is repeated.
        t.request(wire.frame)
        t.awaitSof()
        t.hearWrong(wire.levels, wire.at("crc", 2))
        t.errorFrame()
        t.hear(wire)
      }

  "CAN-40: abort all" should "abort all slots" in each { t =>
    t.setControl(0)
    t.requestAt((0 until 16).map(n => n -> base(n)): _*)
    t.command(4)
    assert((t.pending, t.failed) == (0, 0xffff))
    t.setControl(1)
    t.idle(30)
  }

  /** The controller sends these frames one behind the other, from SOF of the first one on. */
  private def sendsInOrder(t: LowerTester, frames: Seq[CanFrame]): Unit =
    for ((frame, n) <- frames.zipWithIndex) {
      if (n == 0) t.awaitSof() else t.play("1", "0")
      t.hearRest(Wire(frame))
      t.intermission()
    }

  "CAN-41: the slots" should "be sent in CAN order" in each { t =>
    val random = new Random(41)
    // The same eleven bits in front, in all formats, and others.
    val near = Seq(base(0x123, 1), remote(0x123), ext(0x123 << 18, 2), remote(0x123 << 18, extended = true))
    val others =
      Seq.fill(12)(if (random.nextBoolean()) base(random.nextInt(0x800)) else ext(random.nextInt(1 << 29)))
    val frames = random.shuffle(near ++ others)
    // By the levels of their arbitration, as a bus would do it.
    def arbitration(f: CanFrame) = {
      val all = Wire(f).bits.filterNot(_.isStuff)
      all.takeWhile(b => b.part != "dlc" && b.part != "fdf").map(_.level).mkString
    }
    for (slots <- Seq(frames, frames.reverse)) {
      t.request(slots: _*)
      sendsInOrder(t, frames.sortBy(arbitration))
      assert(t.sent == 0xffff)
    }
  }

  "CAN-41: of the same identifier the older one" should "go first" in each { t =>
    def frame(n: Int) = base(0x222, n)
    t.setControl(0)
    val order = Seq(5, 2, 9, 0, 15)
    for (n <- order) t.requestAt(n -> frame(n))
    // A slot that is requested again, is as young as its last request.
    t.abort(1 << 5)
    t.requestAt(5 -> frame(5))
    // A request of one that is pending has no effect.
    t.device.write(CanRegisters.PortStarts.head + CanRegisters.Requests, Seq(1 << 2, 0))
    t.setControl(1)
    sendsInOrder(t, (order.tail :+ 5).map(frame))
  }

  "CAN-41: a request that comes while another one loses" should "go first if it is before it" in each { t =>
    val Seq(own, winner, urgent) = Seq(0x300, 0x2ff, 0x100).map(id => Wire(base(id)))
    val to                       = own.levels.zip(winner.levels).indexWhere { case (a, b) => a != b } + 1
    t.request(own.frame)
    t.awaitSof()
    t.play(winner.levels.slice(1, to), own.levels.slice(1, to))
    t.quietly(winner.levels.drop(to))
    t.play(Wire.Ack, Wire.Acked)
    val eof = t.device.cycle // the host's accesses fall into recessive bits
    t.requestAt(7 -> urgent.frame)
    t.until(eof + 10 * t.rate.bitCycles)
    t.hear(urgent)
    t.intermission()
    t.hear(own)
  }

  "CAN-42: listen only" should "drive nothing, receive, and leave TEC and REC" in eachWith(ListenOnly) { t =>
    t.request(Frames.head)
    t.idle(20)
    for (wire <- Wires) {
      // Nobody acknowledges, and somebody does.
      for (ack <- Seq(Wire.Ack, Wire.Acked)) {
        t.quietly(wire.levels + ack + Wire.Eof + Wire.Intermission)
        assert(t.received() == Seq(wire.frame))
      }
    }
    t.quietly(wire.levels + Wire.Acked + Wire.Eof + "0" * 7 + "1" * 12) // an overload frame of others
    t.sendWrong(Ours.levels, BadStuff)
    t.quietly("0" * 6 + "1" * 11) // an error frame of others
    t.quietly(wire.levels + Wire.Acked + Wire.Eof + Wire.Intermission)
    t.quietly(Wire(wire.frame, crcError = 1).levels + "111" + "0" * 7 + "1" * 12)
    assert(t.received() == Seq(wire.frame, wire.frame))
    assert((t.tec, t.rec, t.state, t.pending) == (0, 0, CanState.Active, 1))
    assert((t.counter("stuff_errors"), t.counter("crc_errors")) == (1, 1))
    t.setControl(1)
    t.awaitSof(14)
    t.hearRest(wire)
  }

  for (control <- Seq(LoopBack, LoopBack | ListenOnly))
    s"CAN-42, CB-06: loop back, control $control," should "send and receive inside, whatever the bus does" in
      eachWith(control) { t =>
        t.request(Frames: _*)
        t.silently("0" * 20)
        t.quietly(("0" * 50 + "1" * 5) * 6)
        t.idle(20)
        assert(t.received() == Frames.sortBy(_.order))
        assert((t.sent, t.pending, t.tec, t.rec, t.counters.sum) == (3, 0, 0, 0, 0))
      }

  "CB-06: a frame in loop back" should "count as sent only" in each { t =>
    for (_ <- 1 to 2) {
      badFrame(t)
      t.play("R", "0")
      t.errorFrame()
    }
    t.setControl(1 | LoopBack)
    t.request(wire.frame)
    t.idle(80)
    assert((t.rec, t.sent, t.rxLevel) == (18, 1, 1))
  }

  "CB-06: loop back that begins in the ACK slot" should "find it as it was driven: nobody acknowledges" in
    at(Rate.Slow) { t =>
      t.request(wire.frame)
      t.awaitSof()
      t.play("1" * (wire.levels.length - 1), wire.levels.tail)
      t.quietly("1")
      val slot = t.device.cycle
      t.setControl(1 | LoopBack)
      assert(t.device.cycle - slot < sampleAfter(t))
      t.until(slot + t.rate.bitCycles)
      t.quietly("1" * (6 + 8 + 3) + "1" * 80) // it begins anew, inside
      assert((t.counter("ack_errors"), t.counters.sum, t.sent, t.rxLevel) == (1, 1, 1, 1))
    }

  "CB-06: listen only" should "let the controller hear its own flags" in eachWith(ListenOnly) { t =>
    // Nobody but it finds an error: six bits of its flag inside, then its delimiter.
    t.sendWrong(Ours.levels, BadStuff)
    t.quietly("1" * 6 + "1" * 8 + "11")
    t.quietly(wire.levels + Wire.Acked + Wire.Eof + Wire.Intermission)
    assert(t.received() == Seq(wire.frame))
    assert(t.counters.sum == 1)
  }

  /** The time at the end of core cycle `cycle`, us. */
  private def us(cycle: Long): Long       = cycle / CanParams().coreClockMhz
  private def sampleAfter(t: LowerTester) = (t.rate.setting.tseg1 + 1) * t.rate.prescaler - 1

  "CAN-45: a frame received" should "have the time of the sample point of its SOF" in each { t =>
    for (_ <- 1 to 3) {
      t.idle(7)
      val sof = t.device.cycle
      t.sendAcked(wire)
      t.intermission()
      val bytes = t.takeBytes()
      val stamp = bytes(6) | bytes(7) << 8
      // The controller's quanta may have begun up to one earlier.
      assert(us(sof + sampleAfter(t) - t.rate.prescaler) to us(sof + sampleAfter(t)) contains stamp.toLong)
    }
  }

  "CAN-45: a frame sent" should "have it in its slot" in each { t =>
    t.request(wire.frame)
    t.awaitSof()
    val sof = t.device.cycle - t.rate.bitCycles
    t.hearRest(wire)
    t.intermission()
    val bytes = t.slot(0)
    assert((bytes(6) | bytes(7) << 8) == us(sof + sampleAfter(t)))
    assert(math.abs(t.time - us(t.device.cycle)) <= 4)
  }

  "CB-08: requests of one write" should "count as made in ascending order" in each { t =>
    t.setControl(0)
    t.requestAt(Seq(7, 3, 11).map(n => n -> base(0x222, n)): _*)
    t.setControl(1)
    sendsInOrder(t, Seq(3, 7, 11).map(n => base(0x222, n)))
  }

  "CB-08: a request" should "be offered within two bits and 64 cycles" in each { t =>
    t.setSlot(0, wire.frame)
    t.idle(5)
    val before = t.device.cycle
    t.device.write(CanRegisters.PortStarts.head + CanRegisters.Requests, Seq(1))
    t.awaitEdge(4)
    assert(t.device.cycle - before <= 2 * t.rate.bitCycles + CanUnderTest.AccessCycles)
  }

  "CB-09: a slot" should "be sent with the last bit of EOF, and lost with the bit that shows it" in
    at(Rate.Slow, OneShot) { t =>
      t.request(wire.frame)
      t.awaitSof()
      t.play("1" * (wire.levels.length - 1), wire.levels.tail)
      t.quietly("11")
      t.quanta("1" * 8, "0" * 8) // the error flag
      assert((t.pending, t.failed) == (0, 1))
    }

  "CB-12: slots and their maps" should "take what the rule says" in each { t =>
    t.setControl(0)
    t.setSlot(3, CanFrame(0x123, extended = false, remote = false, 2, Seq(0xaa, 0xbb)))
    // Of byte 4 the DLC, of byte 5 and the time stamp nothing.
    t.device.write(CanRegisters.SlotStarts.head + 3 * 16 + 4, Seq(0xf2, 0xff, 0xff, 0xff))
    assert(t.slot(3) == base(0x123, 0xaa, 0xbb).bytes())
    t.requestAt(3 -> base(0x123, 0xaa, 0xbb))
    t.setSlot(3, base(0x7ff))
    assert(t.slot(3) == base(0x123, 0xaa, 0xbb).bytes())
    t.abort(0xfff7)
    assert((t.pending, t.failed) == (8, 0))
    t.abort(8)
    assert((t.pending, t.failed) == (0, 8))
    t.requestAt(3 -> base(0x123, 0xaa, 0xbb))
    assert((t.pending, t.failed) == (8, 0))
    t.setControl(1)
    t.awaitSof(14)
    t.hearRest(Wire(base(0x123, 0xaa, 0xbb)))
    t.intermission()
    assert((t.pending, t.sent) == (0, 8))
    t.clearSent(0xfff7)
    assert(t.sent == 8)
    t.setControl(0)
    t.requestAt(3 -> base(0x123))
    assert((t.pending, t.sent) == (8, 0))
    t.setControl(1)
    t.awaitSof(14)
    t.hearRest(Wire(base(0x123)))
    t.intermission()
    assert((t.pending, t.sent) == (0, 8))
    t.clearSent(8)
    assert(t.sent == 0)
    t.setControl(0)
    t.requestAt(4 -> base(1))
    t.abort(1 << 4)
    t.clearFailed(1 << 4)
    assert(t.failed == 0)
  }

  "CB-12: the upper 18 bits of an identifier of 11" should "count for nothing" in each { t =>
    t.setControl(0)
    def upper(slot: Int) = t.device.write(CanRegisters.SlotStarts.head + slot * 16 + 1, Seq(0xf9, 0xff, 0x1f))
    t.setSlot(0, base(0x123))
    upper(0) // the low three bits of this byte stay
    t.requestAt(1 -> base(0x124), 2 -> base(0x122))
    t.device.write(CanRegisters.PortStarts.head + CanRegisters.Requests, Seq(1, 0))
    t.setControl(1)
    sendsInOrder(t, Seq(0x122, 0x123, 0x124).map(base(_)))
  }

  "CB-13: sending and receiving" should "show the role in the frame" in at(Rate.Slow) { t =>
    val (sending, receiving, active) = (1 << 4, 1 << 5, CanState.Active)
    assert(t.status == active)
    t.request(wire.frame)
    t.awaitSof()
    t.play("1" * (wire.levels.length - 1), wire.levels.tail)
    t.quietly(Wire.Acked)
    t.quanta("1" * 25)
    assert(t.status == (active | sending))
    t.idle(12)
    assert(t.status == active)
    t.quietly(wire.levels)
    t.play(Wire.Ack, Wire.Acked)
    t.quanta("1" * 25)
    assert(t.status == (active | receiving))
    t.idle(12)
    assert(t.status == active)
    val exception = Wire(wire.frame, fdf = '1')
    t.quietly(exception.levels.take(exception.at("fdf") + 1))
    assert(t.status == (active | 8))
    t.idle(12)
    t.setControl(0)
    t.setControl(1)
    assert(t.status == (active | 8))
    t.idle(12)
    assert(t.status == active)
  }
}

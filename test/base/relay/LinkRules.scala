package flyframe.relay

import flyframe.can.CanFrame
import flyframe.registers.RingRegisters

/** Links and passing on: FR-40 to FR-49. */
trait LinkRules extends RelayCases {
  private val vectorFrame =
    CanFrame(0x0022e041, extended = true, remote = false, 4, Seq(0x05, 0x07, 0x41, 0x42))
  private val vectorHeader = LinkHeader(0, 0, 23, 0x105, 255)

  for (ppm <- Seq(-1000, 0, 1000))
    s"FR-40, RB-05: a neighbour whose bits are longer by $ppm ppm" should "be understood" in bench() { b =>
      b.ppm = ppm
      for (i <- 0 until 40) b.send(0, from(3, i), data(0x1fffffff, Seq.fill(i % 9)(0xff): _*))
      b.finish()
      assert(b.received().size == 40)
      assert(b.frames(1).count(f => f.isGood && f.header.source == 3) == 40)
    }

  "FR-41, FR-42: the frame of the specification" should "have its bits, and pass" in bench() { b =>
    val body = LinkBody.of(vectorHeader, vectorFrame)
    assert(vectorHeader.word == 0x05c105 && vectorHeader.check == 0x61)
    assert((body.total - 32 until body.total).map(body(_)) == LinkFrame.bits(0xa722243b, 32))
    assert(LinkFrame.levels(vectorHeader, body).length == 156)
    assert(vectorHeader.copy(hops = 254).check == 0x4e)
    val digits = "123456789".flatMap(c => LinkFrame.bits(c, 8))
    assert(LinkCrc.of(digits) == 0xfc891918)
    assert((digits.foldLeft(LinkCrc.Start8)(LinkCrc.next8) ^ 0xff) == 0xdf)
    b.send(1, vectorHeader, vectorFrame)
    b.finish()
    val Seq(passed) = b.frames(0).filter(_.header.source == 23)
    assert(passed.isGood && passed.header == vectorHeader.copy(hops = 254))
    assert(passed.body == (0 until body.total).map(body(_)))
    assert(b.received() == Seq(vectorFrame))
  }

  "FR-42, RB-01: six equal bits" should "break a frame off" in bench() { b =>
    val good = RelayBench.levels(from(3, 1), data(5, 1, 2))
    b.send(0, good.take(120) ++ Seq.fill(6)(!good(119)) ++ Seq.fill(20)(true))
    b.send(0, from(3, 2), data(6, 3))
    b.finish()
    assert(b.received() == Seq(data(6, 3)) && counter(b, RelayCounter.BadFrame) == 1)
    assert(b.frames(1).filter(_.header.source == 3).map(_.isGood) == Seq(false, true))
  }

  "FR-43, RB-02: an abort" should "end a frame, and is no error of this link" in bench() { b =>
    b.send(
      0,
      RelayBench.levels(from(3, 1), data(5, 1, 2)).take(90) ++ Seq.fill(7)(false) ++ Seq.fill(8)(true)
    )
    b.send(0, from(3, 2), data(6, 3))
    b.finish()
    assert(b.received() == Seq(data(6, 3)) && counter(b, RelayCounter.BadFrame) == 0)
    assert(counter(b, RelayCounter.Aborted) == 1)
  }

  "FR-44: gaps" should "be of one bit before frames that pass, of nine before own ones" in bench() { b =>
    b.write(flyframe.registers.RingRegisters.Confirm, 1000 & 0xff, 1000 >> 8)
    for (i <- 0 until 6) b.send(0, from(3, i), data(0x100 + i, 1, 2, 3))
    b.run(80)
    b.request(0, data(1, 9))
    b.finish()
    val sent = b.frames(1).filter(_.header.kind == LinkKind.Data)
    assert(sent.size == 7 && sent.forall(_.isGood))
    for ((a, next) <- sent.zip(sent.drop(1))) {
      val gap = next.start - a.end - LinkFrame.EndBits
      assert(if (next.header.source == 7) gap >= 9 else gap >= 1, sent)
    }
    assert(sent.zip(sent.drop(1)).exists { case (a, next) => next.start - a.end == 8 })
  }

  "FR-45: a header with a wrong check" should "be ignored up to idle" in bench() { b =>
    for (i <- 1 to 40) {
      val levels = RelayBench.levels(from(3, 1), data(5, 1)).toArray
      levels(i) = !levels(i)
      b.send(0, levels.toSeq ++ Seq.fill(16)(true))
    }
    b.send(0, from(3, 2), data(6, 3))
    b.finish()
    assert(b.received() == Seq(data(6, 3)))
    assert(b.frames(1).count(_.header.source == 3) == 1)
    // Seven dominant bits are taken for an abort.
    assert(counter(b, RelayCounter.BadHeader) + counter(b, RelayCounter.BadFrame) >= 38)
    assert(counter(b, RelayCounter.BadHeader) > 20)
  }

  "FR-45: own frames and strays" should "not be passed on" in bench() { b =>
    b.send(0, from(7, 0), data(5, 1))
    b.send(0, from(3, 2, hops = 0), data(6, 3))
    b.send(0, from(3, 3, hops = 1), data(6, 4))
    b.finish()
    assert(b.frames(1).filter(_.header.kind == 0).map(f => (f.header.sequence, f.header.hops)) == Seq((3, 0)))
    assert(counter(b, RelayCounter.Stray) == 1)
    assert(b.received() == Seq(data(6, 3), data(6, 4)))
  }

  for (port <- 0 to 1)
    s"FR-45: with port ${port + 1} alone up frames" should "go back by it" in bench() { b =>
      b.up(1 - port) = false
      b.run(20)
      b.send(port, from(3, 1), data(5, 1))
      b.finish()
      assert(b.frames(port).exists(f => f.isGood && f.header == from(3, 1, hops = 249)))
      assert(!b.frames(1 - port).exists(_.header.source == 3) && counter(b, RelayCounter.Wrapped) == 1)
      assert(b.received() == Seq(data(5, 1)))
    }

  "FR-46: the first bit" should "leave at most 60 bits behind the start, whatever the stuffing" in bench() {
    b =>
      // Kind, source and sequence with long runs of equal bits.
      for (source <- Seq(1, 3, 64, 124); sequence <- Seq(0, 1, 0x2000, 0x3fff); hops <- Seq(1, 128, 250)) {
        val at = b.now
        b.send(0, from(source, sequence, hops = hops), data(5, 1))
        b.finish()
        val Seq(f) = b.frames(1, at)
        assert(f.start - at <= 60, s"$source $sequence $hops")
      }
  }

  // The start lies in bit 0; all places behind the check.
  "FR-47, RB-03, RB-10: a frame that proves bad" should "never leave good" in bench() { b =>
    val good  = RelayBench.levels(from(3, 1), data(0x1234567, 1, 2, 3, 4)) ++ Seq.fill(7)(true)
    val first = b.now
    for (i <- 50 until good.size) b.send(0, good.updated(i, !good(i)) ++ Seq.fill(24)(true))
    b.finish()
    val sent = b.frames(1, first)
    assert(sent.size > 60 && sent.forall(!_.isGood), sent.filter(_.isGood))
    assert(b.received().isEmpty)
    assert(counter(b, RelayCounter.Aborted) == good.size - 50)
  }

  it should "be ended when the signal is lost, or nothing more comes" in bench() { b =>
    val first = b.now
    val good  = RelayBench.levels(from(3, 1), data(5, 1, 2, 3, 4))
    b.send(0, good.take(100))
    b.finish()
    b.send(0, good.take(100))
    b.run(95)
    b.up(0) = false
    b.run(300)
    assert(b.frames(1, first).map(_.isGood) == Seq(false, false) && b.received().isEmpty)
  }

  "RB-06: kinds and bits of later versions" should "pass, and not be delivered" in bench() { b =>
    b.send(0, from(3, 1).copy(kind = 2), data(5))
    b.send(0, reserved(from(3, 2), 5 | 1 << 29))
    b.finish()
    assert(
      b.frames(1).filter(_.header.source == 3).map(f => (f.header.kind, f.isGood)) == Seq(
        2 -> true,
        0 -> true
      )
    )
    assert(b.received().isEmpty)
  }

  "RB-06, FR-61: a start of a life with bits of later versions" should "pass, and begin no life" in bench() {
    b =>
      for ((word, length) <- Seq((1 << 29, 0), (1 << 11, 0), (0, 1 << 4), (0, 1 << 7))) {
        val first             = b.now
        def starts(life: Int) = from(3, life).copy(kind = LinkKind.Start)
        b.send(0, starts(1), CanFrame(0, extended = false, remote = false, 0, Nil))
        b.send(0, from(3, 10), data(1))
        b.send(0, reserved(starts(2), word, length))
        b.send(0, from(3, 10), data(2)) // the same life: it came before
        b.send(0, starts(3), CanFrame(0, extended = false, remote = false, 0, Nil))
        b.send(0, from(3, 10), data(3))
        b.finish()
        assert(b.received().map(_.id) == Seq(1, 3), s"word $word, length $length")
        val passed = b.frames(1, first).filter(_.header.source == 3)
        assert(passed.size == 6 && passed.forall(_.isGood))
      }
  }

  /** A frame without data that has these words behind its header, with its end. */
  private def reserved(header: LinkHeader, word: Int, length: Int = 0): Seq[Boolean] = {
    val body = new LinkBody
    val bits = LinkFrame.bits(word, 32) ++ LinkFrame.bits(length, 8)
    val crc  = LinkCrc.of(LinkFrame.bits(header.word, 24) ++ bits)
    (bits ++ LinkFrame.bits(crc, 32)).foreach(body.add)
    LinkFrame.levels(header, body).toSeq ++ Seq.fill(8)(true)
  }

  "FR-48, RB-07: four waiting frames" should "keep own ones back, and leave without a gap" in bench() { b =>
    b.write(flyframe.registers.RingRegisters.Confirm, 1000 & 0xff, 1000 >> 8)
    val first = b.now
    for (slot <- 0 until 16) b.request(slot, data(slot, 1, 2, 3, 4, 5, 6, 7, 8))
    for (i    <- 0 until 30) b.send(0, from(3, i), data(0x8000 + i))
    b.run(30 * 125 + 6000)
    val frames = b.frames(1, first)
    val gaps   = frames.zip(frames.drop(1)).map { case (a, next) => next.start - a.end }
    assert(frames.forall(_.isGood) && frames.count(_.header.source == 3) == 30)
    assert(gaps.contains(LinkFrame.EndBits) && counter(b, RelayCounter.Stray) == 0)
  }

  "RB-07: a link that is too full" should "lose what finds no room, and stop nothing" in bench() { b =>
    b.write(flyframe.registers.RingRegisters.Confirm, 1000 & 0xff, 1000 >> 8)
    b.ppm = -20000
    for (i <- 0 until 1500) b.send(0, from(3, i), data(0x8000 + i % 7), gap = 0)
    b.finish()
    b.run(1500)
    assert(counter(b, RelayCounter.Stray) > 0 && b.received().size == 64)
    assert(b.frames(1).filter(_.header.source == 3).forall(_.isGood))
    b.ppm = 0
    b.send(0, from(3, 1500), data(1))
    b.finish()
    assert(b.frames(1).last.header.sequence == 1500)
  }

  "FR-48: waiting frames" should "leave in CAN order" in bench() { b =>
    val first = b.now
    b.request(0, data(0x1000, 1, 2, 3, 4, 5, 6, 7, 8))
    b.run(20)
    for ((id, i) <- Seq(0x900, 0x700, 0x800).zipWithIndex) b.send(0, from(3, i), data(id))
    b.run(600)
    val ids =
      b.frames(1, first).map(f => f.body.slice(3, 32).foldLeft(0)((n, x) => n << 1 | (if (x) 1 else 0)))
    // When the own frame is over the second one is there, and the third one while that leaves.
    assert(ids == Seq(0x1000, 0x900, 0x700, 0x800) || ids == Seq(0x1000, 0x700, 0x800, 0x900), ids)
    assert(b.frames(1, first).forall(_.isGood))
  }

  "FR-48, RB-08, RB-09, RB-28: an own frame" should "wait for frames that are before it only" in bench() {
    b =>
      val cases = Seq((0x100, 0x4000, true), (0x10000, 0x4000, false), (1 << 28, 3 << 27, false))
      for ((own, waiting, isFirst) <- cases) {
        val first = b.now
        b.request(0, data(0x8000, 1, 2, 3, 4, 5, 6, 7, 8))
        b.run(20)
        b.request(1, data(own))
        for (i <- 0 until 3) b.send(0, from(3, 10 + i + own & 0x3fff), data(waiting + i, 1))
        b.run(1000)
        val sources = b.frames(1, first).filter(_.header.hops != 0).map(_.header.source).take(5)
        assert(sources == (if (isFirst) Seq(7, 7, 3, 3, 3) else Seq(7, 3, 3, 3, 7)), own)
        b.isLooped = true // the copies come home when they are repeated
        b.run(3000)
        b.isLooped = false
        assert(b.map(flyframe.registers.CanRegisters.Requests) == 0)
        b.received()
      }
  }

  "RB-28: waiting frames of the second half" should "leave behind the others, as they came" in bench() { b =>
    b.write(flyframe.registers.RingRegisters.Confirm, 1000 & 0xff, 1000 >> 8)
    val first = b.now
    for (slot <- 0 to 1) b.request(slot, data(slot, 1, 2, 3, 4, 5, 6, 7, 8))
    b.run(20)
    val half = 1 << 28
    for ((id, i) <- Seq(half + 3, half + 2, half + 1, 5, half).zipWithIndex) b.send(0, from(3, i), data(id))
    b.run(1300)
    val ids = b.frames(1, first).filter(_.header.source == 3).map(_.body.slice(3, 32))
    val low = ids.map(_.drop(25).foldLeft(0)((n, x) => n << 1 | (if (x) 1 else 0)))
    assert(low.diff(Seq(5)) == Seq(3, 2, 1, 0) && low.indexOf(5) < 3, low)
  }

  /** `count` frames that come in a row behind an own frame, of which one waits at least; how many pass in
    * front of a second one, if it leaves at all. Each so many of these bits an urgent own frame is requested,
    * which comes home.
    */
  protected def passedBefore(
      b: RelayBench,
      own: Int,
      waiting: Int,
      output: Int = 1,
      urgentEach: Int = Int.MaxValue
  ): Option[Int] = {
    val count = 160
    b.write(flyframe.registers.RingRegisters.Confirm, 20000 & 0xff, 20000 >> 8)
    val first = b.now
    b.request(0, data(0, 1, 2, 3, 4, 5, 6, 7, 8))
    b.run(20)
    b.request(1, data(own, 1))
    for (i <- 0 until count) b.send(1 - output, from(3, i), data(waiting + i % 7, 1))
    var urgent = 0
    for (bits <- 1 to count * 145 / 100) {
      b.run(100)
      if (bits % urgentEach == 0 && urgent < 1) { // with more of them four wait
        urgent += 1
        b.request(2 + urgent, data(urgent))
      }
    }
    def id(f: ReadFrame) = f.body.slice(3, 32).foldLeft(0)((n, x) => n << 1 | (if (x) 1 else 0))
    val frames           = b.frames(output, first).filter(_.header.hops != 0)
    val passed           = frames.takeWhile(id(_) != own)
    if (urgentEach < Int.MaxValue) assert(passed.count(_.header.source == 7) == 2)
    val others = passed.count(_.header.source == 3)
    assert(others > 125)
    Option.when(passed.size < frames.size)(others)
  }

  "RB-28: an own frame of the second half" should "leave behind 127 that pass at the latest" in {
    for (output <- 0 to 1) bench() { b =>
      assert(passedBefore(b, own = 3 << 27, waiting = 1 << 28, output).contains(127), output)
    }
  }

  it should "do so beside urgent own frames, too" in bench() { b =>
    assert(passedBefore(b, own = 3 << 27, waiting = 1 << 28, urgentEach = 100).contains(127))
  }

  it should "wait for those of the first half, and so should one of the first half" in {
    for (own <- Seq(3 << 27, 0x10000)) bench() { b =>
      assert(passedBefore(b, own, waiting = 0x4000).forall(_ == 160), own)
    }
  }

  "RB-15, RB-20: a port that goes down with another length of the bits, in any cycle around a header" should
    "end the frame" in bench() { b =>
      val passed = counter(b, RelayCounter.Passed)
      val bits   = RelayBench.levels(from(3, 0), data(1)).size
      var good   = 0
      def left   = counter(b, RelayCounter.Passed) - passed & 0xff
      for (cycles <- 40 * b.bit until 46 * b.bit by 2) {
        b.send(0, from(3, cycles), data(1))
        for (_ <- 0 until cycles) b.cycle()
        b.write(RingRegisters.LinkBit, b.bit + 1, 0)
        b.up(0) = false
        b.run(bits)
        assert(left - good == counter(b, RelayCounter.Aborted), s"what begins is ended, $cycles cycles")
        b.write(RingRegisters.LinkBit, b.bit, 0)
        b.up(0) = true
        b.run(40)
        val first = b.now
        b.send(0, from(4, cycles), data(2))
        b.run(bits + 100)
        assert(b.frames(1, first).map(f => f.header.source -> f.isGood) == Seq(4 -> true), s"$cycles cycles")
        good += 1
      }
      assert(counter(b, RelayCounter.Aborted) > 0, "some had begun to leave")
    }

  "FR-49, RB-15: what waits for a port that goes down" should "be dropped" in bench() { b =>
    b.request(0, data(1, 1, 2, 3, 4, 5, 6, 7, 8))
    b.run(20)
    b.send(0, from(3, 1), data(5, 1))
    b.run(120)
    b.up(1) = false
    b.run(60)
    b.up(1) = true
    b.run(600)
    assert(!b.frames(1).exists(_.header.source == 3))
    assert(b.received() == Seq(data(5, 1)))
  }
}

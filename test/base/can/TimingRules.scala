package flyframe.can

import flyframe.params.CanParams

/** Rules of the bit timing (CAN-01 to CAN-06, CB-01 to CB-04, CB-15). */
abstract class TimingRules extends CanCases {
  import CanCases._

  private val wire  = Wire(base(0x7e1, 0x55)) // SOF is followed by recessive
  private val stuff = wire.stuffBits.head

  /** A controller that has been told to start with this setting. */
  private def started(prescaler: Int, setting: BitSetting, control: Int = 0)(
      body: LowerTester => Unit
  ): Unit =
    withDevice(CanParams()) { device =>
      val t = new LowerTester(device, Rate(s"$prescaler x $setting", prescaler, setting))
      t.start(control)
      body(t)
    }

  for (
    (prescaler, s) <- Seq(
      7    -> BitSetting(6, 1, 1), // 8 tq
      5    -> BitSetting(1, 6, 6),
      1    -> BitSetting(64, 16, 16),
      1    -> BitSetting(50, 9, 3),
      2048 -> BitSetting(5, 2, 2)
    )
  )
    s"CAN-01: a bit with prescaler $prescaler, TSEG1 ${s.tseg1} and TSEG2 ${s.tseg2}" should
      "last as long as that says" in started(prescaler, s) { t =>
        t.request(wire.frame)
        t.awaitEdge(14)
        val sof = t.device.run(others = true, 2 * t.rate.bitCycles)
        assert(sof.takeWhile(level => !level).size == prescaler * (1 + s.tseg1 + s.tseg2))
        if (prescaler < 100) {
          t.silently("1" * (60 + 60)) // the frame, its error frame, and a part of the next attempt
          t.setControl(0)
          t.setControl(1)
          t.awaitSof(12)
          t.hearFrom(wire, 1)
        }
      }

  for (
    (what, control, s) <- Seq(
      ("less than 8 tq", 0, BitSetting(3, 3, 1)),
      ("SJW above TSEG2", 0, BitSetting(10, 3, 4)),
      ("three samples with TSEG1 1", ThreeSamples, BitSetting(1, 8, 1))
    )
  ) s"CAN-01, CB-04: a setting with $what" should "keep the port stopped" in started(5, s, control) { t =>
    assert(t.status == 1 << 6)
    t.request(wire.frame)
    t.idle(40)
    assert((t.pending, t.status) == (1, 1 << 6))
    // With another one it starts.
    t.setControl(0)
    t.setTiming(5, BitSetting(10, 4, 4))
    assert(t.status == 0)
    t.setControl(1)
    assert(t.state == CanState.Active)
  }

  for (
    (prescaler, tseg1, runs) <-
      Seq((1, 1, false), (1, 2, false), (1, 3, true), (2, 1, false), (2, 2, true), (3, 1, true))
  )
    s"CB-15: TSEG1 of $tseg1 tq of $prescaler core cycles" should
      (if (runs) "be possible" else "keep the port stopped") in
      started(prescaler, BitSetting(tseg1, 7, 4)) { t =>
        assert(t.state == (if (runs) CanState.Active else CanState.Stopped))
        assert((t.status >> 6 & 1) == (if (runs) 0 else 1))
      }

  "CAN-01: the bit timing" should "not be writable while the port runs" in each { t =>
    t.setTiming(99, BitSetting(20, 10, 5))
    t.sendAcked(wire)
    t.setControl(0)
    t.setControl(1)
    t.idle(12)
    t.sendAcked(wire)
  }

  /** The stuff bit is dominant but for some quanta, counted back from the sample point. */
  private def glitches(t: LowerTester, quanta: Set[Int], isGood: Boolean): Unit = {
    val s   = t.rate.setting
    val bit = (0 until s.length).map(k => if (quanta(s.tseg1 - k)) '1' else '0').mkString
    t.quietly(wire.levels.take(stuff))
    t.quanta(bit)
    if (isGood) {
      t.quietly(wire.levels.drop(stuff + 1))
      t.play(Wire.Ack, Wire.Acked)
      t.quietly(Wire.Eof + Wire.Intermission)
    } else t.errorFrame()
  }

  "CAN-02: a sample" should "be taken behind TSEG1, and nowhere else" in each { t =>
    glitches(t, Set(1, 2, -1), isGood = true)
    glitches(t, Set(0), isGood = false)
  }

  "CAN-02: the majority of three samples" should "count" in eachWith(ThreeSamples) { t =>
    for (quanta <- Seq(0, 1, 2).toSet.subsets()) glitches(t, quanta, isGood = quanta.size < 2)
    glitches(t, Set(3, -1), isGood = true)
  }

  "CAN-03: an edge while integrating" should "synchronise hard, and the count begin anew" in each { t =>
    val s = t.rate.setting
    for (phase <- 0 until s.length; recessive <- Seq(10, 11)) {
      t.setControl(0)
      t.setControl(1)
      t.quietly("1" * 4)
      t.quanta("1" * phase)
      t.quietly("0" + "1" * recessive)
      if (recessive == 11) t.sendAcked(wire)
      else t.quietly(wire.levels + Wire.Acked + Wire.Eof)
      t.intermission()
    }
  }

  "CAN-03: an edge in the first bit of the intermission" should "not synchronise hard" in each { t =>
    val s = t.rate.setting
    t.sendAcked(wire)
    // Edge in quantum 4: TSEG1 becomes longer by SJW; then the overload flag.
    val toFlag = s.length - (4 - s.sjw)
    t.quanta("1" * 4 + "0" * toFlag + "1" * 6 * s.length, "1" * (4 + toFlag) + "0" * 6 * s.length)
    t.delimiter()
  }

  "CAN-03: edges in the rest of the interframe space" should "synchronise hard" in each { t =>
    val s = t.rate.setting
    t.sendAcked(wire)
    t.quietly("1")
    // Edge in quantum 4 of the second bit: the flag begins a bit later.
    t.quanta("1" * 4 + "0" * s.length + "1" * 6 * s.length, "1" * (4 + s.length) + "0" * 6 * s.length)
    t.delimiter()
    t.intermission()
    for (phase <- 1 until s.length) { // idle
      t.quanta("1" * phase)
      t.quanta("0" * (s.tseg1 + 1) + "1" * s.tseg2)
      t.quietly(wire.levels.tail)
      t.play(Wire.Ack, Wire.Acked)
      t.quietly(Wire.Eof + Wire.Intermission)
    }
  }

  /** A frame whose bits are longer or shorter by a quantum every `period` bits. */
  private def drifting(t: LowerTester, by: Int, period: Int): Unit = {
    val frame          = Wire(base(0x4d2, 0x1f, 0x83, 0xe0, 0x7c)) // five equal bits again and again
    val s              = t.rate.setting
    def length(i: Int) = s.length + (if (i % period == 0) by else 0)
    for ((level, i) <- frame.levels.zipWithIndex) t.quanta(level.toString * length(i))
    val ack = t.quanta("1" * s.length + "1" * s.length)
    assert(ack.drop(s.length + 2).dropRight(2).forall(_ == '0'), "no acknowledgement")
    t.quietly("1" + Wire.Eof + Wire.Intermission)
    assert(t.received() == Seq(frame.frame))
  }

  "CAN-04: bits that are longer or shorter" should "be followed by resynchronisation" in each { t =>
    for (by <- Seq(-1, 1); period <- 5 to 8) drifting(t, by, period)
  }

  "CAN-05: a second edge between two samples" should "not synchronise" in each { t =>
    val s = t.rate.setting
    for (glitch <- 1 until s.tseg1) {
      t.quietly(wire.levels.take(stuff))
      // As long as it has to be when the first edge alone counts, and one quantum less.
      val bit = "0" * (s.tseg1 + 1) + "1" * s.tseg2
      t.quanta(bit.updated(glitch, '1').mkString)
      t.quietly(wire.levels.drop(stuff + 1))
      t.play(Wire.Ack, Wire.Acked)
      t.quietly(Wire.Eof + Wire.Intermission)
      t.quietly(wire.levels.take(stuff))
      t.quanta(bit.updated(s.tseg1, '1').updated(glitch, '1').mkString)
      t.errorFrame()
    }
  }

  "CAN-06: an own dominant bit that is heard late" should "not be made longer" in each { t =>
    val s    = t.rate.setting
    val wire = Wire(base(0x555, Seq.fill(8)(0x55): _*))
    var late = 0
    t.request(wire.frame)
    t.awaitSof()
    for (i <- 1 until wire.levels.length) {
      val isLate = wire.levels.slice(i - 1, i + 1) == "10" && late < s.tseg1
      if (isLate) late += 1
      val forced = if (isLate) late else 0
      t.quanta("R" * forced + "1" * (s.length - forced), wire.levels(i).toString * s.length)
    }
    assert(late == s.tseg1)
    t.hearFrom(wire, wire.levels.length)
  }

  "CB-01: levels" should "be heard in the last cycle of a quantum, and change with the first of one" in each {
    t =>
      val p = t.rate.prescaler
      t.request(wire.frame)
      t.awaitSof()
      t.quietly("1111")
      // The fifth bit of the five recessive ones: dominant only in cycles that are not heard.
      for (k <- 0 until t.rate.setting.length) {
        val levels = t.device.run(others = false, p - 1) ++ t.device.run(others = true, 1)
        assert(levels.forall(identity), s"quantum $k")
      }
      t.play("1", "0") // the stuff bit: no bit error, no lost arbitration
      t.hearFrom(wire, stuff + 1)
  }

  "CB-02: a bit that begins with the quantum of an early edge" should "be driven from its next one on" in
    each { t =>
      val s    = t.rate.setting
      val wire = Wire(base(0x555))
      t.request(wire.frame)
      t.awaitSof()
      t.quanta("1" * (s.length - 1) + "0" + "1" * (s.length - 1), "1" * s.length + "0" * (s.length - 1))
      t.hearFrom(wire, 3)
    }

  "CB-03: dominant pulses that meet no sample point" should "let the eleven bits begin anew" in each { t =>
    val exception = Wire(Frames.head, fdf = '1')
    t.quietly(exception.levels.take(exception.at("fdf") + 1))
    t.quietly("1" * 10)
    t.quanta("0" + "1" * (t.rate.setting.length - 1))
    t.quietly("1" * 9)
    t.quietly(wire.levels + Wire.Acked + Wire.Eof + Wire.Intermission) // only 10 were there
    t.sendAcked(wire)
  }

  "CB-04: a stop" should "release the bus at once, and keep slots, counters and bus-off" in each { t =>
    t.request(Frames.head)
    t.awaitSof()
    t.play("1", "0")
    t.setControl(0)
    assert(t.device.driven)
    t.idle(30)
    assert((t.state, t.pending, t.failed) == (CanState.Stopped, 1, 0))
    t.setControl(1)
    t.awaitSof(12)
    t.hearFrom(Wires.head, 1)
    t.intermission()
    t.request(Frames.head)
    t.awaitSof()
    becomesBusOff(t, Wires.head.levels)
    t.setControl(0)
    assert((t.state, t.tec) == (CanState.Stopped, 256))
    t.setControl(1)
    t.idle(200)
    assert((t.state, t.tec, t.pending) == (CanState.BusOff, 256, 1))
  }

  "CB-04: a stop with one attempt" should "let the frame fail" in eachWith(OneShot) { t =>
    t.request(Frames.head)
    t.awaitSof()
    t.setControl(OneShot)
    assert((t.pending, t.failed) == (0, 1))
  }
}

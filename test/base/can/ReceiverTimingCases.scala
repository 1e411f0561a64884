package flyframe.can

/** Conformance cases 7.7: bit timing of a receiver, quantum by quantum. */
abstract class ReceiverTimingCases extends CanCases {
  import CanCases._

  // Five recessive bits, a dominant stuff bit, a recessive bit.
  private val wire  = Wire(base(0x7e1, 0x55))
  private val stuff = wire.stuffBits.head

  /** Quanta from an edge to the end of the bit that begins with it, at a controller that resynchronises.
    *
    * @param error
    *   quanta by which the edge is late; negative: early
    */
  private def length(s: BitSetting, error: Int): Int =
    if (error >= 0) s.length - (error - s.sjw max 0) else s.length + (-error - s.sjw max 0)

  /** A frame whose first stuff bit comes late or early.
    *
    * @param short
    *   quanta by which the bit ends in front of the sample point
    * @param glitch
    *   a quantum of it that is recessive, from 0
    */
  private def frame(t: LowerTester, error: Int, short: Int, glitch: Int): Unit = {
    val s        = t.rate.setting
    val all      = length(s, error)
    val dominant = all - s.tseg2 - short
    t.quietly(wire.levels.take(stuff - 1))
    val bit = "0" * dominant + "1" * (all - dominant)
    t.quanta("1" * (s.length + error) + bit.zipWithIndex.map { case (l, i) =>
      if (i == glitch) '1' else l
    }.mkString)
    if (short > 0) t.errorFrame()
    else {
      t.quietly(wire.levels.drop(stuff + 1))
      t.play(Wire.Ack, Wire.Acked)
      t.quietly(Wire.Eof)
      t.intermission()
      assert(t.received() == Seq(wire.frame))
    }
  }

  /** With the bit as short as it may be, and one quantum shorter. */
  private def isSampled(t: LowerTester, error: Int, glitch: Int = -1): Unit = {
    frame(t, error, short = 0, glitch)
    frame(t, error, short = 1, glitch)
  }

  "CC-7.7.1: a stuff bit shortened by TSEG2" should "be right, by one more an error" in each(isSampled(_, 0))

  "CC-7.7.2: a SOF that comes early, by up to a bit," should "synchronise hard" in each { t =>
    val s = t.rate.setting
    for (early <- 1 to s.length) {
      t.sendAcked(wire)
      t.quanta("1" * (3 * s.length - early))
      // Dominant up to the sample point only.
      t.quanta("0" * (s.tseg1 + 1) + "1" * s.tseg2)
      t.quietly(wire.levels.tail)
      t.play(Wire.Ack, Wire.Acked)
      t.quietly(Wire.Eof)
      t.intermission()
      assert(t.received() == Seq(wire.frame, wire.frame), s"early by $early")
    }
  }

  "CC-7.7.3: positive phase errors up to SJW" should "be made up for" in each { t =>
    for (error <- 1 to t.rate.setting.sjw) isSampled(t, error)
  }

  "CC-7.7.4: positive phase errors above SJW" should "be made smaller by SJW" in each { t =>
    for (error <- t.rate.setting.sjw + 1 until t.rate.setting.tseg1) isSampled(t, error)
  }

  "CC-7.7.5: negative phase errors up to SJW" should "be made up for" in each { t =>
    for (error <- 1 to t.rate.setting.sjw) isSampled(t, -error)
  }

  "CC-7.7.6: negative phase errors above SJW" should "be made smaller by SJW" in
    all(Seq(1, 2)) { (first, sjw) =>
      at(first.rate.copy(setting = first.rate.setting.copy(sjw = sjw))) { t =>
        for (error <- sjw + 1 to t.rate.setting.tseg2) isSampled(t, -error)
      }
    }

  "CC-7.7.7: a recessive glitch in a dominant bit" should "not synchronise a second time" in
    each(isSampled(_, 0, glitch = 3))

  "CC-7.7.8: such a glitch behind an early edge" should "not synchronise a second time" in
    each(isSampled(_, -1, glitch = 3))

  /** The bus was idle all the time: a frame is received now. */
  private def isIdle(t: LowerTester): Unit = {
    t.idle(12)
    assert(t.counters.forall(_ == 0))
    t.sendAcked(wire)
    t.intermission()
    assert(t.received() == Seq(wire.frame))
  }

  "CC-7.7.9.1: a dominant pulse that ends in front of the sample point" should "be no SOF" in each { t =>
    val s = t.rate.setting
    for (quanta <- 1 until s.tseg1) {
      t.quanta("0" * quanta + "1" * s.length, "1" * (quanta + s.length))
      isIdle(t)
    }
  }

  "CC-7.7.9.2: three such pulses" should "be no SOF" in each { t =>
    val s = t.rate.setting
    // The first one synchronises, the second one must not: the gap behind it lies at the sample point of the
    // first, and the third one where a sample would be that belonged to the second.
    val first   = (s.tseg1 - 2) / 2
    val pattern = "0" * first + "11" + "0" * (s.tseg1 - 2 - first) + "1" + "0" * (s.tseg1 - 2)
    t.quanta(pattern, "1" * pattern.length)
    isIdle(t)
  }

  "CC-7.7.10: a recessive glitch between dominant samples" should "not synchronise" in all(Seq(0, 1)) {
    (t, short) =>
      val s     = t.rate.setting
      val wire  = Wire(base(0x7d5, 0x55)) // two dominant bits, the stuff bit and the next one
      val stuff = wire.stuffBits.head
      t.quietly(wire.levels.take(stuff))
      t.quanta("0" * (s.tseg1 + 1) + "1" + "0" * (s.tseg2 - 1))
      t.quanta("0" * (s.tseg1 + 1 - short) + "1" * (s.tseg2 + short))
      t.quietly(wire.levels.drop(stuff + 2))
      if (short == 0) t.play(Wire.Ack, Wire.Acked)
      else {
        t.quietly(Wire.Ack)
        t.errorFrame()
        assert(t.lastError._1 == CanError.Crc)
      }
  }

  "CC-7.7.11: a negative phase error on the ACK bit" should "make it begin and end early" in
    all(Seq(1, 2, 3)) { (t, early) =>
      val s    = t.rate.setting
      val late = early - s.sjw max 0
      t.quietly(wire.levels)
      // CRC delimiter, and another node's ACK bit; that of the controller begins one quantum behind the edge.
      // Behind its sample point it is heard recessive.
      t.quanta(
        "1" * (s.length - early) + "0" * (s.tseg1 + 1 + late) + "R" * s.tseg2,
        "1" * (s.length - early) + "1" + "0" * (s.length - 1 + late)
      )
      t.quietly("1" + Wire.Eof + Wire.Intermission)
      assert(t.received() == Seq(wire.frame))
    }
}

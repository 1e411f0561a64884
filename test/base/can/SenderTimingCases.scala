package flyframe.can

import scala.collection.mutable

/** Conformance cases 8.7: bit timing of a transmitter, quantum by quantum. Its bits begin with those of the
  * others.
  */
abstract class SenderTimingCases extends CanCases {
  import CanCases._

  /** The same bit timing with another SJW. */
  private def withSjw(rate: Rate, sjw: Int): Rate = rate.copy(setting = rate.setting.copy(sjw = sjw))

  /** Levels from `from` on, and the acknowledgement. */
  private def rest(t: LowerTester, wire: Wire, from: Int): Unit = {
    t.hearFrom(wire, from)
    t.idle(12)
    assert(t.counters.forall(_ == 0))
  }

  "CC-8.7.1: the own stuff bit, shortened by TSEG2," should "be right, by one more an error" in
    all(Seq(0, 1)) { (t, short) =>
      val s     = t.rate.setting
      val wire  = Wire(base(0x7e1, 0x55))
      val stuff = wire.stuffBits.head
      t.request(wire.frame)
      t.awaitSof()
      t.play("1" * (stuff - 1), wire.levels.slice(1, stuff))
      t.quanta("1" * (s.tseg1 + 1 - short) + "R" * (s.tseg2 + short), "0" * s.length)
      if (short == 0) rest(t, wire, stuff + 1)
      else {
        t.errorFrame()
        t.hear(wire)
      }
    }

  /** One frame is sent, another one is pending, and two bits of the intermission are over. */
  private def twoFrames(t: LowerTester): Wire = {
    val Seq(first, second) = Frames.sortBy(_.order).map(Wire(_))
    t.request(Frames: _*)
    t.awaitSof()
    t.hearRest(first)
    t.quietly("11")
    second
  }

  "CC-8.7.2: dominant just in front of the sample point of intermission bit 3" should
    "synchronise hard, and the identifier follow" in each { t =>
      val s      = t.rate.setting
      val second = twoFrames(t)
      t.quanta("1" * s.tseg1 + "0" * s.length, "1" * (s.tseg1 + s.length))
      rest(t, second, 1)
    }

  "CC-8.7.3: dominant just behind that sample point" should
    "make the own SOF begin with the next tq" in each { t =>
      val s      = t.rate.setting
      val second = twoFrames(t)
      t.quanta("1" * (s.tseg1 + 1) + "0" * s.length, "1" * (s.tseg1 + 1) + "1" + "0" * (s.length - 1))
      rest(t, second, 1)
    }

  // A recessive bit and a dominant one behind it.
  private val wire = Wires.head
  private val at   = wire.levels.indexOf("101")

  /** An edge comes `early` quanta in front of the end of a recessive bit that the controller sends. */
  private def earlyEdge(t: LowerTester, early: Int): Unit = {
    val s    = t.rate.setting
    val left = early - s.sjw max 0 // quanta of the recessive bit from the edge on
    t.request(wire.frame)
    t.awaitSof()
    t.play("1" * (at - 1), wire.levels.slice(1, at))
    // With nothing left the quantum of the edge is the first one of the dominant bit, which is over already.
    val own = if (left == 0) "1" + "0" * (s.length - 1) else "1" * left + "0" * s.length
    t.quanta("1" * (s.length - early) + "0" + "1" * (own.length - 1), "1" * (s.length - early) + own)
    rest(t, wire, at + 2)
  }

  "CC-8.7.4: negative phase errors up to SJW" should "make the next bits begin early" in each { t =>
    for (early <- 1 to t.rate.setting.sjw) earlyEdge(t, early)
  }

  "CC-8.7.5: negative phase errors above SJW" should "make them begin early by SJW" in all(Seq(1, 2)) {
    (first, sjw) =>
      at(withSjw(first.rate, sjw))(t => for (early <- sjw + 1 to t.rate.setting.tseg2) earlyEdge(t, early))
  }

  "CC-8.7.6: a glitch in quantum 2 of an early bit" should "not synchronise a second time" in each { t =>
    val s = t.rate.setting
    t.request(wire.frame)
    t.awaitSof()
    t.play("1" * (at - 1), wire.levels.slice(1, at))
    t.quanta("1" * (s.length - 1) + "01R" + "1" * (s.length - 3), "1" * s.length + "0" * (s.length - 1))
    rest(t, wire, at + 2)
  }

  "CC-8.7.7: own edges that are heard two quanta late" should "not synchronise" in all(Wires) { (t, wire) =>
    val delay = mutable.Queue.fill(2 * t.rate.prescaler)(true)
    def quantum(others: Boolean): Char = {
      val level = t.device.driven
      for (_ <- 1 to t.rate.prescaler) {
        delay.enqueue(t.device.driven && others)
        t.device.step(delay.dequeue())
      }
      if (level) '1' else '0'
    }
    t.request(wire.frame)
    t.awaitEdge(4) // all was recessive up to now
    val expected = wire.levels + Wire.Ack + Wire.Eof + Wire.Intermission
    val others   = wire.levels.map(_ => '1') + Wire.Acked + Wire.Eof + Wire.Intermission
    val drove    = others.map(o => Seq.fill(t.rate.setting.length)(quantum(o == '1')).mkString).mkString
    assert(drove == expected.flatMap(_.toString * t.rate.setting.length))
    t.idle(12)
    assert(t.counters.forall(_ == 0) && t.sent == 1)
  }

  "CC-8.7.8: an edge right behind the sample point" should "be no bit error, and make the bit shorter" in
    all(Seq(1, 2, 3)) { (first, sjw) =>
      at(withSjw(first.rate, sjw))(t => earlyEdge(t, t.rate.setting.tseg2))
    }

  "CC-8.7.9: two recessive quanta around the sample point of a dominant bit" should
    "be an error, whose flag ends 6 bits and TSEG2 - SJW later" in all(Seq(1, 2)) { (first, sjw) =>
      at(withSjw(first.rate, sjw), OneShot) { t =>
        val s = t.rate.setting
        t.request(wire.frame)
        t.awaitSof()
        t.play("1" * at, wire.levels.slice(1, at + 1))
        val behind = 6 * s.length + s.tseg2 - s.sjw // the sample point
        t.quanta("1" * s.tseg1 + "RR" + "1" * (behind - 1), "0" * (s.tseg1 + 1 + behind))
        t.delimiter()
        t.idle(12)
        assert(t.failed == 1 && t.counters.sum == 1)
      }
    }
}

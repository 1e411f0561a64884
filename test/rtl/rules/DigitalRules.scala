package flyframe.rules

import flyframe.model.{Datagram, EtherCatFrame}
import flyframe.params.EscParams
import flyframe.protocol.Command._

/** Digital outputs and inputs without a host: PDI-11, SM-26, AL-07, WD-06, B-118. */
object DigitalRules extends Rules {
  private val (safeop, op)                 = (4, 8)
  private def outputs(p: EscParams)        = p.isDigitalIo && p.digitalOutputs > 0
  private def outputsAt(event: Int)        = (p: EscParams) => outputs(p) && p.digitalOutputEvent == event
  private def withSync(p: EscParams)       = outputs(p) && p.digitalOutputEvent > 1
  private def inputs(p: EscParams)         = p.isDigitalIo && p.digitalInputs > 0
  private def inputsAt(event: Int)         = (p: EscParams) => inputs(p) && p.digitalInputEvent == event
  private def levels(bytes: Seq[Int]): Int = bytes.zipWithIndex.map { case (b, i) => b << 8 * i }.sum
  private def both(a: EscParams => Boolean, b: EscParams => Boolean) = (p: EscParams) => a(p) && b(p)

  /** What the tests do with the outputs. */
  private class Outputs(s: Steps, trigger: Int = 0x44) {
    import s._
    private val count               = p.digitalOutputs
    val some: Seq[Int]              = Seq(0x5a, 0x81, 0x3c, 0x7e).take(count)
    val others: Seq[Int]            = some.map(_ ^ 0xff)
    def writes(v: Seq[Int]): Unit   = assert(put(0x0f00, v: _*))
    def shows(v: Seq[Int]): Boolean = bench.outputs.contains(levels(v))
    def none: Boolean               = bench.outputs.isEmpty
    def state(v: Int): Unit         = assert(put(0x0120, v, 0))

    // A SyncManager for each byte (SM-26), and 1 ms for the watchdog.
    if (p.syncManagers >= count) for (i <- 0 until count) syncManager(i, 0x0f00 + i, 1, trigger)
    assert(put(0x0420, 10, 0))
  }

  rule(
    "AL-05, AL-07, B-118: without a host AL status follows AL control, whatever the EEPROM says",
    _.isDigitalIo
  ) { s =>
    import s._
    for (v <- Seq(2, safeop, op, safeop, 0x12, 3, 1)) {
      assert(put(0x0120, v, 0) && get(0x0130, 2).contains(Seq(v, 0)))
      assert(get(0x0134, 2).contains(Seq(0, 0)), "no AL status code")
    }
    if (p.hasSii) assert(get(0x0140, 2).get.last % 2 == 1, "0x0141[0], of which the EEPROM says 0")
  }
  rule(
    "SM-26, PDI-11, B-68, B-118: in OP outputs show what a good frame has written, when it has ended",
    outputsAt(0)
  ) { s =>
    import s._
    val o = new Outputs(s)
    assert(o.none)
    o.state(safeop)
    o.writes(o.some)
    assert(o.none, "not in SAFEOP")
    o.state(op)
    assert(o.shows(o.some), "with the frame that brings OP")
    o.writes(o.others)
    assert(o.shows(o.others))
    spoiled(Datagram(Apwr, 0, 0x0f00, o.some))
    assert(o.shows(o.others) && get(0x0f00, p.digitalOutputs).contains(o.others), "a bad frame")
    o.state(safeop)
    assert(o.none, "OP is left")
    o.writes(o.some)
    assert(o.none)
    o.state(op)
    assert(o.shows(o.some))
    o.state(0x18)
    assert(o.shows(o.some), "OP all the same")
    o.state(1)
    assert(o.none)
  }
  rule(
    "WD-04, WD-05, B-118: outputs fall when the watchdog expires, and come with the frame that triggers it",
    both(outputs, p => p.digitalOutputEvent < 2 && p.digitalWatchdogLate == 0)
  ) { s =>
    import s._
    val o = new Outputs(s)
    o.state(op)
    assert(o.none, "not before a trigger")
    o.writes(o.some)
    assert(o.shows(o.some))
    bench.advanceUs(500)
    assert(o.shows(o.some))
    bench.advanceMs(2)
    assert(o.none && get(0x0440, 1).contains(Seq(0)) && get(0x0442, 1).contains(Seq(1)))
    assert(get(0x0f00, p.digitalOutputs).contains(o.some) && o.none, "the register stays")
    o.writes(o.others)
    assert(o.shows(o.others))
    assert(put(0x0420, 0, 0))
    bench.advanceMs(2)
    assert(o.shows(o.others), "watchdog time 0: off")
  }
  rule(
    "WD-05, B-118: with digitalWatchdogLate outputs fall with the event behind the watchdog's expiry",
    both(outputsAt(0), _.digitalWatchdogLate == 1)
  ) { s =>
    import s._
    val o = new Outputs(s)
    o.state(op)
    o.writes(o.some)
    bench.advanceMs(2)
    assert(o.shows(o.some))
    assert(get(0x0440, 1).contains(Seq(0)) && o.none)
    o.writes(o.others)
    assert(o.shows(o.others))
    bench.advanceMs(2)
    o.state(safeop)
    assert(o.none)
    o.state(op)
    o.writes(o.some)
    bench.setOutputEnable(false)
    assert(o.none, "at once")
  }
  rule("WD-04, B-118: without a SyncManager with trigger writes do not trigger, else each does", outputs) {
    s =>
      import s._
      val o = new Outputs(s, trigger = 0x04)
      o.state(op)
      o.writes(o.some)
      val triggers = p.syncManagers == 0
      assert(get(0x0440, 1).contains(Seq(if (triggers) 1 else 0)))
      if (p.digitalOutputEvent < 2) assert(if (triggers) o.shows(o.some) else o.none)
  }
  rule(
    "B-118: outputs that may not be driven come back with their next event",
    both(outputs, _.digitalOutputEvent < 2)
  ) { s =>
    import s._
    val o = new Outputs(s)
    o.state(op)
    o.writes(o.some)
    for (
      (off, on) <- Seq[(() => Unit, () => Unit)](
        (() => bench.setOutputEnable(false), () => bench.setOutputEnable(true)),
        (() => bench.setLoaded(false), () => bench.setLoaded(true))
      ).take(if (p.hasSii) 1 else 2)
    ) {
      assert(o.shows(o.some))
      off()
      assert(o.none)
      on()
      assert(o.none, "not by itself")
      get(0x0000, 1)
      // With any frame, or only with one that triggers the watchdog.
      if (p.digitalOutputEvent == 0) assert(o.shows(o.some)) else assert(o.none)
      o.writes(o.some)
    }
    assert(o.shows(o.some))
  }
  rule(
    "PDI-11, B-118: outputs show what triggers the watchdog, and what is written before goes with it",
    outputsAt(1)
  ) { s =>
    import s._
    val o = new Outputs(s)
    o.state(op)
    o.writes(o.some)
    assert(o.shows(o.some))
    o.state(safeop)
    assert(o.none, "OP is left")
    o.state(op)
    assert(o.none, "not before a trigger")
    o.writes(o.some)
    assert(o.shows(o.some))
    if (p.syncManagers > 0) {
      assert(put(0x0806, 0))
      assert(put(0x0f00, o.others.head) && o.shows(o.some), "no SyncManager")
      assert(put(0x0f01, o.others(1)))
      assert(o.shows(o.others.take(2) ++ o.some.drop(2)))
    }
  }
  rule(
    "FMMU-10, PDI-11: FMMUs write single bits of outputs, which show at once",
    both(outputsAt(0), _.hasBitwiseFmmus)
  ) { s =>
    import s._
    val o = new Outputs(s)
    o.state(op)
    o.writes(o.some)
    fmmu(0, 0x100, 1, (4, 6, 1), 0x0f01, 2)
    assert(logical(Lwr, 0x100, 0x20).workingCounter == 1)
    assert(o.shows(o.some.updated(1, o.some(1) & 0xf1 | 2 << 1)))
  }

  // ---- inputs ----

  private def pattern(seed: Int)(p: EscParams) =
    Seq(0x11, 0xe2, 0x83, 0x74).take(p.digitalInputs).map(_ ^ seed)
  private def untaken(p: EscParams) = Seq.fill(p.digitalInputs)(0)

  rule("B-118: inputs are taken when a frame begins, which reads them already", inputsAt(0)) { s =>
    import s._
    for (seed <- Seq(0, 0xff, 0x5a)) {
      bench.setDigitalInputs(levels(pattern(seed)(p)))
      assert(get(0x1000, p.digitalInputs).contains(pattern(seed)(p)))
    }
    val bytes = EtherCatFrame(Seq(Datagram(Nop, 0, 0, Seq(0))))
    bench.setDigitalInputs(levels(pattern(0x33)(p)))
    good(send(bytes))
    bench.setDigitalInputs(0)
    spoiled(Datagram(Nop, 0, 0, Seq(0)))
    assert(get(0x1000, p.digitalInputs).contains(Seq.fill(p.digitalInputs)(0)))
    assert(put(0x1000 + p.digitalInputs, 0x77), "RAM is behind them")
    bench.setDigitalInputs(-1)
    assert(get(0x1000, p.digitalInputs + 1).contains(Seq.fill(p.digitalInputs)(0xff) :+ 0x77))
  }
  rule(
    "SM-12, B-118: a SyncManager makes one buffer of the inputs, which a FMMU reads whole",
    both(inputsAt(0), p => p.syncManagers > p.digitalOutputs && p.fmmus > 0)
  ) { s =>
    import s._
    val count = p.digitalInputs
    syncManager(p.digitalOutputs, 0x1000, count, 0x00)
    fmmu(0, 0x200, count, 0x1000, 1)
    for (seed <- Seq(0, 0xff, 0xa5)) {
      bench.setDigitalInputs(levels(pattern(seed)(p)))
      val reply = logical(Lrd, 0x200, Seq.fill(count)(0): _*)
      assert(reply.workingCounter == 1 && reply.data == pattern(seed)(p))
    }
    assert(!put(0x1000, 0), "the bus reads them only")
  }
  rule("B-118: inputs are taken when their latch pin rises, and not else", inputsAt(1)) { s =>
    import s._
    assert(put(0x1000, untaken(p): _*))
    def read = get(0x1000, p.digitalInputs).get
    bench.setDigitalInputs(levels(pattern(0)(p)))
    assert(read == untaken(p))
    bench.setInputLatch(true)
    assert(read == pattern(0)(p))
    bench.setDigitalInputs(levels(pattern(0xff)(p)))
    assert(read == pattern(0)(p), "it stays high")
    bench.setInputLatch(false)
    assert(read == pattern(0)(p), "it falls")
    bench.setInputLatch(true)
    assert(read == pattern(0xff)(p))
  }
  rule("WD-06, B-118: inputs that are taken trigger the PDI watchdog", both(inputsAt(1), _.hasWatchdogs)) {
    s =>
      import s._
      assert(put(0x0410, 10, 0))
      def running = get(0x0448, 1).contains(Seq(1))
      bench.setInputLatch(true)
      assert(running)
      bench.advanceMs(2)
      assert(!running && get(0x0443, 1).contains(Seq(1)), "frames do not")
      bench.setInputLatch(false)
      assert(!running)
      bench.setInputLatch(true)
      assert(running)
  }

  // ---- SYNC ----

  rule(
    "DC-35, PDI-11, B-118: with SYNC1 outputs show what has been written, with SYNC0 inputs are taken",
    withSync
  ) { s =>
    import s._
    val o = new Outputs(s)
    o.state(op)
    def bytes(value: BigInt, count: Int) = (0 until count).map(i => (value >> 8 * i & 0xff).toInt)
    def now = get(0x0910, p.clockBytes).get.foldRight(BigInt(0))((b, rest) => rest << 8 | b)
    def in  = get(0x1000, p.digitalInputs).get
    assert(put(0x0420, 0, 0) && put(0x1000, untaken(p): _*))
    o.writes(o.some)
    bench.setDigitalInputs(levels(pattern(0)(p)))
    assert(o.none && in == untaken(p))
    // SYNC0 every ms from 200 us on, SYNC1 300 us behind it.
    assert(put(0x0990, bytes(now + 200000, p.clockBytes): _*))
    assert(put(0x09a0, bytes(1000000, 4) ++ bytes(300000, 4): _*) && put(0x0981, 7))
    bench.advanceUs(50)
    assert(o.none && in == untaken(p))
    bench.advanceUs(200)
    assert(o.none && in == pattern(0)(p))
    bench.setDigitalInputs(levels(pattern(0xff)(p)))
    bench.advanceUs(300)
    assert(o.shows(o.some) && in == pattern(0)(p))
    o.writes(o.others)
    assert(o.shows(o.some), "not yet")
    bench.advanceUs(200)
    assert(o.shows(o.some))
    bench.advanceUs(450)
    assert(in == pattern(0xff)(p) && o.shows(o.some))
    bench.advanceUs(300)
    assert(o.shows(o.others))
    if (p.digitalWatchdogLate == 1) {
      assert(put(0x0420, 1, 0)) // 100 us
      o.writes(o.some)
      bench.advanceUs(400)
      assert(o.shows(o.others) && get(0x0440, 1).contains(Seq(0)), "the watchdog is looked at with SYNC1")
      bench.advanceUs(800)
      assert(o.none)
    }
  }
}

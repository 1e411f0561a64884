package flyframe.transport

/** Peers that lie, and frames that no peer sends: each is counted, and changes nothing else (TB-10, TB-19,
  * TB-20).
  */
abstract class LieRules extends TransportCases {
  import TransportCases._

  /** Frames come to a node with a message open in each direction; each is counted, and both go on. */
  private def lie(counter: Counter.Value)(frames: BusFrame*): Unit = node() { b =>
    val data = message(20)
    b.send(message(30), tag = 1)
    b.hear(open(0, data) +: parts(data).take(1): _*)
    for ((f, i) <- frames.zipWithIndex) {
      assert(b.hear(f).isEmpty, f)
      assert(b.counts == Map(counter -> (i + 1)), f)
    }
    assert(b.t.received.isEmpty && b.ended().isEmpty)
    b.hear(parts(data).tail: _*)
    assert(b.take().data == data && b.run().map(code) == Seq(Code.Done))
    assert(b.hear(missing(0, 1, 0x8000000000L)).map(code) == Seq(1))
    b.hear(done(0))
    assert(b.ended().map(_.outcome) == Seq(Outcome.Delivered))
  }

  private def changed(f: BusFrame)(change: FrameId => FrameId) = f.copy(id = change(FrameId.of(f.id)).word)

  "TB-10, TP-10: DONE for a number never sent" should "be counted" in lie(Counter.Unexpected)(
    done(1),
    done(200),
    done(0, life = 8),
    done(0, life = 0x87),
    done(0, pipe = 1),
    done(0, pipe = 14, result = 1),
    done(0, from = 24),
    done(255, result = 2)
  )

  "TB-10: other answers to nothing" should "be counted" in lie(Counter.Unexpected)(
    busy(1, 5),
    busy(0, 5, pipe = 1),
    busy(255, 5),
    missing(1, 0, 0x8000000000L),
    missing(255, 0, 0x8000000000L),
    missing(0, 0, 0x8000000000L, pipe = 2),
    missing(0, 0, 0x8000000000L, from = 9),
    unknown(1),
    unknown(from = 9),
    changed(unknown())(identity).copy(data = Seq(0x80))
  )

  "TB-10, TP-11: MISSING beyond the end, or of nothing" should "be counted" in lie(Counter.BeyondEnd)(
    missing(0, 4, 0x8000000000L),
    missing(0, 3, 0xc000000000L),
    missing(0, 0, 1),
    missing(0, 255, 0x8000000000L),
    missing(0, 0, 0)
  )

  "TB-10: MISSING of a SHORT" should "be counted" in node() { b =>
    b.send(Seq(1))
    assert(b.hear(missing(0, 0, 0x8000000000L)).isEmpty && b.counts == Map(Counter.BeyondEnd -> 1))
  }

  "TB-20, TP-21: OPEN of an impossible length" should "be counted" in lie(Counter.WrongLength)(
    (Seq(2049, 4096, 65535, 65536, 0) ++ (1 to 6)).map(openOf(1, _, 0)): _*
  )

  "TP-20: a life moved back" should "be counted" in lie(Counter.OldLife)(
    short(1, Seq(1), life = Life - 1),
    open(0, message(20), life = Life - 2),
    BusFrame(id(Code.Close), Seq(0, Life - 1)),
    BusFrame(id(Code.Hello, to = 0), (Life - 5) +: Seq.fill(7)(0)),
    short(1, Seq(1), life = Life + 128 - 63 & 0x7f)
  )

  "TB-19: frames from the own address" should "be counted" in lie(Counter.OwnAddress)(
    BusFrame(id(Code.Hello, to = 0, from = Own), Seq.fill(8)(0)),
    changed(short(1, Seq(1)))(_.copy(source = Own)),
    changed(parts(message(20))(1))(_.copy(source = Own))
  )

  "TB-19: frames of a source that cannot be" should "be counted" in lie(Counter.WrongSource)(
    (for (source <- Seq(0, 126, 127); f <- Seq(short(1, Seq(1)), parts(message(20))(1), done(0)))
      yield changed(f)(_.copy(source = source))): _*
  )

  "TB-19: frames to others" should "be counted" in lie(Counter.Foreign)(
    (for (to <- Seq(1, 3, 125, 126, 127); f <- Seq(short(1, Seq(1)), parts(message(20))(1), done(0)))
      yield changed(f)(_.copy(destination = to))): _*
  )

  private val controls = Seq(
    open(0, message(20)),
    BusFrame(id(Code.Close), Seq(0, Life)),
    done(0),
    missing(0, 0, 0x8000000000L),
    busy(0, 1),
    unknown(),
    BusFrame(id(Code.Hello, to = 0), Life +: Seq.fill(7)(0))
  )

  "TB-19: control frames with another DLC" should "be counted" in lie(Counter.Malformed)(
    (for {
      f   <- controls
      dlc <- 0 to 15 if dlc != f.dlc
    } yield f.copy(dlc = dlc, data = f.data.padTo(8, 0).take(dlc))) ++
      Seq(0, 1, 2, 9).map(dlc => short(1, Seq(1)).copy(dlc = dlc, data = Seq.fill(dlc min 8)(0))): _*
  )

  "TB-19: control frames with another end mark, pipe or code" should "be counted" in lie(Counter.Malformed)(
    controls.map(changed(_)(_.copy(end = false))) ++ controls.map(changed(_)(_.copy(pipe = 15))) ++
      (0 to 255)
        .filterNot(Set(1, 2, 3, 0x11, 0x12, 0x13, 0x14, 0x20))
        .map(code => BusFrame(id(code), Seq.fill(8)(0))): _*
  )

  "TB-19: a control frame of which life byte and destination do not fit" should "be counted" in
    lie(Counter.Malformed)(
      open(0, message(20), life = Life | 0x80),
      short(1, Seq(1), life = Life | 0x80),
      changed(open(0, message(20)))(_.copy(destination = 0)),
      changed(done(0))(_.copy(destination = 0)),
      changed(unknown())(_.copy(destination = 0)),
      changed(controls.last)(_.copy(destination = Own)),
      done(0, result = 3),
      unknown().copy(data = Seq(1))
    )

  "TB-19: process data with a DLC above 8" should "be counted" in lie(Counter.Malformed)(
    BusFrame(FrameId(urgent = false, Own, isData = true, Peer, 1, 15, end = true).word, 9, Seq.fill(8)(0))
  )

  "TB-19: process data without an end mark" should "be counted" in lie(Counter.WrongEnd)(
    BusFrame(FrameId(urgent = false, Own, isData = true, Peer, 1, 15, end = false), Seq(1))
  )

  "TB-14: two OPENs of one number that alternate" should "keep one buffer, and deliver what fits" in node() {
    b =>
      val (x, y) = (message(20), message(20, salt = 5))
      for (_ <- 1 to 1000) assert(b.hear(open(0, x), parts(x).head, open(0, y), parts(y).head).isEmpty)
      assert(b.counts == Map(Counter.Dropped -> 1999))
      for (pipe <- 1 to 3) assert(b.hear(open(0, x, pipe)).isEmpty) // the other buffers are free
      b.hear(parts(y).tail: _*)
      assert(b.take().data == y)
  }

  "TB-05, TP-32: a flood of OPEN from everywhere" should "find the receiver busy, and end" in node() { b =>
    b.isHeld = true
    for {
      source <- 3 to 125
      pipe   <- 0 to 14
    } b.t.receive(changed(open(0, message(2048), pipe))(_.copy(source = source)), b.now)
    b.run()
    assert(b.counts == Map(Counter.NoBuffer -> (123 * 15 - 4), Counter.AnswerLost -> (123 * 15 - 4 - 12)))
    // An urgent answer still has a place, before the others.
    b.leave()
    b.hear(short(0, Seq(1), urgent = true))
    b.take()
    b.leave()
    assert(b.run().map(code).contains(Code.Done))
    // They ask no more: the buffers are free after ten gaps.
    b.isHeld = false
    b.leave()
    b.run(ms(200))
    assert((0 to 3).forall(pipe => b.hear(open(1, message(2048), pipe)).isEmpty))
  }
}

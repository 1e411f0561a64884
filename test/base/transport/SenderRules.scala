package flyframe.transport

/** Rules of the sender (TP-01 to TP-06, TP-10 to TP-13, TP-31 and their choices). */
abstract class SenderRules extends TransportCases {
  import TransportCases._

  private val all = Outcome

  "TP-04: the vector of section 16" should "be the sixth message of node 23" in
    node(TransportParams(23, life = 7)) { b =>
      for (n <- 0 until 5) {
        assert(b.send(Seq(0x41), to = 1, urgent = true).map(_.data) == Seq(Seq(n, 7, 0x41)))
        b.hear(BusFrame(id(Code.Done, urgent = true, to = 23, from = 1), Seq(n, 7, 0, 0)))
      }
      assert(
        b.send(Seq(0x41, 0x42), to = 1, urgent = true) == Seq(BusFrame(0x22e041, 4, Seq(5, 7, 0x41, 0x42)))
      )
    }

  "TP-03: a message" should "be cut into frames of 8 bytes, the last one with the end mark" in
    node(TransportParams(1)) { b =>
      val data = Seq.fill(255 * 8)(0xaa) ++ (0 to 7)
      for (n <- 0 until 3) b.send(message(9), tag = n, to = 2)
      val sent = b.send(data, tag = 3, to = 2).tail
      assert(sent.map(_.data) == data.grouped(8).toSeq)
      assert(sent.map(f => FrameId.of(f.id)).zipWithIndex.forall { case (f, i) =>
        f == FrameId(urgent = false, 2, isData = true, 1, i, 3, end = i == 255)
      })
      assert(sent.last.id == 0x10503fe7) // the vector of section 16
      val last = b.send("123456789".map(_.toInt), tag = 4, to = 2)
      assert(last.head.data == Seq(0, 0, 0, 8, 0xcb, 0xf4, 0x39, 0x26))
      assert(last.last.data == Seq('9'.toInt))
      assert(FrameId.of(last.last.id).end && !FrameId.of(last(1).id).end)
    }

  "TP-04: a message of up to 6 bytes" should "go as SHORT, others as OPEN and frames at once" in node() { b =>
    for (length <- 1 to 6) {
      val data = message(length)
      assert(
        b.send(data, tag = length) ==
          Seq(BusFrame(id(Code.Short, length - 1, to = Peer, from = Own), Seq(0, 7) ++ data))
      )
    }
    val data = message(20)
    val sent = b.send(data, tag = 7)
    assert(
      sent.head == BusFrame(
        id(Code.Open, 6, to = Peer, from = Own),
        Seq(0, 7, 0, 19) ++ Sizes.bytes(Sizes.crc32(data), 4)
      )
    )
    assert(sent.tail.flatMap(_.data) == data && sent.size == 4)
  }

  "TP-01: each message" should "take the lowest free pipe of its destination" in node() { b =>
    def pipe(f: BusFrame) = FrameId.of(f.id).pipe
    assert((0 until 3).map(n => pipe(b.send(Seq(1), tag = n).head)) == Seq(0, 1, 2))
    assert(pipe(b.send(Seq(1), tag = 3, to = 24).head) == 0)
    b.hear(done(0, pipe = 1))
    assert(b.ended() == Seq(Ended(1, all.Delivered, Set())))
    assert((4 to 5).map(n => pipe(b.send(Seq(1), tag = n).head)) == Seq(1, 3))
  }

  "TB-01: a message" should "be refused at once if it is impossible, or without a place" in node() { b =>
    def isTaken(data: Seq[Int], to: Int = Peer, urgent: Boolean = false, tag: Int = 9) =
      b.t.send(tag, to, urgent, data, b.now)
    assert(!isTaken(Nil) && !isTaken(message(2049)) && !isTaken(Seq(1), to = Own))
    assert(!isTaken(Seq(1), to = 126) && !isTaken(Seq(1), to = 127))
    assert((1 to 14).forall(n => isTaken(message(2048), tag = n))) // each pipe but the last one
    assert(!isTaken(Seq(1)) && isTaken(Seq(1), to = 24, tag = 15))
    assert(!isTaken(Seq(1), to = 25) && isTaken(Seq(1), urgent = true, tag = 16))
    assert(!isTaken(Seq(1), urgent = true) && !isTaken(Seq(1), to = 25, urgent = true))
    b.run()
    assert(b.hear(done(0, from = 24)).isEmpty)
    assert(b.ended().map(_.tag) == Seq(15))
    assert(!isTaken(Seq(1), to = 25) && isTaken(Seq(1), to = 25, urgent = true))
  }

  "TP-02: numbers" should "count up in each pipe, from 0, mod 256" in node() { b =>
    for (n <- 0 until 300) {
      assert(b.send(Seq(1)).map(_.data.head) == Seq(n & 0xff))
      b.hear(done(n & 0xff))
    }
    assert(b.ended().size == 300)
    assert(b.send(Seq(1), to = 24).map(_.data.head) == Seq(0))
  }

  "TP-05, TB-03: messages" should "go in turn, urgent ones first" in node() { b =>
    b.isHeld = true
    val sent = for (n <- 0 until 3) yield b.t.send(n, Peer, n == 2, message(30, n), b.now)
    assert(sent.forall(identity))
    val order = Iterator
      .continually { val f = b.run(); val first = b.waiting.headOption; b.leave(first.contains(_)); f }
      .take(40)
      .toSeq
      .flatten
      .map(f => FrameId.of(f.id).pipe)
    assert(order == Seq(2, 2, 2, 2, 2, 0, 1, 0, 1, 0, 1, 0, 1, 0, 1))
  }

  it should "go in turn with urgent ones between any two of their frames" in node() { b =>
    b.isHeld = true
    for (to <- 24 to 25) b.send(message(500), tag = to, to = to)
    val sent = for (n <- 0 until 60) yield {
      b.send(Seq(1), to = 30, urgent = true)
      b.leave(f => FrameId.of(f.id).destination == 30)
      b.hear(done(n, from = 30))
      val oldest = b.waiting.find(isData)
      b.leave(oldest.contains(_))
      oldest.map(f => FrameId.of(f.id).destination)
    }
    assert((24 to 25).forall(to => sent.flatten.count(_ == to) > 25))
  }

  "TB-04: urgent frames and answers" should "find a place behind those that wait" in node() { b =>
    b.isHeld = true
    assert(b.send(message(100)).size == 4 && b.waiting.size == 5) // HELLO is one of them
    val normal = b.hear(unknown(14), short(0, Seq(1)))
    assert(normal.isEmpty && b.t.received.nonEmpty)
    b.take()
    assert(b.run().map(code) == Seq(Code.Done))
    assert(b.send(Seq(1), tag = 2, urgent = true).map(code) == Seq(Code.Short))
    assert(b.waiting.size <= 8)
  }

  "TB-04: a node that may use 16 places" should "leave three of them to frames that must not wait" in
    node(TransportParams(Own, life = 7, slots = 16)) { b =>
      b.isHeld = true
      assert(b.send(message(200)).size == 12 && b.waiting.size == 13) // HELLO is one of them
      for (tag <- 2 to 5) b.send(Seq(tag), tag, urgent = true)
      assert(b.waiting.size == 16)
    }

  "TB-34: a message to a low address" should "go in turn beside one of which no frame leaves" in node() { b =>
    b.run(ms(99)) // then a time for data begins
    b.isHeld = true
    b.send(message(2048), tag = 1, to = 120)
    b.leave(!isData(_))
    b.run()
    b.send(message(2048), tag = 2, to = 1)
    def waiting(to: Int) = b.waiting.filter(isData).count(f => FrameId.of(f.id).destination == to)
    val sent = for (time <- 0 until 5400) yield {
      b.leave(f => isHello(f) || FrameId.of(f.id).destination == 1)
      b.run(ms(1))
      assert(waiting(120) == 5 && b.waiting.size <= 6)
      waiting(1)
    }
    for ((frames, time) <- sent.zipWithIndex if time % 100 > 0 && time % 100 < 99)
      assert(frames == (if (time > 5000 && time / 100 % 2 == 0) 1 else 0), s"$time ms")
  }

  "TB-34: values that do not leave" should "leave places to frames of messages" in node() { b =>
    b.run()
    b.isHeld = true
    def destination(f: BusFrame) = FrameId.of(f.id).destination
    def setAll()                 = for (n <- 0 until 40) b.t.setObject(120, n, Seq(n), b.now)
    setAll()
    for (_ <- 1 to 10) {
      b.run(ms(50))
      assert(b.waiting.count(isData) == 4)
    }
    val sent = b.send(message(9), to = 1) ++ (1 to 2).flatMap { _ =>
      b.leave(destination(_) == 1)
      b.run()
    }
    assert(sent.map(code) == Seq(Code.Open, 0, 1))
    b.t.forgetValues()
    b.leave()
    b.send(message(2048), tag = 2, to = 119)
    setAll() // they go on beside its frames
    val numbers = (1 to 120).flatMap { _ =>
      b.leave(destination(_) != 119)
      b.run(ms(25)).filter(destination(_) == 120).map(code)
    }
    assert(numbers.distinct.size == 40 && b.waiting.count(destination(_) == 119) == 5)
  }

  "TP-06, TB-05: a frame that waits" should "never be queued again" in node() { b =>
    b.send(message(40)) // all out
    b.isHeld = true
    assert(b.hear(missing(0, 1, 0xc000000000L)).map(code) == Seq(1, 2))
    assert(b.hear(missing(0, 1, 0xe000000000L)).map(code) == Seq(3))
    assert(b.hear(missing(0, 1, 0xe000000000L)).isEmpty)
    b.leave(f => isData(f) && code(f) == 2)
    assert(b.hear(missing(0, 1, 0xe000000000L)).map(code) == Seq(2))
    // An OPEN that waits is not sent again, either, nor an answer.
    b.leave()
    b.run(ms(20))
    assert(b.hear(unknown()).size == 5 && { b.run(ms(20)); b.hear(unknown()).isEmpty })
    b.leave()
    assert(b.run().map(code) == Seq(4)) // for which there was no place
    b.leave()
    assert(b.run(ms(50)).map(code) == Seq(Code.Open))
    assert(b.run(ms(300)).isEmpty)
    b.hear(short(0, Seq(1)))
    b.take()
    assert(b.run().map(code) == Seq(Code.Done))
    assert(b.hear(short(0, Seq(1))).isEmpty)
    b.leave()
    assert(b.hear(short(0, Seq(1))).map(code) == Seq(Code.Done))
  }

  "TB-02: a pipe" should "be free when none of its frames waits" in node() { b =>
    b.isHeld = true
    b.send(Seq(1))
    b.hear(done(0))
    assert(b.ended().map(_.outcome) == Seq(all.Delivered))
    assert(b.send(Seq(2), tag = 2).map(f => FrameId.of(f.id).pipe) == Seq(1))
    b.leave()
    assert(b.send(Seq(3), tag = 3).map(f => FrameId.of(f.id).pipe) == Seq(0))
  }

  "TP-10: DONE" should "end a message as delivered or refused, or let all of it go again" in node() { b =>
    val data  = message(20)
    val first = b.send(data)
    assert(b.hear(done(0, 2)) == first)
    assert(b.hear(done(1)).isEmpty && b.hear(done(0, life = 6)).isEmpty && b.ended().isEmpty)
    assert(b.hear(done(0)).isEmpty)
    assert(b.ended() == Seq(Ended(1, all.Delivered, Set())))
    b.send(data, tag = 2)
    b.hear(done(1, 1))
    assert(b.ended() == Seq(Ended(2, all.Refused, Set(Peer))))
    assert(b.hear(done(1, 1)).isEmpty && b.ended().isEmpty) // TB-10: twice
    assert(b.counts == Map(Counter.Unexpected -> 3))
    b.send(Seq(1), tag = 3)
    assert(b.hear(done(2, 2)).map(code) == Seq(Code.Short))
  }

  "TP-11: MISSING" should "bring the frames that it names" in node() { b =>
    b.send(message(2048))
    val named = b.hear(missing(0, 200, 0x8000000001L))
    assert(named.map(code) == Seq(200, 239))
    assert(
      b.hear(missing(0, 255, 0x8000000000L)).map(f => FrameId.of(f.id)).map(f => (f.number, f.end)) ==
        Seq((255, true))
    )
  }

  "TP-11, TB-06: BUSY" should "bring OPEN after its wait, for as long as it comes" in node() { b =>
    b.send(message(20))
    b.hear(busy(0, 0))
    assert(b.run(ms(10) - 1).isEmpty && b.run(1).map(code) == Seq(Code.Open))
    for (_ <- 1 to 30) {
      assert(b.hear(busy(0, 3)).isEmpty)
      assert(b.hear(unknown(), done(255), missing(0, 0, 0x8000000000L)).isEmpty) // until then they wait
      assert(b.run(ms(30) - 1).isEmpty)
      assert(b.run(1).map(code) == Seq(Code.Open))
    }
    b.hear(busy(0, 20), busy(0, 10))
    assert(b.runTimed(ms(249)).map(f => (b.now - f._1, code(f._2))) == Seq((ms(49), Code.Open)))
    assert(b.hear(missing(0, 0, 0xe000000000L)).map(code) == Seq(0, 1, 2))
  }

  "TP-11, TB-06: a wait" should "be twice as long each time, up to 20,000 bits" in
    node(TransportParams(Own, 7, kbps = 5)) { b =>
      b.send(message(20))
      for (wait <- Seq(20, 40, 80, 160, 320, 640, 1280, 2560, 4000, 4000)) {
        b.hear(busy(0, 2))
        assert(b.run(ms(wait) - 1).isEmpty && b.run(1).map(code) == Seq(Code.Open), wait)
      }
      b.hear(missing(0, 0, 0x8000000000L), busy(0, 2)) // it was taken up meanwhile
      assert(b.run(ms(20)).map(code) == Seq(Code.Open))
      b.hear(busy(0, 250)) // longer ones are as they are
      b.send(Seq(1), tag = 2)
      b.hear(busy(0, 2, pipe = 1)) // another message
      assert(b.run(ms(20)).map(code) == Seq(Code.Short))
    }

  it should "not grow where bits are fast" in node() { b =>
    b.send(message(20))
    for (_ <- 1 to 10) {
      b.hear(busy(0, 2))
      assert(b.run(ms(20)).map(code) == Seq(Code.Open))
    }
  }

  "TB-06: a message that finds its receiver busy" should "end when its host gives it up" in node() { b =>
    b.send(message(20))
    b.hear(busy(0, 255))
    b.t.cancel(1)
    assert(b.run().map(f => (code(f), f.data)) == Seq((Code.Close, Seq(0, 7))))
    assert(b.ended() == Seq(Ended(1, all.NotConfirmed, Set(Peer))))
  }

  it should "end 10 s behind that if there is no place for CLOSE, however long its wait is" in node() { b =>
    b.send(message(20))
    b.hear(busy(0, 255))
    b.isHeld = true
    for (n <- 2 to 10) b.send(Seq(n), tag = n)
    b.t.cancel(1)
    b.run(ms(5000))
    for (pipe <- 1 to 9) b.hear(busy(0, 1, pipe)) // the others last longer
    b.run(ms(5000) - 1)
    assert(b.ended().isEmpty && b.waiting.filterNot(isHello).forall(code(_) == Code.Short))
    b.run(1)
    assert(b.ended().contains(Ended(1, all.NotConfirmed, Set(Peer))))
  }

  "TP-11, TB-09: UNKNOWN and DONE of the number before" should
    "bring all from OPEN on, at most every 10 ms" in node() { b =>
      b.send(Seq(1))
      b.hear(done(0))
      val first = b.send(message(20))
      for (answer <- Seq(unknown(), done(0), done(0, 1))) {
        assert(b.hear(answer).isEmpty) // too early
        b.run(ms(10) - 1)
        assert(b.hear(answer).isEmpty)
        b.run(1)
        assert(b.hear(answer) == first)
        assert(b.hear(answer).isEmpty)
      }
    }

  "TB-09: UNKNOWN to a SHORT" should "be ignored" in node() { b =>
    b.send(Seq(1))
    b.run(ms(20))
    assert(b.hear(unknown(), done(255)).isEmpty)
    assert(b.counts == Map(Counter.Unexpected -> 2))
  }

  "TP-12, TB-07: without an answer" should "OPEN come again every 50 ms, and CLOSE in the end" in node() {
    b =>
      b.send(message(20))
      val begin = b.now
      val sent  = b.runTimed(ms(2000)).map { case (at, f) => (at - begin, code(f)) }
      assert(sent == (1 to 9).map(n => (ms(50.0 * n), Code.Open)) :+ ((ms(500), Code.Close)))
      assert(b.ended() == Seq(Ended(1, all.NotConfirmed, Set(Peer))))
      b.send(Seq(1), tag = 2)
      assert(b.run(ms(2000)).map(code) == Seq.fill(9)(Code.Short) :+ Code.Close)
  }

  it should "begin anew to count with each answer" in node() { b =>
    b.send(message(20))
    b.run(ms(460))
    b.hear(missing(0, 0, 0x8000000000L))
    assert(b.run(ms(499)).map(code) == Seq.fill(9)(Code.Open))
    assert(b.run(ms(1)).map(code) == Seq(Code.Close))
  }

  it should "wait for 5,000 bits where they are slow, twice as long each time up to 50,000 (TB-29)" in
    node(TransportParams(Own, 7, kbps = 5)) { b =>
      b.send(Seq(1))
      b.run(ms(3500))
      b.hear(busy(0, 1)) // an answer
      val first  = b.now + ms(10)
      val sent   = b.runTimed(ms(80000)).map { case (at, f) => (at - first, code(f)) }
      val shorts = Seq(0, 1, 3, 7, 15, 25, 35, 45, 55, 65).map(s => (ms(1000.0 * s), Code.Short))
      assert(sent == shorts :+ ((ms(75000), Code.Close)))
      assert(b.ended().map(_.outcome) == Seq(Outcome.NotConfirmed))
    }

  "TP-31, TB-29: T_answer of a message to all" should "grow with those who answer" in
    node(TransportParams(Own, 7, kbps = 5)) { b =>
      val members = (3 to 12).toSet
      for (from <- Seq(12, 20)) b.hear(BusFrame(id(Code.Hello, to = 0, from = from), Life +: Seq.fill(7)(0)))
      b.send(Seq(1), to = 0, members = Some(members)) // eleven nodes may answer
      def asksAgain = b.run(ms(1550) - 1).isEmpty && b.run(1).map(code) == Seq(Code.Short)
      assert(asksAgain)
      for (from <- members) b.hear(toAll(Code.Done, 0, 0x87, 0x80, 0)(from))
      assert(b.ended().map(_.outcome) == Seq(Outcome.Delivered))
      b.send(Seq(1), tag = 2)
      assert(b.run(ms(1000)).map(code) == Seq(Code.Short)) // one to a node
    }

  it should "count from when the last frame has left" in node() { b =>
    b.isHeld = true
    b.send(message(20))
    assert(b.run(ms(400)).isEmpty)
    b.leave()
    assert(b.run(ms(50) - 1).isEmpty)
    assert(b.run(1).map(code) == Seq(Code.Open))
  }

  "TP-13, TB-08: a message of which no frame leaves" should "end after 10 s" in node() { b =>
    b.isHeld = true
    b.send(message(200))
    b.run(ms(9999))
    assert(b.ended().isEmpty)
    b.run(ms(2))
    assert(b.ended() == Seq(Ended(1, all.NotConfirmed, Set(Peer))))
  }

  "TP-30, TB-26: a message that nobody answers" should
    "end 15 s after all has left, though its frames wait for long" in node() { b =>
      b.isHeld = true
      b.send(Seq(1))
      b.run(ms(9000))
      b.leave()
      for (_ <- 1 to 2) { // OPEN leaves nearly 7 s after it was put into the port
        b.run(ms(7000))
        assert(b.ended().isEmpty)
        b.leave()
      }
      b.run(ms(1000) - 1)
      assert(b.ended().isEmpty && b.waiting.exists(code(_) == Code.Short))
      b.run(1)
      assert(b.ended() == Seq(Ended(1, all.NotConfirmed, Set(Peer))))
      b.leave()
      b.send(Seq(1), tag = 2) // an answer lets it begin anew
      b.run(ms(7000))
      b.leave()
      b.run(ms(7000))
      b.leave()
      b.hear(busy(1, 1))
      b.run(ms(7000))
      b.leave()
      b.run(ms(7000))
      assert(b.ended().isEmpty)
    }

  it should "end 15 s after its last answer, whatever has left since" in node() { b =>
    b.isHeld = true
    b.send(message(20))
    b.leave()
    b.run()
    b.hear(busy(0, 1)) // its receiver has it whole, and hears nothing any more
    b.run(ms(9000))
    assert(b.waiting.exists(code(_) == Code.Open))
    b.leave()
    b.run(ms(6000) - 1)
    assert(b.ended().isEmpty)
    b.run(1)
    assert(b.ended() == Seq(Ended(1, all.NotConfirmed, Set(Peer))))
  }

  "TB-27: frames of a message that has ended" should "be taken back, not those of one under way" in node() {
    b =>
      b.run()
      b.isHeld = true
      b.send(message(200))
      b.run(ms(9999))
      val open = b.waiting.filterNot(isHello)
      assert(open.size == 5)
      b.send(Seq(1), tag = 2) // of another pipe
      b.run(ms(1001))
      assert(b.ended().map(_.tag) == Seq(1))
      val now = b.waiting.filterNot(isHello)
      assert(now.intersect(open).isEmpty && now.map(code) == Seq(Code.Short))
      b.t.cancel(2)
      b.isHeld = false
      b.leave()
      b.isHeld = true
      assert(b.run().map(code) == Seq(Code.Close))
      b.run(ms(1000))
      assert(b.waiting.filterNot(isHello).isEmpty)
  }

  "TP-13, TB-08: a receiver that never has it all" should "not keep a message for ever" in node() { b =>
    b.send(message(20))
    val rounds =
      Iterator.continually(b.hear(missing(0, 0, 0x8000000000L)).map(code)).takeWhile(_ == Seq(0)).size
    assert(rounds == 199)
    assert(b.ended() == Seq(Ended(1, all.NotConfirmed, Set(Peer))))
    b.send(message(20), tag = 2)
    val again = Iterator.continually(b.hear(done(1, 2)).map(code)).takeWhile(_.head == Code.Open).size
    assert(again == 199)
    assert(b.ended().map(_.tag) == Seq(2))
  }

  "TP-13: every message" should "end once, also one that is given up late" in node() { b =>
    b.send(Seq(1))
    b.t.cancel(1)
    b.t.receive(done(0), b.now)
    assert(b.run().isEmpty) // it was delivered before CLOSE
    assert(b.ended() == Seq(Ended(1, all.Delivered, Set())))
    b.t.cancel(1)
    assert(b.run(ms(1000)).isEmpty && b.ended().isEmpty)
  }

  private def pipe(frames: Seq[BusFrame]) = FrameId.of(frames.head.id).pipe

  "TP-02, TB-26: a pipe" should "rest when 100 of its numbers may be unheard" in node() { b =>
    def givesUp(count: Int) = for (tag <- 1 to count) yield {
      val sent = b.send(Seq(1), tag)
      b.t.cancel(tag)
      b.run()
      assert(b.ended().map(_.outcome) == Seq(all.NotConfirmed))
      pipe(sent)
    }
    assert(givesUp(100).distinct == Seq(0) && givesUp(1) == Seq(1))
    b.run(ms(21500))
    assert(givesUp(1) == Seq(1))
    b.run(ms(500))
    assert(givesUp(100).distinct == Seq(0) && givesUp(1) == Seq(1))
  }

  it should "be left for an urgent message when all others rest" in node() { b =>
    def isTaken(urgent: Boolean) = {
      val taken = b.t.send(9, Peer, urgent, Seq(1), b.now)
      b.t.cancel(9)
      b.run()
      taken
    }
    for (_ <- 1 to 1400) assert(isTaken(urgent = false))
    assert(!isTaken(urgent = false) && isTaken(urgent = true))
  }

  it should "not rest while its receiver answers" in node() { b =>
    for (n <- 1 to 500) {
      assert(pipe(b.send(Seq(1))) == 0)
      if (n % 100 == 0) b.hear(busy(n - 1 & 0xff, 1))
      b.t.cancel(1)
      b.run()
    }
  }

  "TP-30, TB-26: a node that has not heard messages to all" should "get the next ones all the same" in
    node() { b =>
      withTransport(TransportParams(Peer, Life), Start) { t =>
        val other = new Bench(t)
        val to    = Some(Set(Peer))
        def done(f: BusFrame) =
          BusFrame(id(Code.Done, pipe(Seq(f)), from = 3), Seq(f.data.head, 0x87, 0x80, 0))
        def toPeer(data: Int) = {
          assert(other.hear(b.send(Seq(data), to = 0, members = to): _*).isEmpty)
          assert(other.take().data == Seq(data))
          b.hear(other.run(): _*)
          assert(b.ended() == Seq(Ended(1, all.Delivered, Set())))
        }
        toPeer(1)
        // The next number would be taken for the last one, or for an older one.
        for (missed <- Seq(255, 128, 127)) {
          for (_ <- 1 to missed) b.hear(done(b.send(Seq(9), to = 0, members = Some(Set(3))).head))
          assert(b.ended().size == missed)
          toPeer(missed & 0x7f)
        }
      }
    }

  // ---- to all ----

  private def toAll(code: Int, bytes: Int*)(from: Int) = BusFrame(id(code, from = from), bytes)

  "TP-31, TB-11: a message to all" should "be delivered when all members have it" in node() { b =>
    val first = b.send(message(20), to = 0, members = Some(Set(3, 4, 5, Own)))
    assert(FrameId.of(first.head.id).destination == 0 && first.head.data(1) == 0x87)
    b.hear(toAll(Code.Done, 0, 0x87, 0x80, 0)(3), toAll(Code.Done, 0, 7, 0, 0)(4)) // the latter: of no such
    assert(b.hear(toAll(Code.Missing, 0, 0x87, 1, 0x80, 0, 0, 0, 0)(5)) == Seq(first(2)))
    b.hear(toAll(Code.Done, 0, 0x87, 0x80, 0)(9)) // no member
    b.hear(toAll(Code.Done, 0, 0x87, 0x80, 0)(5))
    assert(b.ended().isEmpty)
    b.hear(toAll(Code.Done, 0, 0x87, 0x80, 0)(4))
    assert(b.ended() == Seq(Ended(1, all.Delivered, Set())))
    assert(b.counts == Map(Counter.Unexpected -> 2))
  }

  it should "come to the others while one member is busy" in node() { b =>
    val busy = toAll(Code.Busy, 0, 0x87, 2)(3)
    b.isHeld = true
    val first = b.send(message(160), to = 0, members = Some(Set(3, 4)))
    assert(b.hear(busy).isEmpty && first.size < 21)
    b.isHeld = false
    b.leave()
    assert((first ++ b.run()).count(isData) == 20)
    for (_ <- 1 to 250) {
      b.hear(busy)
      assert(b.run(ms(20)).isEmpty) // T_gap
      assert(b.hear(toAll(Code.Missing, 0, 0x87, 1, 0x80, 0, 0, 0, 0)(4)).map(code) == Seq(1))
      assert(b.run(ms(30) - 1).isEmpty)
      assert(b.run(1).map(code) == Seq(Code.Open))
    }
    for (from <- Seq(4, 3)) b.hear(toAll(Code.Done, 0, 0x87, 0x80, 0)(from))
    assert(b.ended() == Seq(Ended(1, all.Delivered, Set())))
  }

  it should "come to a busy member ever more rarely (TB-32)" in node(TransportParams(Own, 7, kbps = 50)) {
    b =>
      val (members, busy) = ((3 to 42).toSet, toAll(Code.Busy, 0, 0x87, 2)(3))
      b.send(message(9), to = 0, members = Some(members))
      for (from <- members - 3) b.hear(toAll(Code.Done, 0, 0x87, 0x80, 0)(from))
      // Six times 40 answers of 125 bits, and so on.
      for (wait <- Seq(600, 1200, 2400, 4800, 5000, 5000)) {
        b.hear(busy)
        assert(b.run(ms(wait) - 1).isEmpty && b.run(1).map(code) == Seq(Code.Open), wait)
      }
      assert(b.hear(toAll(Code.Missing, 0, 0x87, 0, 0xc0, 0, 0, 0, 0)(3)).map(code) == Seq(0, 1))
      b.hear(busy)
      assert(b.run(ms(600)).map(code) == Seq(Code.Open)) // it had a place meanwhile
  }

  for ((kbps, waits) <- Seq(5 -> Seq(18600, 20000, 20000), 1000 -> Seq(93, 186, 372, 744, 1488, 1488)))
    it should s"come in time to one of 124 members that is busy, at $kbps kbit/s (TB-32)" in
      node(TransportParams(Own, 7, kbps = kbps)) { b =>
        b.send(Seq(1), to = 0, members = Some((1 to 125).toSet))
        for (wait <- waits) {
          b.hear(toAll(Code.Busy, 0, 0x87, 2)(3))
          assert(b.run(ms(wait) - 1).isEmpty && b.run(1).map(code) == Seq(Code.Short), wait)
        }
      }

  it should "name who has not confirmed it, or refused it" in node() { b =>
    b.send(Seq(1), to = 0, members = Some(Set(3, 4, 5)))
    b.hear(toAll(Code.Done, 0, 0x87, 0x80, 0)(3), toAll(Code.Done, 0, 0x87, 0x80, 1)(4))
    assert(b.run(ms(500)).map(code) == Seq.fill(9)(Code.Short) :+ Code.Close)
    assert(b.ended() == Seq(Ended(1, all.NotConfirmed, Set(4, 5))))
    b.send(Seq(1), tag = 2, to = 0, members = Some(Set(3, 4)))
    b.hear(toAll(Code.Done, 1, 0x87, 0x80, 0)(3), toAll(Code.Done, 1, 0x87, 0x80, 1)(4))
    assert(b.ended() == Seq(Ended(2, all.Refused, Set(4))))
  }

  it should "go out once if there is nobody, and not be called delivered" in node() { b =>
    assert(b.send(message(20), to = 0, members = Some(Set(Own))).size == 4)
    assert(b.ended() == Seq(Ended(1, all.NotConfirmed, Set())))
  }
}

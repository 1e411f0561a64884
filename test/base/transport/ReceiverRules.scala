package flyframe.transport

/** Rules of the receiver (TP-20 to TP-25, TP-30 to TP-32 and their choices). */
abstract class ReceiverRules extends TransportCases {
  import TransportCases._

  /** An answer to the peer. */
  private def answer(code: Int, bytes: Int*) = BusFrame(id(code, to = Peer, from = Own), bytes)
  private def doneBy(number: Int, result: Int = 0, life: Int = Life) =
    answer(Code.Done, number, life, 7, result)
  private def busyBy(number: Int) = answer(Code.Busy, number, Life, 2)
  private def missingBy(number: Int, first: Int, map: Long) =
    answer(Code.Missing, Seq(number, Life, first) ++ Sizes.bytes(map, 5): _*)

  /** A whole message comes, and is taken. */
  private def deliver(b: Bench, number: Int, data: Seq[Int] = Seq(1), life: Int = Life): Received = {
    if (data.size <= 6) b.hear(short(number, data, life = life))
    else b.hear(open(number, data, life = life) +: parts(data): _*)
    val m = b.take()
    assert(m.data == data && m.number == number)
    assert(b.run() == Seq(doneBy(number, life = life)))
    m
  }

  "TP-24: a message" should "go to the host once, and be confirmed when the host has taken it" in node() {
    b =>
      for ((length, n) <- Seq(1, 6, 7, 8, 9, 2047, 2048).zipWithIndex) {
        val data   = message(length, n)
        val frames = if (length <= 6) Seq(short(n, data)) else open(n, data) +: parts(data)
        assert(b.hear(frames: _*).isEmpty)
        assert(b.hear(frames.head) == Seq(busyBy(n)))
        val got = b.take()
        assert(got == Received(Peer, toAll = false, 0, n, urgent = false, repeat = n == 0, data))
        assert(b.run() == Seq(doneBy(n)))
        assert(b.hear(frames.head) == Seq(doneBy(n)) && b.t.received.isEmpty)
      }
      assert(b.counts == Map.empty)
  }

  "TP-24: a message with a wrong CRC" should "be asked for anew, as a whole" in node() { b =>
    val data = message(20)
    val bad  = parts(message(20, salt = 1))
    assert(b.hear(open(0, data) +: bad: _*) == Seq(doneBy(0, 2)))
    assert(b.t.received.isEmpty && b.counts == Map(Counter.WrongCrc -> 1))
    assert(b.hear(open(0, data) +: parts(data): _*).isEmpty)
    assert(b.take().data == data)
  }

  "TP-24, TB-10: a message that the host refuses" should "be answered so, each time" in node() { b =>
    b.hear(short(0, Seq(1)))
    b.take(refused = true)
    assert(b.run() == Seq(doneBy(0, 1)))
    assert(b.hear(short(0, Seq(1))) == Seq(doneBy(0, 1)) && b.t.received.isEmpty)
    deliver(b, 1)
  }

  "TP-20: an older life" should "be ignored, a newer one let all pipes begin anew" in node() { b =>
    deliver(b, 9, life = 100)
    for (older <- Seq(99, 37))
      assert(b.hear(short(10, Seq(1), life = older), open(10, message(9), life = older)).isEmpty)
    assert(b.counts == Map(Counter.OldLife -> 4) && b.t.received.isEmpty)
    b.hear(open(0, message(20), pipe = 1, life = 100))
    assert(b.run(ms(1)).isEmpty)
    deliver(b, 0, life = 36) // 64 ahead
    assert(b.counts(Counter.Dropped) == 1)
    assert(b.hear(parts(message(20), pipe = 1).head).map(code) == Seq(Code.Unknown))
    deliver(b, 1, life = 36)
  }

  "TP-20, TB-12: HELLO and CLOSE" should "tell a life, too" in node() { b =>
    deliver(b, 9)
    val hello = (life: Int) => BusFrame(id(Code.Hello, to = 0), life +: Seq.fill(7)(0))
    b.hear(hello(Life - 1), hello(Life))
    assert(b.hear(short(9, Seq(1))) == Seq(doneBy(9)))
    b.hear(hello(Life + 1))
    deliver(b, 0, life = Life + 1)
    b.hear(BusFrame(id(Code.Close), Seq(255, Life + 2)))
    deliver(b, 0, life = Life + 2)
    assert(b.counts == Map(Counter.OldLife -> 1))
  }

  "TP-20: a source that was silent for 10 s" should "be forgotten" in node() { b =>
    deliver(b, 9)
    b.run(ms(9999))
    assert(b.hear(short(0, Seq(2), life = Life - 1)).isEmpty && b.t.received.isEmpty)
    b.run(ms(1))
    deliver(b, 0, life = Life - 1)
  }

  it should "not be so before 500,000 bits have passed (TB-28)" in
    node(TransportParams(Own, 7, kbps = 5)) { b =>
      deliver(b, 9)
      b.run(ms(99999))
      assert(b.hear(short(0, Seq(2), life = Life - 1)).isEmpty && b.t.received.isEmpty)
      b.run(ms(1))
      deliver(b, 0, life = Life - 1)
    }

  "TP-20, TB-12: a source of which data come" should "not be forgotten" in node() { b =>
    val data = message(2048)
    deliver(b, 0)
    b.hear(open(1, data))
    for (part <- parts(data)) {
      b.hear(part)
      b.run(ms(100))
    }
    assert(b.take().data == data)
  }

  "TP-21: OPEN and SHORT" should "be answered, ignored or begun by their number" in node() { b =>
    deliver(b, 200)
    assert(b.hear(short(200, Seq(1))) == Seq(doneBy(200)))
    assert(b.hear(short(199, Seq(1)), short(72, Seq(1)), open(100, message(9))).isEmpty)
    assert(b.t.received.isEmpty && b.counts == Map(Counter.OldNumber -> 3))
    deliver(b, 201)
    deliver(b, 201 + 127 & 0xff)
    deliver(b, 201 + 128 & 0xff, message(100))
  }

  it should "go on with the same message, and drop an older one" in node() { b =>
    val data = message(30)
    b.hear(open(0, data) +: parts(data).take(2): _*)
    assert(b.hear(open(0, data) +: parts(data).drop(2): _*).isEmpty)
    assert(b.take().data == data)
    b.run()
    b.hear(open(1, data) +: parts(data).take(2): _*)
    b.hear(open(2, data) +: parts(data).drop(2): _*)
    assert(b.counts == Map(Counter.Dropped -> 1) && b.t.received.isEmpty)
    assert(b.hear(parts(data).take(2): _*).isEmpty && b.take().number == 2)
  }

  "TB-14: an OPEN" should "not drop a newer message, nor one that is whole" in node() { b =>
    val data = message(30)
    b.hear(open(1, data), open(0, message(40)))
    assert(b.counts == Map(Counter.OldNumber -> 1))
    b.hear(parts(data): _*)
    assert(b.hear(open(1, message(30, 1))) == Seq(busyBy(1)) && b.hear(open(2, data)) == Seq(busyBy(2)))
    assert(b.take().number == 1)
  }

  "TP-21, TP-32, TB-15: four messages" should "come in at once, the next ones find the receiver busy" in
    node() { b =>
      val data = message(2048)
      for (pipe <- 0 to 3) assert(b.hear(open(0, data, pipe)).isEmpty)
      assert(b.hear(open(0, data, 4)).map(f => (code(f), f.data)) == Seq((Code.Busy, Seq(0, Life, 2))))
      assert(b.counts == Map(Counter.NoBuffer -> 1))
      for (pipe <- 0 to 3) b.hear(parts(data, pipe): _*)
      // Short ones have places of their own: eight, the last for urgent ones.
      for (pipe <- 5 to 11) assert(b.hear(short(0, Seq(1), pipe)).isEmpty)
      assert(b.hear(short(0, Seq(1), 12)).map(code) == Seq(Code.Busy))
      for (pipe <- (0 to 3) ++ (5 to 11)) assert(b.take().pipe == { b.run(); pipe })
      assert(b.hear(open(0, data, 4)).isEmpty && b.hear(short(0, Seq(1), 12)).isEmpty)
    }

  "TB-35: an urgent short message" should "find a place where as many others wait as may" in node() { b =>
    for (pipe <- 0 to 7) b.hear(short(0, Seq(1), pipe))
    assert(b.hear(short(0, Seq(1), 13, urgent = true)).isEmpty)
    assert(b.hear(short(0, Seq(1), 14, urgent = true)).map(code) == Seq(Code.Busy))
    val taken = Seq.fill(8) { b.run(); b.take().pipe }
    assert(taken.toSet == (0 to 6).toSet + 13)
  }

  it should "leave the last place to the next one, wherever it is itself" in node() { b =>
    assert(b.hear(short(0, Seq(1), 13, urgent = true)).isEmpty)
    for (pipe <- 0 to 5) assert(b.hear(short(0, Seq(1), pipe)).isEmpty)
    assert(b.hear(short(0, Seq(1), 6)).map(code) == Seq(Code.Busy))
    assert(b.hear(short(0, Seq(1), 14, urgent = true)).isEmpty)
  }

  "TP-22, TB-17: data frames that do not fit" should "be ignored and counted" in node() { b =>
    val data = message(20)
    val good = parts(data)
    def like(f: BusFrame, number: Int = -1, end: Option[Boolean] = None, bytes: Seq[Int]) = {
      val id = FrameId.of(f.id)
      BusFrame(id.copy(number = if (number < 0) id.number else number, end = end.getOrElse(id.end)), bytes)
    }
    b.hear(open(0, data))
    b.hear(
      like(good(2), number = 3, bytes = Seq(1, 2, 3, 4)),
      like(good(0), number = 255, bytes = data.take(8))
    )
    b.hear(
      like(good(0), bytes = data.take(7)),
      like(good(2), bytes = data.take(8)),
      like(good(0), bytes = Nil)
    )
    b.hear(like(good(0), end = Some(true), bytes = data.take(8)))
    b.hear(like(good(2), end = Some(false), bytes = data.drop(16)))
    b.hear(good(0), like(good(0), bytes = Seq.fill(8)(0)))
    val counts =
      Map(Counter.TooHigh -> 2, Counter.WrongDlc -> 3, Counter.WrongEnd -> 2, Counter.Double -> 1)
    assert(b.counts == counts)
    b.hear(good(1), good(2), good(2)) // the last one comes when it is whole
    assert(b.take().data == data && b.counts == counts + (Counter.Double -> 2))
  }

  "TP-23: with the end mark" should "the missing frames be named" in node() { b =>
    val data = message(400) // 50 frames
    val all  = parts(data)
    b.hear(open(0, data))
    assert(
      b.hear(all.zipWithIndex.filterNot(f => Set(3, 5, 42, 43)(f._2)).map(_._1): _*) ==
        Seq(missingBy(0, 3, 1L << 39 | 1L << 37 | 1L))
    )
    // Again when the highest one of those has come.
    assert(b.hear(all(3)).isEmpty && b.hear(all(42)) == Seq(missingBy(0, 5, 1L << 39 | 1L << 1)))
    assert(b.hear(all(43)) == Seq(missingBy(0, 5, 1L << 39)))
    assert(b.hear(all(5)).isEmpty && b.take().data == data)
  }

  it should "also be whole when the last one was not the last to come" in node() { b =>
    val data = message(20)
    b.hear(open(0, data) +: parts(data).reverse.drop(1): _*)
    assert(b.hear(parts(data).last).isEmpty && b.take().data == data)
  }

  "TP-23: T_gap without a frame" should "bring MISSING, ten times the end" in node() { b =>
    b.hear(open(0, message(20)))
    val sent = b.runTimed(ms(1000))
    assert(sent.map(_._2) == Seq.fill(9)(missingBy(0, 0, 7L << 37)))
    assert(sent.map(_._1 - Start) == (1 to 9).map(n => ms(20.0 * n)))
    assert(b.counts == Map(Counter.Dropped -> 1))
    assert(b.hear(parts(message(20)).head).map(code) == Seq(Code.Unknown))
  }

  it should "count in a row, and wait for 4,000 bits where they are slow (TB-30)" in
    node(TransportParams(Own, 7, kbps = 5)) { b =>
      b.hear(open(0, message(20)))
      assert(b.runTimed(ms(7999)).map(_._1 - Start) == (1 to 9).map(n => ms(800.0 * n)))
      b.hear(parts(message(20)).last)
      assert(b.run(ms(7999)).size == 9 && b.counts == Map.empty)
      b.run(ms(2))
      assert(b.counts == Map(Counter.Dropped -> 1))
    }

  "TP-23, TB-30: what was not sent yet" should "not be missing" in node() { b =>
    val all = parts(message(100)) // 13 frames
    b.hear(open(0, message(100)) +: Seq(0, 1, 4).map(all): _*)
    assert(b.run(ms(20)) == Seq(missingBy(0, 2, 3L << 38)))
    assert(b.hear(all(3)) == Seq(missingBy(0, 2, 1L << 39)))
    assert(b.run(ms(20)) == Seq(missingBy(0, 2, 1L << 39))) // it is lost again
    assert(b.hear(all(2)).isEmpty && b.run(ms(199)).isEmpty)
    // Behind the last frame its sender asks by OPEN.
    assert(b.hear(open(0, message(100))).isEmpty && b.run(ms(20)) == Seq(missingBy(0, 5, 0xffL << 32)))
    assert(b.hear(all(12)) == Seq(missingBy(0, 5, 0xfeL << 32)))
    assert(b.hear(all.slice(5, 12): _*).isEmpty && b.take().data == message(100))
  }

  it should "not be so behind OPEN alone, as of a message that has waited" in node() { b =>
    val all = parts(message(400)) // 50 frames
    b.hear(open(0, message(400)))
    assert(b.run(ms(20)) == Seq(missingBy(0, 0, (1L << 40) - 1)))
    assert(b.hear(all.take(40): _*) == Seq(missingBy(0, 40, 0x3ffL << 30)))
    assert(b.hear(all.drop(40): _*).isEmpty && b.take().data == message(400))
  }

  it should "not be so of a message with a wrong CRC" in node() { b =>
    b.hear(open(0, message(20)) +: parts(message(20, salt = 1)): _*)
    assert(b.run(ms(20)).isEmpty)
    b.hear(open(0, message(20)))
    assert(b.run(ms(20)) == Seq(missingBy(0, 0, 7L << 37)))
  }

  "TB-16: OPEN again" should "begin the gap anew" in node() { b =>
    b.hear(open(0, message(20)))
    b.run(ms(15))
    assert(b.hear(open(0, message(20))).isEmpty && b.run(ms(19)).isEmpty)
    assert(b.run(ms(1)) == Seq(missingBy(0, 0, 7L << 37)))
  }

  "TP-25: data without an open message" should "be told so, at most every 10 ms" in node() { b =>
    val frames = parts(message(2000))
    assert(b.hear(frames: _*) == Seq(answer(Code.Unknown, 0)))
    b.run(ms(11))
    assert(b.hear(frames.take(9): _*) == Seq(answer(Code.Unknown, 0)))
    deliver(b, 4)
    b.run(ms(11))
    assert(b.hear(frames.take(9): _*) == Seq(doneBy(4)))
    assert(b.counts == Map(Counter.NoMessage -> 268))
  }

  it should "be told so no sooner, wherever in a millisecond it came" in node() { b =>
    val frame = parts(message(2000)).head
    for (us <- 0 to 999 by 37) {
      b.run(ms(20) + us)
      assert(b.hear(frame) == Seq(answer(Code.Unknown, 0)))
      for (step <- Seq(500, 8600, 899)) {
        b.run(step)
        assert(b.hear(frame).isEmpty, s"$us us and $step us")
      }
      b.run(ms(1))
      assert(b.hear(frame) == Seq(answer(Code.Unknown, 0)), s"$us us")
    }
  }

  "CLOSE" should "drop the open message of its number and life" in node() { b =>
    def close(number: Int, life: Int = Life) = BusFrame(id(Code.Close), Seq(number, life))
    b.hear(open(3, message(20)))
    b.hear(close(2), close(3, Life - 1))
    assert(b.counts == Map(Counter.Unexpected -> 1, Counter.OldLife -> 1))
    assert(b.hear(close(3)).isEmpty && b.counts(Counter.Dropped) == 1)
    assert(b.run(ms(100)).isEmpty)
    b.hear(short(4, Seq(1)), close(4)) // too late
    assert(b.take().number == 4)
  }

  "TB-22: messages given up" should "not come late, nor make the next ones look old" in node() { b =>
    def close(number: Int) = BusFrame(id(Code.Close), Seq(number, Life))
    deliver(b, 0)
    for (n <- 1 to 200) assert(b.hear(close(n)).isEmpty)
    assert(b.hear(short(200, Seq(1))) == Seq(doneBy(200, 1)) && b.t.received.isEmpty)
    deliver(b, 201)
    b.hear(short(202, Seq(1)), close(203))
    assert(b.take().number == 202 && b.run().isEmpty) // TB-25
    assert(b.hear(short(202, Seq(1))).isEmpty && b.hear(short(203, Seq(1))) == Seq(doneBy(203, 1)))
    assert(b.hear(close(203), close(202)).isEmpty)
    assert(b.counts == Map(Counter.OldNumber -> 1, Counter.Unexpected -> 2))
    deliver(b, 204)
  }

  private val hello = BusFrame(id(Code.Hello, to = 0), Life +: Seq.fill(7)(0))

  /** Of the peer there are only HELLO. */
  private def seconds(b: Bench, count: Int): Unit = for (_ <- 1 to count) {
    b.run(ms(1000))
    b.hear(hello)
  }

  "TP-21, TB-25: messages that pass by" should "not make the next ones look old, nor bring DONE" in node() {
    b =>
      b.hear(short(0, Seq(1)))
      for (n <- 1 to 256) assert(b.hear(short(n & 0xff, Seq(2))) == Seq(busyBy(n & 0xff)), n)
      assert(b.take().data == Seq(1) && b.run().isEmpty) // the sender would take it for that of the last one
      deliver(b, 0)
      assert(b.counts == Map.empty)
  }

  it should "not do so while no buffer is free" in node() { b =>
    deliver(b, 0)
    for (pipe <- 1 to 4) b.hear(open(0, message(20), pipe))
    for (n    <- 1 to 200) assert(b.hear(open(n, message(20))) == Seq(busyBy(n)), n)
    b.run(ms(200))
    assert(b.hear(short(199, Seq(1))) == Seq(doneBy(199, 1)) && b.t.received.isEmpty)
    deliver(b, 201, message(20))
  }

  it should "also be those that are given up" in node() { b =>
    b.hear(short(0, Seq(1)))
    for (n <- 1 to 256) b.hear(short(n & 0xff, Seq(2)), BusFrame(id(Code.Close), Seq(n & 0xff, Life)))
    assert(b.take().data == Seq(1) && b.run().isEmpty)
    assert(b.hear(short(0, Seq(2))) == Seq(doneBy(0, 1)))
    deliver(b, 1)
  }

  "TB-26: a pipe of which nothing comes for 20 s" should "be forgotten, but not its mark" in node() { b =>
    deliver(b, 5)
    seconds(b, 19)
    assert(b.hear(short(5, Seq(1))) == Seq(doneBy(5)))
    seconds(b, 19)
    assert(b.hear(parts(message(20)).head) == Seq(doneBy(5)))
    seconds(b, 20)
    assert(b.hear(parts(message(20)).head).map(code) == Seq(Code.Unknown))
    assert(!deliver(b, 5).repeat)
    b.hear(short(6, Seq(1)))
    seconds(b, 20)
    assert(b.take().number == 6 && b.run().isEmpty)
    deliver(b, 200)
  }

  it should "not be so before 1,000,000 bits have passed" in node(TransportParams(Own, 7, kbps = 5)) { b =>
    deliver(b, 5)
    seconds(b, 199)
    assert(b.hear(short(5, Seq(1))) == Seq(doneBy(5)))
    seconds(b, 200)
    assert(b.hear(parts(message(20)).head).map(code) == Seq(Code.Unknown))
  }

  it should "not be so as long as doubles come, before and behind the host's taking" in node() { b =>
    b.hear(open(3, message(20)) +: parts(message(20)): _*)
    for (_ <- 1 to 30) {
      seconds(b, 1)
      b.hear(parts(message(20)).head)
    }
    assert(b.take().number == 3 && b.run() == Seq(doneBy(3)))
    for (_ <- 1 to 30) {
      seconds(b, 1)
      assert(b.hear(parts(message(20)).head) == Seq(doneBy(3)))
    }
    assert(b.hear(open(3, message(20))) == Seq(doneBy(3)) && b.t.received.isEmpty)
  }

  "TB-27: answers that have waited for 1 s" should "not go any more" in node() { b =>
    b.run()
    b.isHeld = true
    for (pipe <- 0 to 8) {
      b.hear(short(0, Seq(1), pipe))
      if (pipe < 8) b.take() // eight answers, of which seven get into the port
    }
    b.take()
    b.run(ms(1000) - 1)
    assert(b.waiting.filterNot(isHello).map(code) == Seq.fill(7)(Code.Done))
    b.run(1)
    assert(b.waiting.filterNot(isHello).isEmpty && b.counts == Map(Counter.AnswerLost -> 2))
    b.isHeld = false
    b.leave()
    assert(b.hear(short(0, Seq(1))) == Seq(doneBy(0)))
  }

  "TB-31: answers that wait" should "hold data back that would go first, each other 100 ms" in node() { b =>
    b.run()
    b.isHeld = true
    b.hear(short(0, Seq(1)))
    b.take()
    b.run()
    val start  = b.now
    def data() = b.waiting.filter(isData).map(f => FrameId.of(f.id)).map(id => (id.destination, id.urgent))
    def leaves(): Unit = b.leave(f => isData(f) || code(f) == Code.Open)
    b.send(message(9), to = Peer + 1)
    assert(data() == Seq.fill(2)((Peer + 1, false)))
    leaves()
    b.send(message(9), tag = 2, to = Peer - 1, urgent = true)
    assert(data() == Seq.fill(2)((Peer - 1, true)))
    leaves()
    for (n <- 1 to 12) b.send(message(2048), tag = 2 + n, to = Peer - 1)
    // Whatever answers come meanwhile. A frame leaves each millisecond.
    val free = for (time <- 0 until 500) yield {
      if (time == 60 || time == 190) {
        b.hear(short(0, Seq(1), pipe = time / 60))
        b.take()
      }
      leaves()
      b.run(start + ms(time + 1) - 1 - b.now)
      data().contains((Peer - 1, false))
    }
    for ((isFree, time) <- free.zipWithIndex if time % 100 > 5) // OPEN goes first
      assert(isFree == (time % 200 > 100), s"$time ms")
  }

  it should "do so also where one answer follows another at once" in node() { b =>
    b.run()
    b.isHeld = true
    for (n <- 1 to 12) b.t.send(n, Peer - 1, urgent = false, message(2048), b.now)
    val free = for (time <- 0 until 500) yield {
      b.hear(short(time / 2 & 0xff, Seq(1), pipe = time % 2))
      b.take()
      b.leave() // with the DONE before
      b.run(ms(1) - 1)
      assert(b.waiting.exists(code(_) == Code.Done))
      val isFree = b.waiting.exists(isData)
      b.run(1)
      isFree
    }
    assert(free == (0 until 500).map(_ / 100 % 2 == 1))
  }

  it should "hold OPEN back with its data, and no SHORT" in node() { b =>
    b.run()
    b.isHeld = true
    b.hear(short(0, Seq(1)))
    b.take()
    b.run()
    assert(b.send(message(9), to = Peer - 1).isEmpty)
    assert(b.send(Seq(1), tag = 2, to = Peer - 1).map(code) == Seq(Code.Short))
    assert(b.send(message(9), tag = 3, to = Peer).map(code) == Seq(Code.Open, 0, 1))
    b.leave(code(_) != Code.Done)
    b.hear(done(0)) // of the third message
    assert(b.run(ms(100) - 1).map(code).distinct == Seq(Code.Short))
    assert(b.run(1).map(code) == Seq(Code.Open, 0, 1))
  }

  "TP-30, TB-13: the first message of each pipe after the start" should "carry the mark" in node() { b =>
    assert(deliver(b, 7).repeat && !deliver(b, 8).repeat)
    b.hear(short(7, Seq(1), pipe = 1))
    assert(b.take().repeat)
    assert(!deliver(b, 0, life = Life + 1).repeat) // the sender has begun anew, not the receiver
    b.run(ms(10000))
    assert(deliver(b, 9, life = Life + 1).repeat) // forgotten
  }

  it should "be the first one that gets to the host" in node() { b =>
    b.hear(open(0, message(20)))
    b.run(ms(200)) // dropped
    assert(deliver(b, 1).repeat && !deliver(b, 2).repeat)
  }

  "TB-18: the host" should "get urgent messages first, each until it takes it" in node() { b =>
    b.hear(short(0, Seq(1), 0), short(0, Seq(2), 1), short(0, Seq(3), 2, urgent = true))
    b.hear(short(0, Seq(4), 3, urgent = true))
    assert(b.t.received == b.t.received)
    val order = for (_ <- 1 to 4) yield { val m = b.take(); b.run(); m.data.head }
    assert(order == Seq(3, 4, 1, 2) && b.t.received.isEmpty)
  }

  it should "keep a whole message whose sender begins a new life, without telling it" in node() { b =>
    b.hear(short(0, Seq(1)))
    assert(b.hear(short(0, Seq(2), life = Life + 1)).isEmpty)
    assert(b.take().data == Seq(1) && b.run().isEmpty)
    assert(b.take().data == Seq(2) && b.run() == Seq(doneBy(0, life = Life + 1)))
  }

  "TP-31: a message to all" should "be answered as if addressed, beside one to the node" in node() { b =>
    val data  = message(20)
    val frame = open(0, data)
    val toAll = frame.copy(
      id = FrameId.of(frame.id).copy(destination = 0).word,
      data = frame.data.updated(1, Life | 0x80)
    )
    b.hear(frame, toAll)
    b.hear(parts(data, to = 0): _*)
    val m = b.take()
    assert(m.toAll && m.data == data)
    assert(b.run() == Seq(answer(Code.Done, 0, Life | 0x80, 0x87, 0)))
    b.hear(parts(data): _*)
    assert(!b.take().toAll && b.run() == Seq(doneBy(0)))
    b.run(ms(11))
    val other = parts(data, pipe = 5, to = 0).head
    assert(b.hear(other).map(_.data) == Seq(Seq(0x80)))
  }
}

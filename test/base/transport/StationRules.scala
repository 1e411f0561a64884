package flyframe.transport

import scala.collection.mutable

/** HELLO and process data (TP-31, TP-50). */
abstract class StationRules extends TransportCases {
  import TransportCases._

  private val hello = Seq(1, 2, 3, 4, 5, 6, 7)

  /** Every frame that a node sends within some time, also HELLO. */
  private def all(t: TransportUnderTest, from: Long, us: Long): Seq[(Long, BusFrame)] = {
    val sent = mutable.Buffer.empty[(Long, BusFrame)]
    var now  = from
    while (now <= from + us) {
      val due = t.poll(now)
      for (f <- t.queued()) {
        sent += now -> f
        t.left(f.id)
      }
      now = (now + 1) max (due min (from + us + 1))
    }
    sent.toSeq
  }

  "TP-31, TB-21: HELLO" should "go to all at the start, every second, and when a port changes" in
    withTransport(TransportParams(Own, life = 7, hello = hello), Start) { t =>
      val frame = BusFrame(FrameId(urgent = false, 0, isData = false, Own, 0x20, 0, end = true), 7 +: hello)
      assert(all(t, Start, ms(2999)) == Seq(0, 1000, 2000).map(n => (Start + ms(n), frame)))
      t.setHello(hello.updated(0, 9), Start + ms(2999))
      assert(all(t, Start + ms(2999.5), ms(0.2)) == Nil)
      t.setHello(hello.updated(1, 6), Start + ms(2999.8))
      assert(all(t, Start + ms(2999.8), 10).map(_._2.data) == Seq(Seq(7, 1, 6, 3, 4, 5, 6, 7)))
    }

  "TP-31: the members" should "be those of whom a HELLO came within 3 s" in node() { b =>
    def helloOf(from: Int, life: Int = 5) =
      BusFrame(id(Code.Hello, to = 0, from = from), life +: Seq.fill(7)(0))
    b.hear(helloOf(3), helloOf(125, 0x85))
    b.run(ms(1000))
    b.hear(helloOf(4))
    b.run(ms(1999))
    assert(b.t.members(b.now) == Set(3, 4, 125))
    b.run(ms(1))
    assert(b.t.members(b.now) == Set(4))
    b.send(Seq(1), to = 0)
    b.hear(BusFrame(id(Code.Done, from = 4), Seq(0, 0x87, 0x80, 0)))
    assert(b.ended().map(_.outcome) == Seq(Outcome.Delivered))
  }

  private def helloFrom(from: Int) =
    BusFrame(id(Code.Hello, to = 0, from = from), Life +: Seq.fill(7)(0))

  "TP-31, TB-28: HELLO" should "be rarer on a slow ring with many nodes" in
    withTransport(TransportParams(Own, life = 7, kbps = 5), Start) { t =>
      def times(from: Double, us: Long) = all(t, Start + ms(from), us).map(f => (f._1 - Start) / 1000)
      assert(times(0, ms(2500)) == Seq(0, 1000, 2000))
      for (from <- 10 to 18) t.receive(helloFrom(from), Start + ms(2500)) // with itself ten nodes
      assert(times(2500, ms(4000)) == Seq(4000, 6000))
      for (from <- 3 to 125; _ <- 1 to 2) t.receive(helloFrom(from), Start + ms(6600))
      assert(times(6600, ms(60000)) == Seq(30800, 55600))
    }

  "TP-31, TB-33: HELLO" should "be early when a port comes up or goes down, ten HELLO apart" in
    withTransport(TransportParams(Own, life = 7, kbps = 5, hello = hello), Start) { t =>
      for (from <- 10 to 18) t.receive(helloFrom(from), Start) // with itself ten nodes: every 2 s
      def times(from: Double, bits: Int) = (0 until 3000).flatMap { n =>
        t.setHello(hello.updated(1, if (n % 2 == 0) bits else 0), Start + ms(from + 10 * n))
        all(t, Start + ms(from + 10 * n), ms(9)).map(f => (f._1 - Start) / 1000)
      }
      assert(times(0, 0xbb) == (0 until 15).map(2000 * _)) // signal, search and stuck levels
      assert(times(30000, 0x04) == 30000 +: 30010 +: (16 until 30).map(2000 * _).patch(10, Seq(50010), 0))
      assert(times(60000, 0x40) == 60000 +: (31 until 45).map(2000 * _).patch(5, Seq(70010), 0))
    }

  "TP-31, TB-28: the members" should "be there for as long as the rarest HELLO is rare" in
    node(TransportParams(Own, life = 7, kbps = 5)) { b =>
      b.hear(helloFrom(3))
      b.run(ms(74999))
      assert(b.t.members(b.now) == Set(3))
      b.run(ms(1))
      assert(b.t.members(b.now) == Set())
    }

  "TP-50: process data" should "go out on change and every 100 ms" in node() { b =>
    def value(data: Int*) =
      BusFrame(FrameId(urgent = false, 9, isData = true, Own, 200, 15, end = true), data)
    assert(b.t.setObject(9, 200, Seq(1, 2), b.now))
    assert(b.runTimed(ms(250)) == Seq(0, 100, 200).map(n => (Start + ms(n), value(1, 2))))
    b.t.setObject(9, 200, Seq(1, 2), b.now)
    assert(b.run().isEmpty)
    b.t.setObject(9, 200, Nil, b.now)
    assert(b.runTimed(ms(150)) == Seq(250, 350).map(n => (Start + ms(n), value())))
  }

  it should "be the newest value when one still waits" in node() { b =>
    b.t.setObject(0, 1, Seq(1), b.now)
    b.isHeld = true
    assert(b.run().map(_.data) == Seq(Seq(1)))
    for (n <- 2 to 5) {
      b.t.setObject(0, 1, Seq(n), b.now)
      assert(b.run(ms(1)).isEmpty)
    }
    b.leave()
    assert(b.run().map(_.data) == Seq(Seq(5)))
  }

  "TP-50, TB-27: a value that has waited for 300 ms" should "be taken back, and the newest one go" in node() {
    b =>
      def values = b.waiting.filterNot(isHello).map(_.data)
      b.t.setObject(0, 1, Seq(1), b.now)
      b.isHeld = true
      b.run()
      b.t.setObject(0, 1, Seq(2), b.now)
      assert(b.run(ms(300) - 1).isEmpty && values == Seq(Seq(1)))
      assert(b.run(1).map(_.data) == Seq(Seq(2)) && values == Seq(Seq(2)))
      b.run(ms(60000))
      b.t.setObject(0, 1, Seq(3), b.now)
      b.run(ms(300))
      assert(values == Seq(Seq(3)))
  }

  "TB-27: a HELLO that has waited for 1 s" should "be taken back, and a new one go" in
    node(TransportParams(Own, life = 7, hello = hello)) { b =>
      b.isHeld = true
      b.run()
      b.t.setHello(hello.reverse, b.now)
      b.run(ms(999))
      assert(b.waiting.map(_.data) == Seq(7 +: hello))
      b.run(ms(1))
      assert(b.waiting.map(_.data) == Seq(7 +: hello.reverse))
    }

  it should "do so long before the next one is due" in
    node(TransportParams(Own, life = 7, kbps = 5, hello = hello)) { b =>
      for (from <- 3 to 60) b.hear(helloFrom(from))
      b.isHeld = true
      b.t.setHello(hello.updated(1, 6), b.now) // a port changes
      b.run()
      b.t.setHello(Seq(9, 6, 3, 4, 5, 6, 7), b.now)
      b.run(ms(3999))
      assert(b.waiting.map(_.data) == Seq(7 +: hello.updated(1, 6)))
      b.run(ms(1))
      assert(b.waiting.map(_.data) == Seq(Seq(7, 9, 6, 3, 4, 5, 6, 7)))
    }

  "TP-50: values" should "have 64 places, and 64 to be followed" in node() { b =>
    assert(
      (0 until 64).forall(n => b.t.setObject(1, n, Seq(n), b.now)) && !b.t.setObject(1, 64, Seq(1), b.now)
    )
    assert(b.t.setObject(1, 63, Seq(1), b.now))
    assert((0 until 64).forall(n => b.t.watch(Peer, n)) && !b.t.watch(Peer, 64) && b.t.watch(Peer, 63))
  }

  it should "be forgotten with all others, sent and followed" in node() { b =>
    b.t.setObject(9, 200, Seq(1), b.now)
    b.t.watch(Peer, 1)
    b.run()
    b.t.forgetValues()
    assert(b.runTimed(ms(250)).isEmpty)
    b.hear(BusFrame(FrameId(urgent = false, Own, isData = true, Peer, 1, 15, end = true), Seq(7)))
    assert(b.t.value(Peer, 1, b.now) == ((Nil, true)) && b.counts == Map(Counter.Unwatched -> 1))
    assert((0 until 64).forall(n => b.t.setObject(1, n, Seq(n), b.now) && b.t.watch(Peer, n)))
  }

  // What is due all the time keeps nothing else from the wire.
  "TB-03: values" should "go in turn" in node() { b =>
    b.isHeld = true
    for (n <- 0 until 40) b.t.setObject(1, n, Seq(0), b.now)
    val sent = (1 to 20).flatMap { round =>
      for (n <- 0 until 8) b.t.setObject(1, n, Seq(round), b.now)
      val frames = b.run(ms(1))
      b.leave()
      frames
    }
    assert(sent.map(f => FrameId.of(f.id).number).distinct.size == 40)
  }

  "TP-50: a value received" should "be the newest one, and old after 300 ms" in node() { b =>
    def value(data: Int*) =
      BusFrame(FrameId(urgent = false, Own, isData = true, Peer, 200, 15, end = true), data)
    b.t.watch(Peer, 200)
    assert(b.t.value(Peer, 200, b.now) == ((Nil, true)) && b.t.value(9, 9, b.now) == ((Nil, true)))
    assert(!b.t.setObject(9, 200, Seq.fill(9)(1), b.now))
    assert(b.hear(value(1, 2, 3), value(4)).isEmpty)
    b.run(ms(300) - 1)
    assert(b.t.value(Peer, 200, b.now) == ((Seq(4), false)))
    b.run(1)
    assert(b.t.value(Peer, 200, b.now) == ((Seq(4), true)))
    b.hear(value())
    assert(b.t.value(Peer, 200, b.now) == ((Nil, false)))
    b.hear(value(1).copy(id = value(1).id + (1 << 5)))
    assert(b.counts == Map(Counter.Unwatched -> 1) && b.t.received.isEmpty)
  }
}

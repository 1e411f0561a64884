package flyframe.server

import java.net.InetSocketAddress
import java.time.Instant
import scala.util.{Random, Using}
import org.scalatest.flatspec.AnyFlatSpec
import flyframe.Directory
import flyframe.protocol.{RingFlag, RingPart, RingResult, RingStatus}

/** The server with rings: a whole one on loopback, and gateways that the test plays. */
class RingServerSpec extends AnyFlatSpec {
  import ServerBench._
  private def bytes(text: String): Seq[Byte] = text.getBytes("UTF-8").toSeq
  private def ring(server: Server.Running, id: Int = 7): ujson.Value =
    state(server)("rings").arr.find(_("id").num == id).get
  private def log(server: Server.Running): Seq[String] =
    get(server, "log.csv").body.linesIterator.toSeq.drop(1)
  private def hello(ports: Int, distances: (Int, Int)) =
    Seq(1, 9, 0, ports, 0, 0, 0x12, 0x34, 2, distances._1, distances._2)

  /** All messages of a gateway that the log has. */
  private def messages(options: Options, id: Int = 7): Seq[Seq[Byte]] =
    Using.resource(EventStore.open(options.database).fold(fail(_), identity))(
      _.messages(id, 0, 1000000).map(_._2.toSeq)
    )

  "GW-04, GW-07: messages of nodes" should "be kept once each, in order, whatever the network does" in {
    Directory { directory =>
      val random = new Random(11)
      val all = Seq.tabulate(120)(i =>
        Seq.fill(1 + random.nextInt(if (i % 4 == 0) 2048 else 20))(random.nextInt().toByte)
      )
      val given = options(directory)
      Using.resource(start(given)) { server =>
        Using.resource(new ModelGateway(Life(7, 99), server.udpPort, faults = 0.1, random = random)) {
          gateway =>
            for ((data, i) <- all.zipWithIndex) {
              gateway.message(2 + i % 5, i % 15, i / 75, data)
              if (i % 10 == 0) gateway.settle(3)
            }
            gateway.settle(3)
            assert(gateway.waiting == 0)
        }
      }
      assert(messages(given) == all)
    }
  }

  it should "be stored before they are acknowledged, also through restarts of the server" in Directory {
    directory =>
      val given = options(directory)
      val long  = Seq.fill(2048)(0x41.toByte)
      var all   = Vector.empty[Seq[Byte]]
      for (i <- 1 to 3) Using.resource(start(given)) { server =>
        Using.resource(new ModelGateway(Life(7, 100 + i), server.udpPort)) { gateway =>
          // The one before was told that the server had it only if it has: the sender repeats the others.
          if (i > 1) gateway.message(3, 0, i - 2, all.last, repeat = true)
          gateway.message(3, 0, i - 1, long.updated(7, i.toByte))
          all :+= long.updated(7, i.toByte)
          gateway.settle()
        }
      }
      assert(messages(given) == all)
  }

  it should "come again only when they were not stored, and be kept if they only may be one" in Directory {
    directory =>
      val given = options(directory)
      Using.resource(start(given)) { server =>
        def of(life: Long)(act: ModelGateway => Unit): Unit =
          Using.resource(new ModelGateway(Life(7, life), server.udpPort)) { g => act(g); g.settle() }
        of(1)(_.message(4, 2, 10, bytes("first")))
        of(2) { g =>
          g.message(4, 2, 10, bytes("first"), repeat = true) // a repeat
          g.message(4, 2, 11, bytes("second"))
          g.message(4, 3, 10, bytes("first"), repeat = true)                  // another pipe
          g.message(5, 2, 10, bytes("first"), repeat = true)                  // another node
          g.message(4, 2, 10, bytes("first"), lifeByte = 0x85, repeat = true) // to all
        }
        of(3) { g =>
          g.message(4, 2, 11, bytes("second"), lifeByte = 6, repeat = true) // another life of the node
          g.message(4, 2, 12, bytes("third"), lifeByte = 6)
        }
      }
      assert(
        messages(given).map(d => new String(d.toArray)) ==
          Seq("first", "second", "first", "first", "first", "second", "third")
      )
  }

  it should "be kept though they look like a repeat if no sender goes on for so long" in Directory {
    directory =>
      val data = bytes("door open").toVector
      def part = Part(RingPart.Message, 4, data, 0, 0, 5, RingFlag.Repeat, data.size)
      Using.resource(EventStore.open(options(directory).database).fold(fail(_), identity)) { store =>
        def isKept(life: Long, at: Instant) =
          !store.take(RingReport(Life(7, life), 9, 1, 0, parts = Vector(part)), at)._1.head.again
        val first = Instant.parse("2026-03-01T10:00:00Z")
        assert(isKept(1, first))
        assert(!isKept(2, first.plusSeconds(300)))
        // A board that was replaced begins with the life and the message of the one before.
        assert(isKept(3, first.plusSeconds(3600)))
        assert(!isKept(4, first.plusSeconds(3900)))
        // The clock was set back.
        assert(isKept(5, first))
      }
  }

  it should "be whole: a message that a restart has cut comes anew" in Directory { directory =>
    val given = options(directory)
    val long  = Seq.tabulate(2048)(_.toByte)
    Using.resource(start(given)) { server =>
      Using.resource(new ModelGateway(Life(7, 1), server.udpPort)) { g =>
        g.message(4, 0, 0, long)
        g.settle()
      }
      Using.resource(new ModelGateway(Life(7, 2), server.udpPort)) { g =>
        g.message(9, 0, 0, long)
        eventually("one piece is stored") {
          if (g.waiting == 2) g.report()
          g.listen(20)
          g.waiting == 1
        }
      }
      Using.resource(new ModelGateway(Life(7, 3), server.udpPort)) { g =>
        g.message(9, 0, 0, long, repeat = true)
        g.settle()
      }
    }
    assert(messages(given) == Seq(long, long))
  }

  "GW-07: the picture" should "show nodes, break, messages, and the log what has changed" in withServer() {
    server =>
      Using.resource(new ModelGateway(Life(7, 1), server.udpPort)) { g =>
        g.node(1, hello(0x44, (0, 0)): _*)
        for (a <- 2 to 5) g.node(a, hello(0x44, (5 - a + 1, a - 1)): _*)
        g.ring(0, 0)
        g.settle()
        assert(ring(server)("nodes").arr.map(_("address").num.toInt) == Seq(1, 2, 3, 4, 5))
        assert(ring(server)("nodes").arr.forall(_("state").str == "normal") && ring(server)("whole").bool)
        val before = log(server).size
        for (a <- 2 to 5) g.node(a, hello(0x44, (4, a)): _*) // only distances
        g.settle()
        assert(log(server).size == before)
        g.node(3, hello(0x04, (0, 2)): _*)
        g.node(4, 0)
        g.node(5, hello(0x40, (1, 0)): _*)
        g.ring(3, 5)
        g.message(5, 0, 0, bytes("door open"), urgent = true)
        g.settle()
        val shown = ring(server)
        assert(shown("ends").arr.map(_.num.toInt) == Seq(3, 5) && !shown("whole").bool)
        val nodes = shown("nodes").arr.map(n => n("address").num.toInt -> n).toMap
        assert(nodes(3)("text").str == "port 2 down" && nodes(4)("state").str == "lost")
        assert(nodes(5)("text").str == "port 1 down" && nodes(2)("state").str == "normal")
        val lines = log(server).drop(before).mkString("\n")
        for (
          text <- Seq(
            "node 3: port 2 down",
            "node 4: lost",
            "ring broken between node 3 and node 5",
            "“door open”"
          )
        ) assert(lines.contains(text))
      }
  }

  it should "be there after a restart of the server, and the log tells nothing twice" in Directory {
    directory =>
      val given  = options(directory)
      var before = 0
      def tell(g: ModelGateway): Unit = {
        g.node(2, hello(0x44, (1, 1)): _*)
        g.node(3, 0)
        g.ring(2, 2)
        g.settle()
      }
      Using.resource(start(given)) { server =>
        Using.resource(new ModelGateway(Life(7, 1), server.udpPort))(tell)
        before = log(server).size
      }
      Using.resource(start(given)) { server =>
        assert(ring(server)("silent").bool && ring(server)("nodes").arr.size == 2)
        assert(ring(server)("nodes")(0)("state").str == "unknown" && !ring(server)("broken").bool)
        assert(ring(server)("text").str == "not known yet whether the ring is whole")
        Using.resource(new ModelGateway(Life(7, 2), server.udpPort))(tell)
        assert(log(server).size == before && !ring(server)("silent").bool)
        assert(ring(server)("present").num == 1 && ring(server)("nodes")(0)("state").str != "unknown")
        assert(
          ring(server)("text").str == "node 2 is alone: it hears no other" && ring(server)("broken").bool
        )
        // A node that was there before the gateway's restart, and is not told of any more.
        Using.resource(new ModelGateway(Life(7, 3), server.udpPort)) { g =>
          g.node(5, hello(0x44, (2, 2)): _*)
          g.settle()
        }
        val nodes = ring(server)("nodes").arr.map(n => n("address").num.toInt -> n("text").str).toMap
        assert(nodes == Map(2 -> "not heard yet", 3 -> "lost", 5 -> "normal"))
        assert(ring(server)("present").num == 1)
      }
  }

  private def node(address: Int, distances: (Int, Int)) =
    Part(RingPart.Node, address, hello(0x44, distances).map(_.toByte).toVector)
  private def lost(address: Int) = Part(RingPart.Node, address, Vector(0))

  /** Nodes that lie in this order in a ring that is whole. */
  private def inRing(addresses: Int*) =
    addresses.zipWithIndex.map { case (a, i) => node(a, if (i == 0) (0, 0) else (addresses.size - i, i)) }

  "GW-07: a lost node" should "stand where it was, whatever becomes of the fibres" in {
    def report(parts: Part*) = RingReport(Life(7, 1), 9, 1, 0, parts = parts.toVector)
    val all                  = Seq(1, 6, 3, 5, 2, 4)
    val whole                = Ring(7).after(report(inRing(all: _*): _*))
    val without              = report(inRing(1, 6, 2, 4): _*)
    assert(whole.order == all)
    // Its host is dead, its controller relays: the others are as far away as before.
    assert(whole.after(report(lost(5))).order == all)
    // It was taken out with its neighbour, and the fibres joined. Then another one is lost, and is back.
    val less = whole.after(report(lost(3), lost(5))).after(without)
    assert(less.order == all)
    assert(less.after(report(lost(2))).order == all)
    assert(less.after(report(lost(2))).after(report(node(2, (2, 2)))).order == all)
    // The fibres were joined before it was missed.
    assert(whole.after(report(inRing(1, 6, 3, 2, 4).filter(_.source != 3): _*)).order == all)
    assert(whole.after(report(inRing(1, 6, 3, 2, 4).filter(_.source != 3) :+ lost(5): _*)).order == all)
    // The ring breaks where it was: those behind it are heard at port 1 only.
    val broken = whole.after(report(lost(5), node(2, (2, 0)), node(4, (1, 0)), Part(3, 1, Vector(3, 2))))
    assert(broken.order == all)
    // The gateway has restarted.
    assert(whole.aged.after(without).order == all)
    // A new one.
    assert(less.after(report(inRing(1, 6, 7, 2, 4): _*)).order == Seq(1, 6, 3, 5, 7, 2, 4))
  }

  it should "stand there after a restart of the server, too, though nobody tells of it" in Directory {
    directory =>
      val given                         = options(directory)
      def order(server: Server.Running) = ring(server)("nodes").arr.map(_("address").num.toInt).toSeq
      for (life <- 1 to 2) Using.resource(start(given)) { server =>
        Using.resource(new ModelGateway(Life(7, life.toLong), server.udpPort)) { g =>
          if (life == 1) {
            g.happen(inRing(1, 4, 3, 2): _*)
            g.settle()
            g.happen(lost(3) +: inRing(1, 4, 2): _*)
          }
          g.settle()
          assert(order(server) == Seq(1, 4, 3, 2))
        }
      }
  }

  "GW-07: a node that dies while the gateway is down" should "be lost when it could have been told" in {
    var now   = 0L
    val rings = new Rings(_.forall(now - _ > 1000), 1, () => now, () => Instant.EPOCH)
    def report(life: Long, parts: Part*): Unit =
      rings.take(RingReport(Life(7, life), 9, 1, 0, parts = parts.toVector), new InetSocketAddress(0))
    def isLost = !rings.picture(_ => false).head.ring.nodes(3).present
    def pass(ms: Int, parts: Part*): Boolean = {
      for (_ <- 1 to ms / 500) {
        now += 500
        report(2, parts: _*)
      }
      isLost
    }
    for (state <- Seq(Part(RingPart.Ring, 1, Vector(2, 4)), Part(RingPart.Ring, 1, Vector(0, 0)))) {
      report(1, inRing(1, 2, 3, 4) :+ state: _*)
      assert(!isLost)
      report(2, inRing(1, 2, 4): _*)
      assert(!pass(200000), "it is not known whether the ring is whole")
      report(2, state)
      assert(!pass(75000), "so long HELLO may take on the slowest ring")
      now += 50000
      rings.tick()
      assert(!pass(75000), "the gateway was silent")
      assert(!pass(75000, node(2, (3, 1))), "it may have more to tell")
      assert(rings.takeLost().isEmpty && pass(500) && rings.takeLost() == Seq(7 -> 3))
      assert(pass(200000) && rings.takeLost().isEmpty)
    }
  }

  "GW-07: the page" should "tell a ring as whole only when its gateway has" in withServer() { server =>
    def shown   = (ring(server)("whole").bool, ring(server)("broken").bool, ring(server)("text").str)
    val unknown = (false, false, "not known yet whether the ring is whole")
    Using.resource(new ModelGateway(Life(7, 1), server.udpPort)) { g =>
      g.node(1, hello(0x44, (0, 0)): _*)
      g.settle()
      assert(shown == unknown)
      g.ring(0, 0)
      g.settle()
      assert(shown == ((true, false, "ring whole")))
    }
    // Behind a restart of the gateway that is not known any more.
    Using.resource(new ModelGateway(Life(7, 2), server.udpPort)) { g =>
      g.settle()
      assert(shown == unknown)
      g.ring(3, 5)
      g.settle()
      assert(shown == ((false, true, "ring broken between node 3 and node 5")))
    }
  }

  "GW-07: a ring that made room for others" should "be shown as its gateway has told it when it is back" in {
    var now     = 0L
    def rings() = new Rings(_.forall(now - _ > 1000), 1, () => now, () => Instant.EPOCH)
    val node    = Part(RingPart.Node, 2, hello(0x44, (1, 1)).map(_.toByte).toVector)
    val whole   = Part(RingPart.Ring, 1, Vector(0, 0))
    def report(to: Rings, id: Int, parts: Part*): Unit =
      to.take(RingReport(Life(id, 1), 9, 1, 0, parts = parts.toVector), new InetSocketAddress(0))
    def shown(of: Rings) = of.picture(_ => false).map(_.ring)

    val known = rings()
    for (id <- 1 to Rings.MostRings) report(known, id, node, whole)
    assert(!known.hasRoom(100))
    now += 1001
    report(known, 100, node)
    assert(shown(known).map(_.id) == (2 to Rings.MostRings) :+ 100)
    report(known, 1)
    val back = shown(known).find(_.id == 1).get
    assert(back.isTold && back.ends.isEmpty && back.nodes.get(2).exists(n => n.present && !n.isOld))

    // The log knows more rings than are shown.
    val restarted = rings()
    restarted.restore(
      (1 to Rings.MostRings + 1).map(id => back.copy(id = id, life = Some(Life(id, 1)), heardMs = None))
    )
    assert(shown(restarted).map(_.id) == (1 to Rings.MostRings))
    report(restarted, 1 + Rings.MostRings, whole)
    val last = shown(restarted).find(_.id == 1 + Rings.MostRings).get
    assert(last.isTold && last.nodes.get(2).exists(_.isOld))
    // The newest life comes first in the log. Who has not been heard makes room, the oldest life first.
    assert(shown(restarted).map(_.id) == (1 until Rings.MostRings) :+ 1 + Rings.MostRings)
    report(restarted, 1)
    report(restarted, 100, node)
    assert(shown(restarted).map(_.id) == (1 to Rings.MostRings - 2) ++ Seq(1 + Rings.MostRings, 100))
    now += 1001
    report(restarted, 101, node)
    assert(shown(restarted).map(_.id) == (1 to Rings.MostRings - 3) ++ Seq(1 + Rings.MostRings, 100, 101))
  }

  "GW-06: a message of the server" should "be taken once, whatever the network does, and its result told" in
    withServer() { server =>
      val random = new Random(5)
      Using.resource(new ModelGateway(Life(7, 1), server.udpPort, faults = 0.2, random = random)) { g =>
        g.results = s => (s.counter % 3).toInt
        g.settle(3)
        val page               = new PageClient(server)
        def post(body: String) = page.post("api/ring", body)
        for (i <- 1 to 12) {
          val answer =
            post(s"""{"ring": 7, "node": ${i % 5 * 2}, "text": "n° $i", "urgent": ${i % 2 == 0}}""")
          assert(answer.statusCode == 202, answer.body)
          eventually(s"$i is done") {
            g.report()
            g.listen(10)
            ring(server)("orders").arr.last("state").str match {
              case "delivered" | "refused" | "not confirmed" => true
              case _                                         => false
            }
          }
        }
        assert(g.sends.map(s => new String(s.data.toArray, "UTF-8")) == (1 to 12).map(i => s"n° $i"))
        assert(
          g.sends.map(_.destination) == (1 to 12).map(_ % 5 * 2) && g.sends.map(_.urgent) == (1 to 12).map(
            _ % 2 == 0
          )
        )
        val ends = ring(server)("orders").arr.map(_("state").str).toSeq
        assert(ends == (1 to 12).map(i => RingText.result(i % 3)))
        for (
          wrong <- Seq(
            """{"ring": 7, "node": 126, "text": "x"}""",
            """{"ring": 7, "node": 2, "text": ""}""",
            """{"ring": 7, "node": 2, "hex": "0"}""",
            s"""{"ring": 7, "node": 2, "text": "${"x" * 1025}"}""",
            """{"ring": 7, "node": 2, "text": "x", "hex": "00"}""",
            "nonsense"
          )
        ) assert(post(wrong).statusCode == 400, wrong)
        assert(post("""{"ring": 7, "node": 1, "text": "x"}""").statusCode == 409)
        assert(post("""{"ring": 8, "node": 2, "text": "x"}""").body.contains("no ring 8"))
      }
    }

  it should "end as not confirmed when the gateway restarts, and others leave all the same" in withServer() {
    server =>
      val page               = new PageClient(server)
      def post(text: String) = page.post("api/ring", s"""{"ring": 7, "node": 3, "text": "$text"}""")
      def states             = ring(server)("orders").arr.map(_("state").str).toSeq
      def untilTaken(g: ModelGateway, count: Int): Unit = eventually(s"$count are taken") {
        g.report()
        g.listen(10)
        g.sends.size == count
      }
      Using.resource(new ModelGateway(Life(7, 1), server.udpPort)) { g =>
        g.settle()
        g.tells = false
        assert(post("one").statusCode == 202)
        untilTaken(g, 1)
      }
      Using.resource(new ModelGateway(Life(7, 2), server.udpPort)) { g =>
        g.settle()
        assert(states == Seq("not confirmed: the gateway has restarted"))
        eventually("the log has it, too") {
          log(server).exists(
            _.contains("message 1 of the server to node 3: “one”: not confirmed: the gateway")
          )
        }
        assert(post("two").statusCode == 202)
        untilTaken(g, 1)
        g.settle()
        assert(states.last == "delivered" && g.sends.map(_.counter) == Seq(1))
      }
  }

  it should "wait for no message to another node, however long that one is busy" in withServer(
    // Each is given up after a moment more than the gateway takes.
    _.copy(orderTimeoutMs = 1)
  ) { server =>
    val page = new PageClient(server)
    def post(node: Int, text: String) =
      page.post("api/ring", s"""{"ring": 7, "node": $node, "text": "$text"}""").statusCode
    def states = ring(server)("orders").arr.map(_("state").str).toSeq
    Using.resource(new ModelGateway(Life(7, 1), server.udpPort)) { g =>
      g.settle()
      g.answers = _.destination != 3
      assert((1 to 5).map(i => post(3, s"busy $i")) == Seq(202, 202, 202, 202, 409))
      assert(post(4, "other") == 202 && post(5, "another") == 202)
      eventually("the others are done") {
        g.report()
        g.listen(10)
        states.drop(4) == Seq("delivered", "delivered")
      }
      assert(g.sends.map(_.destination) == Seq(3, 4, 5))
      assert(states.take(4) == "on its way" +: Seq.fill(3)("waits for the one before"))
    }
  }

  "GW-06: messages to a ring" should "end once each, when the gateway is silent or tells no result" in {
    val now                      = Instant.EPOCH
    val o                        = new RingOrders(1000)
    def add(node: Int, ms: Long) = o.add(node, urgent = false, Vector(1, 2), ms, now).isRight
    def ends                     = o.all.map(_.outcome.fold("")(_.fold(identity, _ => "done")))
    def next(taken: Long, ms: Long) =
      o.next(taken, isBusy = false, ms).map(m => (m.counter.get, m.destination))
    val noResult = "not confirmed: no result has come in time"
    assert(add(3, 0) && add(3, 0) && add(4, 0))
    assert(next(7, 0).contains((8, 3)) && next(7, 100).isEmpty && next(7, 200).contains((8, 3)))
    assert(next(8, 300).contains((9, 4)) && next(9, 400).isEmpty)
    o.told(9, RingResult.Delivered)
    assert(!o.tick(1000) && o.tick(1001))
    assert(ends == Seq("", "not sent in time", "done"))
    assert(!o.tick(1300) && o.tick(1301)) // the gateway has had it since 300
    assert(ends == Seq(noResult, "not sent in time", "done"))
    assert(o.takeEnded().map(_.id) == Seq(2, 1) && o.takeEnded().isEmpty)
    // A result that comes late is none.
    o.told(8, RingResult.Delivered)
    assert(ends == Seq(noResult, "not sent in time", "done") && !o.tick(5000))

    // One of which nobody knows whether the gateway has it keeps its counter, and does nothing any more.
    assert(add(5, 5000) && next(9, 5000).contains((10, 5)) && o.tick(6001) && ends.last == noResult)
    for (i <- 1 to 40) assert(add(6, 6100) && o.tick(8000 + i), i)
    assert(add(6, 9000))
    assert(next(9, 9000).contains((10, Ring.Gateway)) && next(9, 9200).contains((10, Ring.Gateway)))
    assert(next(10, 9300).contains((11, 6)))
    o.told(10, RingResult.Refused)
    o.told(11, RingResult.Delivered)
    assert(ends.last == "done" && o.all.find(_.counter.contains(10)).get.outcome.contains(Left(noResult)))

    // A gateway that restarts: counters begin anew, and what has not left does so.
    assert(add(7, 9400) && add(7, 9400) && next(11, 9400).contains((12, 7)))
    o.abandon()
    assert(ends.takeRight(2) == Seq("not confirmed: the gateway has restarted", ""))
    assert(next(0, 9500).contains((1, 7)))
    o.abandon()
    assert(next(0, 9600).isEmpty && o.takeEnded().size == 43)
  }

  "GWB-10: urgent messages to a ring" should "leave first, and have a place while three nodes are busy" in {
    val o                               = new RingOrders(1000)
    def add(node: Int, urgent: Boolean) = o.add(node, urgent, Vector(1), 0, Instant.EPOCH).isRight
    def next(taken: Long, isBusy: Boolean = false) =
      o.next(taken, isBusy, 0).map(m => (m.counter.get, m.destination))
    for (node <- 2 to 6) assert(add(node, urgent = false))
    assert(add(7, urgent = true))
    assert(next(0).contains((1, 7)) && next(1).contains((2, 2)) && next(2).contains((3, 3)))
    assert(next(3).isEmpty) // the fourth place is for an urgent one
    assert(add(8, urgent = true) && next(3).contains((4, 8)))
    assert(add(9, urgent = true) && next(4).isEmpty)
    o.told(3, RingResult.Delivered)
    assert(next(4).contains((5, 9)) && next(5).isEmpty)
    o.told(1, RingResult.Delivered)
    o.told(4, RingResult.Delivered)
    assert(next(5).contains((6, 4)) && next(6).isEmpty)
  }

  it should "wait for no normal one, also to the same destination, and have places of their own" in {
    val o                               = new RingOrders(1000)
    def add(node: Int, urgent: Boolean) = o.add(node, urgent, Vector(1), 0, Instant.EPOCH).isRight
    def next(taken: Long)               = o.next(taken, isBusy = false, 0).map(m => (m.counter.get, m.urgent))
    for (_ <- 1 to 4) assert(add(0, urgent = false))
    assert(!add(0, urgent = false))
    assert(next(0).contains((1, false)) && next(1).isEmpty) // a node is busy
    for (_ <- 1 to 4) assert(add(0, urgent = true))
    assert(!add(0, urgent = true))
    assert(next(1).contains((2, true)) && next(2).isEmpty) // of urgent ones, too, one at a time
    o.told(2, RingResult.Delivered)
    assert(next(2).contains((3, true)))
    o.told(1, RingResult.Delivered)
    assert(next(3).isEmpty) // a normal one waits for both
    // Six wait: three of each. Twelve of sixteen places are for all.
    assert((2 to 20).count(add(_, urgent = false)) == 6)
    assert((2 to 20).count(add(_, urgent = true)) == 4)
  }

  it should "find that place also when the server has restarted, and knows of none of the three" in
    withServer() { server =>
      val page = new PageClient(server)
      def post(node: Int, urgent: Boolean) =
        page.post("api/ring", s"""{"ring": 7, "node": $node, "text": "x", "urgent": $urgent}""").statusCode
      def until(done: => Boolean, g: ModelGateway) = eventually("the messages are taken") {
        g.report()
        g.listen(10)
        done
      }
      Using.resource(new ModelGateway(Life(7, 1), server.udpPort)) { g =>
        g.status = RingStatus.Busy
        g.settle()
        assert(post(3, urgent = false) == 202 && post(4, urgent = true) == 202)
        until(g.sends.map(_.destination) == Seq(4), g)
        for (_ <- 1 to 30) { g.report(); g.listen(10) } // longer than between two sendings
        assert(g.sends.map(_.destination) == Seq(4))
        g.status = 0
        until(g.sends.map(_.destination) == Seq(4, 3), g)
      }
    }

  "GW-07: a break" should "be told by its two ends" in {
    assert(RingText.ends(None) == "ring whole")
    assert(RingText.ends(Some((3, 5))) == "ring broken between node 3 and node 5")
    assert(RingText.ends(Some((3, 0))) == "ring broken between node 3 and an unknown node")
    assert(RingText.ends(Some((1, 1))) == "node 1 is alone: it hears no other")
  }

  "GW-07: a message" should "be shown as text only if nothing in it changes what stands beside it" in {
    assert(RingText.data(bytes("Türe 3 – zu")) == "“Türe 3 – zu”")
    for (odd <- Seq("a\nb", "a\u202eb", "a\u0000", "\u200f"))
      assert(RingText.data(bytes(odd)).matches("[0-9a-f]+"))
    assert(RingText.data(Seq(0xc3.toByte)) == "c3")
    assert(RingText.data(Seq.fill(300)('x'.toByte)).endsWith("x” … (300 bytes)"))
    for (c <- Seq("ü", "–", "\ud83d\udd25"); begin <- Seq("", "a", "ab", "abc")) {
      val long = RingText.data(bytes(begin + c * 200))
      assert(long.matches(s"“$begin($c)+” … .*"), long)
    }
    assert(RingText.data(Seq.fill(300)(0x81.toByte)) == "81" * 256 + " … (300 bytes)")
  }

  "GW-04, GWB-11: numbers of parts" should "be good up to their end, and begin anew in the next life" in
    Directory { directory =>
      val given = options(directory)
      val all   = Seq.tabulate(60)(i => bytes(s"message $i"))
      Using.resource(start(given)) { server =>
        // The server has a new log, and the gateway was there before.
        Using.resource(new ModelGateway(Life(7, 1), server.udpPort, begin = 0xffffffffL - 40)) { g =>
          for (i <- 0 until 40) {
            g.message(2, 0, i, all(i))
            g.settle()
          }
        }
        Using.resource(new ModelGateway(Life(7, 2), server.udpPort)) { g =>
          g.message(2, 0, 39, all(39), repeat = true)
          for (i <- 40 until 60) g.message(2, 0, i, all(i))
          g.settle()
        }
      }
      assert(messages(given) == all)
    }

  "GW-04: reports of a ring" should "count only with a right tag, of this life, and newer than the last" in
    withServer() { server =>
      val other = key.updated(3, 1.toByte)
      Using.resource(new ModelGateway(Life(7, 1), server.udpPort, key = other)) { g =>
        g.message(2, 0, 0, bytes("forged"))
        g.report()
        eventually("it is refused")(refused(server, Refusal.Forged) == 1)
      }
      assert(state(server)("rings").arr.isEmpty)
      val report = RingReport(Life(7, 1), 0, 1, 0, parts = Vector(Part(4, 1, Vector.fill(5)(0.toByte))))
      val whole  = RingProtocol.encode(report, key)
      // Every cut, every wrong length, and every byte that is another one: none counts.
      for (n <- 0 until whole.length)
        assert(RingProtocol.report(whole.take(n)).forall(!RingProtocol.isRight(_, whole.take(n), key)))
      for (n <- whole.indices) {
        val wrong = whole.updated(n, (whole(n) ^ 1).toByte)
        assert(!RingProtocol.report(wrong).exists(RingProtocol.isRight(_, wrong, key)), s"byte $n")
      }
      assert(RingProtocol.report(whole).contains(report) && RingProtocol.isRight(report, whole, key))
    }
}

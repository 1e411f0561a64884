package flyframe.server

import java.time.Instant
import org.scalatest.flatspec.AnyFlatSpec
import flyframe.protocol.{CommandResult, EventKind, Order, ServerDatagram}

/** The orders to one master, with tickets that a test does not reach by counting. */
class OrdersSpec extends AnyFlatSpec {
  private val now = Instant.parse("2026-01-02T03:04:05Z")

  private def told(order: Int, node: Int, ticket: Long, result: Int = CommandResult.Done) =
    Event(EventKind.Command, order, node, (ticket & 0xffff).toInt, result)

  private class Bench(tickets: Long*) {
    private val left = tickets.iterator
    val orders       = new Orders(100, () => left.next())
    def add(order: Int, node: Int = ServerDatagram.AllNodes, seconds: Int = 0): Boolean =
      orders.add(order, node, seconds, 0, now).isRight
    def addZone(order: Int, nodes: Seq[Int], doubled: Set[Int] = Set.empty): Boolean =
      orders.addZone(order, "Hall", nodes, doubled, if (order == Order.Watch) 0 else 60, 0, now).isRight
    def requests: Seq[Request]                      = Orders.requests(orders.all)
    def outcomes: Seq[Option[Either[String, Unit]]] = orders.all.map(_.outcome)
  }

  "SRV-13: an order" should "be known by the low half of its ticket, however high that is" in {
    for (ticket <- Seq(1L, 0xffffL, 0x10000L, 0x10001L, 0x1ffffL, 0xfffffffeL)) {
      val b = new Bench(ticket)
      assert(b.add(Order.Silence) && b.orders.ride(0).map(_.number).contains(ticket))
      for (wrong <- Seq(ticket - 1, ticket + 1)) b.orders.told(told(Order.Silence, 0xffff, wrong))
      b.orders.told(told(Order.Reset, 0xffff, ticket))
      b.orders.told(told(Order.Silence, 7, ticket))
      b.orders.told(told(Order.Silence, 0xffff, ticket).copy(kind = EventKind.Line))
      assert(b.outcomes == Seq(None), ticket)
      b.orders.told(told(Order.Silence, 0xffff, ticket))
      assert(b.outcomes == Seq(Some(Right(()))) && b.orders.ride(1).isEmpty, ticket)
    }
  }

  it should "ride on every answer until its result is told; then the next one does" in {
    val b = new Bench(5, 6)
    assert(b.add(Order.Disable, 4, 60) && b.add(Order.Watch, 4))
    val ridden = Seq.fill(3)(b.orders.ride(1).get)
    assert(ridden.map(t => (t.number, t.order, t.node, t.seconds)).distinct == Seq((5, Order.Disable, 4, 60)))
    b.orders.told(told(Order.Watch, 4, 6))
    assert(b.outcomes == Seq(None, None), "what has not been sent cannot be done")
    b.orders.told(told(Order.Disable, 4, 5, CommandResult.NoSuchNode))
    assert(b.outcomes == Seq(Some(Left("no such ID")), None))
    assert(b.orders.ride(2).map(_.number).contains(6L))
  }

  "SRV-14: an order" should "fail when no result comes in time, and be done when one comes late" in {
    val b = new Bench(5, 6)
    assert(b.add(Order.Silence) && b.add(Order.Reset))
    b.orders.ride(50)
    assert(!b.orders.tick(150) && b.orders.tick(151))
    assert(b.outcomes == Seq(Some(Left("the master has not told a result")), None))
    b.orders.told(told(Order.Silence, 0xffff, 5))
    assert(b.outcomes == Seq(Some(Right(())), None))
    assert(!b.orders.tick(251) && b.orders.tick(252))
    assert(b.outcomes(1).contains(Left("no report has come")))
  }

  it should "not be taken behind eight others, and the last 16 be kept" in {
    val b = new Bench(1L to 100L: _*)
    assert(Seq.fill(9)(b.add(Order.Silence)) == Seq.fill(8)(true) :+ false)
    for (i <- 1 to 30) {
      val t = b.orders.ride(0).get
      b.orders.told(told(t.order, t.node, t.number))
      assert(b.add(Order.Silence), i)
    }
    assert(b.orders.all.map(_.id) == (23 to 38))
  }

  "SRV-13: silence and reset" should "not meet an alarm that was not shown when they were asked for" in {
    val b                                  = new Bench(5, 6, 7)
    def ride(nowMs: Long, concerned: Int*) = b.orders.ride(nowMs, _ => concerned.toSet).map(_.number)
    b.orders.add(Order.Silence, 0xffff, 0, 0, now, Some(Set(1, 2)))
    b.orders.add(Order.Watch, 4, 0, 0, now)
    assert(ride(10, 1, 2, 3).isEmpty && b.orders.all.head.sentMs.isEmpty)
    assert(ride(20, 2).contains(5L), "the other one is over")
    assert(ride(30, 1, 3).isEmpty, "not again with a new one")
    assert(b.outcomes == Seq(None, None))
  }

  it should "be given up when the new alarm stays" in {
    val orders = new Orders(60000, () => 5)
    orders.add(Order.Reset, 0xffff, 0, 0, now, Some(Set(1)))
    orders.add(Order.Watch, 4, 0, 0, now)
    assert(orders.ride(5000, t => if (t.about.isEmpty) Set.empty else Set(1, 3)).isEmpty)
    assert(
      orders.ride(5001, t => if (t.about.isEmpty) Set.empty else Set(1, 3)).map(_.order).contains(Order.Watch)
    )
    assert(orders.all.head.outcome.contains(Left("not done: a new alarm")))
  }

  "SRV-25: an order for a zone" should "be one order, of one slave after the other, over lost answers" in {
    val b = new Bench(5, 6, 7, 8)
    assert(b.addZone(Order.Test, Seq(4, 9, 2)) && b.add(Order.Watch, 3))
    assert(b.requests.map(r => (r.id, r.text)) == Seq(1 -> "test zone Hall for 60 s", 2 -> "watch ID 3"))
    for ((node, i) <- Seq(4, 9, 2).zipWithIndex) {
      assert(b.requests.head.progress.contains(s"$i of 3 slaves"))
      val ridden = Seq.fill(3)(b.orders.ride(10L * i).get)
      assert(
        ridden.map(t => (t.number, t.order, t.node, t.seconds)).distinct == Seq((5 + i, Order.Test, node, 60))
      )
      assert(b.requests.map(_.outcome) == Seq(None, None) && b.orders.takeEnded().isEmpty)
      b.orders.told(told(Order.Test, node, 5L + i))
    }
    assert(b.requests.map(_.outcome) == Seq(Some(Right(())), None) && b.requests.head.progress.isEmpty)
    assert(b.orders.takeEnded().map(_.id) == Seq(1) && b.orders.takeEnded().isEmpty)
    assert(b.orders.ride(30).map(_.number).contains(8L))
  }

  it should "tell which slaves have failed, and go on with the others" in {
    val b = new Bench(5L to 9L: _*)
    assert(b.addZone(Order.Disable, Seq(1, 2, 3, 4, 5), doubled = Set(1)))
    def next(nowMs: Long) = b.orders.ride(nowMs).get
    def give(result: Int): Unit = {
      val t = next(0)
      b.orders.told(told(t.order, t.node, t.number, result))
    }
    give(CommandResult.NoSuchNode)
    give(CommandResult.Done)
    give(CommandResult.NoSuchNode)
    assert(next(0).node == 5 && !b.orders.tick(100) && b.orders.tick(101) && b.orders.current.isEmpty)
    def why = b.requests.head.outcome.get.left.getOrElse("")
    assert(
      why == "ID 1: several have this ID; ID 2, ID 4: no such ID; ID 5: the master has not told a result; " +
        "done at 1 of 5"
    )
    assert(b.orders.takeEnded().size == 1)
    b.orders.told(told(Order.Disable, 5, 9))
    assert(why == "ID 1: several have this ID; ID 2, ID 4: no such ID; done at 2 of 5", "told late")
    assert(b.orders.takeEnded().size == 1)
  }

  it should "give each slave its time, and all none when no report comes" in {
    val b = new Bench(1L to 9L: _*)
    assert(b.addZone(Order.Watch, Seq(1, 2, 3, 4)) && b.add(Order.Watch, 7))
    b.orders.ride(90)
    assert(b.orders.tick(191) && b.orders.current.map(_.node).contains(2))
    b.orders.ride(280)
    assert(!b.orders.tick(380) && b.orders.tick(381) && b.orders.current.map(_.node).contains(3))
    assert(!b.orders.tick(481) && b.orders.tick(482) && b.orders.current.map(_.node).contains(7))
    assert(
      b.requests.head.outcome.contains(
        Left("ID 1, ID 2: the master has not told a result; ID 3, ID 4: no report has come; done at 0 of 4")
      )
    )
  }

  it should "end with the life of the master, for the slaves that were not asked" in {
    val b = new Bench(1, 2, 3)
    assert(b.addZone(Order.Disable, Seq(1, 2, 3)))
    b.orders.ride(0)
    b.orders.told(told(Order.Disable, 1, 1))
    b.orders.abandon()
    assert(b.requests.head.outcome.contains(Left("ID 2, ID 3: the master has restarted; done at 1 of 3")))
    assert(b.orders.takeEnded().size == 1 && b.orders.ride(1).isEmpty)
  }

  it should "take one of eight places, and of the 16 that are kept" in {
    val b = new Bench(1L to 1000L: _*)
    assert(Seq.fill(9)(b.addZone(Order.Test, 1 to 20)) == Seq.fill(8)(true) :+ false)
    while (b.orders.current.nonEmpty) {
      val t = b.orders.ride(0).get
      b.orders.told(told(t.order, t.node, t.number))
    }
    assert((1 to 10).forall { _ =>
      val added = b.addZone(Order.Watch, Seq(1))
      b.orders.ride(0).foreach(t => b.orders.told(told(t.order, t.node, t.number)))
      added
    })
    assert(b.requests.map(_.id) == (3 to 18) && b.requests.head.tickets.size == 20)
  }

  it should "let silence, reset and acknowledgement go before the slaves that are still to be asked" in {
    val b = new Bench(1L to 9L: _*)
    assert(b.addZone(Order.Test, Seq(1, 2)))
    b.orders.ride(0)
    assert(b.add(Order.Watch, 2) && b.add(Order.Silence) && b.add(Order.Acknowledge))
    val order = Iterator
      .continually(b.orders.ride(0))
      .takeWhile(_.nonEmpty)
      .flatten
      .map { t =>
        b.orders.told(told(t.order, t.node, t.number))
        (t.order, t.node)
      }
      .toSeq
    val all = ServerDatagram.AllNodes
    assert(
      order == Seq(
        Order.Test        -> 1,
        Order.Silence     -> all,
        Order.Acknowledge -> all,
        Order.Test        -> 2,
        Order.Watch       -> 2
      )
    )
  }
}

package flyframe.transport

import org.scalatest.flatspec.AnyFlatSpec
import scala.collection.mutable

/** Rings on which a bit takes long, with many nodes or much to be sent. */
abstract class SlowRingRules extends AnyFlatSpec {
  import TransportCases._

  protected def make(p: TransportParams): TransportUnderTest

  private def onBus(kbps: Int, addresses: Range)(body: CanBus => Unit): Unit = {
    val bus = new CanBus(kbps, make)
    addresses.foreach(bus.start)
    body(bus)
    bus.close()
  }

  /** Lets time pass until so many messages of a node have ended. */
  private def ends(bus: CanBus, address: Int, count: Int, limit: Long): Seq[Ended] = {
    val all = mutable.Buffer.empty[Ended]
    bus.run(limit, { all ++= bus(address).ended(); all.size == count })
    all.toSeq
  }
  private def percent(part: Double) = f"${100 * part}%.1f %%"

  "TP-31, TB-28: HELLO of 50 nodes at 5 kbit/s" should "leave the bus to messages" in onBus(5, 1 to 50) {
    bus =>
      bus.run(ms(12000))
      assert((1 to 50).forall(a => bus.members(a) == bus.addresses - a))
      bus.load()
      bus.run(ms(20000))
      val load = bus.load()("HELLO")
      info(percent(load))
      assert(load > 0.05 && load < 0.167)
      bus(50).send(message(100), to = 49)
      assert(ends(bus, 50, 1, ms(5000)).map(_.outcome) == Seq(Outcome.Delivered))
  }

  "TP-31, TB-33: HELLO of 50 nodes of which all ports flicker" should "leave it as much" in onBus(
    5,
    1 to 50
  ) { bus =>
    bus.run(ms(12000))
    bus.load()
    for (n <- 1 to 1500; a <- 1 to 50) {
      bus(a).t.setHello(0 +: (if (n % 2 == 0) 0xff else 0) +: Seq.fill(5)(0), bus.now)
      if (a == 50) bus.run(ms(100))
    }
    val load = bus.load()("HELLO")
    info(percent(load))
    assert(load > 0.05 && load < 0.167)
  }

  // Those that stay know 50 nodes, and so are rarely heard; the new one does not.
  "TP-31, TB-28: a node" should "not be forgotten while it is there, however many each knows" in
    onBus(5, 1 to 50) { bus =>
      bus.run(ms(12000))
      (11 to 50).foreach(bus.stop)
      bus.start(64)
      bus.run(ms(12000))
      val there = (1 to 10).toSet + 64
      assert(there.forall(bus.members(_).intersect(there).size == 10))
      for (_ <- 1 to 75) {
        bus.run(ms(1000))
        for (a <- there) assert((there - a).subsetOf(bus.members(a)), s"$a at ${bus.now} us")
      }
      assert(there.forall(a => bus.members(a) == there - a))
    }

  for ((from, to, kbps) <- Seq((1, 3, 100), (1, 3, 20), (16, 1, 100), (16, 1, 20)))
    s"TP-23, TB-30, TB-29: 15 long messages from $from to $to at $kbps kbit/s" should "all be delivered" in
      onBus(kbps, 1 to 16) { bus =>
        for (n <- 1 to 14) assert(bus(from).t.send(n, to, urgent = false, message(2048, n), bus.now))
        assert(bus(from).t.send(15, 2, urgent = false, message(2048, 15), bus.now))
        val ended = ends(bus, from, 15, ms(8e6 / kbps / 5))
        assert(ended.count(_.outcome == Outcome.Delivered) == 15 && bus.taken.size == 15)
        info(s"${bus.now / 1000} ms, ${percent(bus.load()("MISSING"))} of them MISSING")
      }

  "TP-23, TB-30: messages of a node in turn" should "not be asked for before they are sent" in
    onBus(20, 1 to 16) { bus =>
      for (to <- 1 to 15) assert(bus(16).t.send(to, to, urgent = false, message(500, to), bus.now))
      assert(ends(bus, 16, 15, ms(20000)).map(_.outcome) == Seq.fill(15)(Outcome.Delivered))
      assert(bus.load()("MISSING") == 0)
    }

  for ((kbps, count) <- Seq(20 -> 50, 250 -> 124))
    s"TP-31, TB-29: a message to $count nodes at $kbps kbit/s" should "be delivered, each answering once" in
      onBus(kbps, 1 to count + 1) { bus =>
        bus.run(ms(3000))
        bus.load()
        bus(1).send(Seq(1), to = 0, members = Some((2 to count + 1).toSet))
        assert(ends(bus, 1, 1, ms(3000)).map(_.outcome) == Seq(Outcome.Delivered))
        bus.run(ms(1000))
        assert(bus.frames("DONE") == count && bus.frames("SHORT") == 1)
      }

  "TP-31, TB-32: messages to 124 nodes of which one is busy" should "leave the bus to others" in
    onBus(1000, 1 to 125) { bus =>
      bus.hostIsBusy(1)
      // Four that it has, and four for which it has no buffer.
      for (n <- 1 to 8) bus(2).send(message(7), to = 0, tag = n, members = Some((1 to 125).toSet))
      bus.run(ms(3000))
      bus.load()
      bus.run(ms(3000))
      val load = bus.load()
      info(percent(load("DONE")))
      assert(load("DONE") > 0.01 && load("DONE") < 0.1 && bus(2).ended().isEmpty)
      bus.hostIsThere(1)
      assert(ends(bus, 2, 8, ms(2000)).map(_.outcome) == Seq.fill(8)(Outcome.Delivered))
    }

  for ((kbps, urgent) <- Seq(500 -> false, 500 -> true, 20 -> false))
    s"TB-31: a node that sends long messages at $kbps kbit/s${if (urgent) ", urgent ones" else ""}" should
      "answer those with higher addresses before these are over" in onBus(kbps, 1 to 6) { bus =>
        for (to <- 4 to 5) bus(3).send(message(2048), to = to, urgent = urgent)
        bus.run(ms(3e4 / kbps)) // data are under way
        bus(6).send(message(100, 7), to = 3, tag = 7, urgent = urgent)
        // DONE leaves behind the frames that are in the port already.
        assert(ends(bus, 6, 1, ms(1e4 / kbps)).map(_.outcome) == Seq(Outcome.Delivered))
        assert(bus(3).ended().isEmpty)
      }

  for (kbps <- Seq(50, 20, 5))
    s"TP-11, TB-06: 12 messages to a busy node at $kbps kbit/s" should "leave the bus to others" in
      onBus(kbps, 1 to 3) { bus =>
        bus.hostIsBusy(1)
        for (n <- 1 to 14) bus(2).send(message(40), to = 1, tag = n)
        for (n <- 1 to 2) bus(3).send(message(40), to = 1, tag = n)
        bus.run(ms(1e5 / kbps + 10000))
        bus.load()
        bus.run(ms(1e5 / kbps))
        val load = bus.load()
        val busy = load("OPEN") + load("BUSY")
        info(percent(busy))
        assert(busy > 0.05 && busy < 0.25)
        assert(bus(2).ended().isEmpty && bus(3).ended().isEmpty)
        bus.hostIsThere(1)
        bus.run(ms(1e5 / kbps), bus.taken.size == 16)
        assert(bus.taken.size == 16)
      }
}

class SlowRingSpec extends SlowRingRules {
  protected def make(p: TransportParams): TransportUnderTest = new TransportModel(p, TransportCases.Start)
}

/** Of many nodes only some are in C: each is a process. */
class SlowRingInCSpec extends SlowRingRules {
  protected def make(p: TransportParams): TransportUnderTest =
    if (p.address <= 4 || p.address % 8 == 0) new NodeInC(p, TransportCases.Start)
    else new TransportModel(p, TransportCases.Start)
}

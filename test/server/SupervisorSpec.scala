package flyframe.server

import java.net.{InetAddress, InetSocketAddress}
import java.nio.file.{Files, Path, StandardCopyOption}
import java.sql.DriverManager
import java.time.Instant
import scala.collection.mutable
import scala.util.Random
import org.scalatest.flatspec.AnyFlatSpec
import flyframe.Directory
import flyframe.protocol.{
  CommandResult,
  DetectorState,
  EventKind,
  MasterStatus,
  Order,
  RingPart,
  ServerDatagram,
  SlaveStatus
}

/** Which reports count, and what comes of them; without sockets, and with clocks that the test turns. */
class SupervisorSpec extends AnyFlatSpec {
  private val key    = Array.tabulate[Byte](16)(i => (7 * i).toByte)
  private val Server = 0x1111111111111111L // life of the first server of a test

  /** @param server
    *   its life; later ones count up
    */
  private class Bench(
      path: Path,
      options: Options = Options(),
      expected: Expected = Expected(),
      keys: Keys = new Keys(Some(key)),
      server: Long = Server
  ) extends AutoCloseable {
    val store   = EventStore.open(path).fold(fail(_), identity)
    var clock   = 1000000L
    var today   = Instant.parse("2026-03-01T12:00:00Z")
    val sent    = mutable.Buffer.empty[(Array[Byte], InetSocketAddress)]
    var changes = 0

    /** What is to be done in the background waits while this is so. */
    var isStuck       = false
    private val work  = mutable.Queue.empty[() => Unit]
    private val lives = Iterator.iterate(server)(_ + 1)
    val supervisor = new Supervisor(
      options,
      keys,
      expected,
      store,
      (datagram, to) => sent += datagram -> to,
      () => changes += 1,
      job => if (isStuck) work += job else job(),
      () => clock,
      () => today,
      () => lives.next()
    )
    def unstick(): Unit = {
      isStuck = false
      while (work.nonEmpty) work.dequeue()()
    }
    private val counters          = mutable.Map.empty[Life, Long].withDefaultValue(0L)
    def counter(life: Life): Long = { counters(life) += 1; counters(life) }

    def give(bytes: Array[Byte], from: InetSocketAddress = here): Unit = supervisor.receive(bytes, from)

    def give(r: Report): Unit = give(Protocol.encode(r, key))

    /** A report as the master would send it next. */
    def next(life: Life, first: Long, events: Seq[Event] = Nil, line: Seq[Reported] = Nil): Report =
      Report(
        life,
        server,
        counter(life),
        first,
        events.toVector,
        line.toVector,
        status = ModelMaster.statusOf(line)
      )
    def report(life: Life, first: Long, count: Int, from: InetSocketAddress = here): Unit =
      give(Protocol.encode(next(life, first, Seq.tabulate(count)(i => event(first + i))), key), from)
    def line(states: Int*): Unit = give(next(one, 0, line = ModelMaster.line(states: _*)))

    def answers: Seq[Answer] = sent.map(s => Protocol.answer(s._1, key).getOrElse(fail("a wrong tag"))).toSeq
    def answer: Answer       = answers.last
    def refused(why: Refusal): Long    = supervisor.picture.refused.toMap.apply(why.name)
    def numbers(life: Life): Seq[Long] = store.ofLife(life, 0, 100000).map(_.number)
    def master: Picture.Seen           = supervisor.picture.masters.head
    def states: Seq[String]            = master.json("slaves").arr.map(_("state").str).toSeq
    def notices: Seq[String]           = master.json("notices").arr.map(_.str).toSeq
    def orders: Seq[String]            = master.json("orders").arr.map(_("state").str).toSeq
    def close(): Unit                  = store.close()
  }
  private def address(ip: Int, port: Int) =
    new InetSocketAddress(InetAddress.getByAddress(Array[Byte](127, 0, 0, ip.toByte)), port)
  private val (here, there)       = (address(1, 5000), address(1, 6000))
  private val (one, two)          = (Life(1, 10), Life(1, -11))
  private def event(number: Long) = Event(EventKind.Line, 0, 0, number.toInt & 0xffff)
  private def all                 = ServerDatagram.AllNodes
  private val Burns               = SlaveStatus.Alarm | SlaveStatus.Latched | SlaveStatus.Sounding

  private def bench(options: Options = Options(), expected: Expected = Expected())(
      check: Bench => Unit
  ): Unit =
    Directory { d =>
      val bench = new Bench(d.resolve("log.db"), options, expected)
      try check(bench)
      finally bench.close()
    }

  "SRV-05: a report" should "be answered to where it came from, when its events are stored" in bench() { b =>
    b.report(one, 0, 3)
    assert(b.numbers(one) == Seq(0, 1, 2))
    assert(b.answer == Answer(one, Server, 1, echo = 1, number = 3) && b.sent.last._2 == here)
    b.report(one, 0, 5, there)
    assert(b.numbers(one) == (0 to 4) && b.sent.last._2 == there)
    assert(b.answer == Answer(one, Server, 2, echo = 2, number = 5))
  }

  "SRV-05: a heartbeat" should "be answered, too, and show that the master lives" in bench() { b =>
    b.report(one, 0, 0)
    b.report(one, 0, 0)
    assert(b.answers.map(a => (a.turn, a.echo, a.number)) == Seq((1, 1, 0), (2, 2, 0)) && !b.master.silent)
  }

  "SRV-04: a report that does not know the server's life" should "be answered, and nothing else" in bench() {
    b =>
      b.line(0)
      b.report(one, 0, 1)
      val changed = b.next(one, 1, Seq(event(1)), ModelMaster.line(Burns))
      for ((life, i) <- Seq(0L, Server - 1, -Server).zipWithIndex) {
        b.clock += 1000
        b.give(changed.copy(server = life, counter = 50L + i))
        assert((b.answer.server, b.answer.echo, b.answer.number) == ((Server, 50L + i, 1L)))
      }
      assert(b.refused(Refusal.Unproven) == 3 && b.numbers(one) == Seq(0) && b.states == Nil)
      b.clock += 1000
      b.give(b.next(one, 7).copy(server = 0, counter = 60))
      assert(b.answer.number == 7, "its own number")
      b.report(one, 1, 1)
      assert(b.numbers(one) == Seq(0, 1), "their counters do not count")
  }

  it should "be answered ten times a second at most; old ones take no answer of the master's own" in bench() {
    b =>
      val old = b.next(two, 0).copy(server = 5, counter = 1000)
      b.give(old)
      for (ms <- 1 to 10000) {
        b.clock += 1
        b.give(if (ms % 500 == 0) b.next(one, 0).copy(server = 0) else old)
      }
      assert(b.sent.size <= 100 && b.answers.count(_.life == one) == 20)
  }

  it should "not get orders" in bench() { b =>
    b.report(one, 0, 0)
    b.supervisor.order(1, Order.Silence, all, 0)
    b.give(b.next(one, 0).copy(server = 5))
    assert(b.answer.order == Order.None && b.orders == Seq("next"))
    b.report(one, 0, 0)
    assert(b.answer.order == Order.Silence && b.orders == Seq("sent"))
  }

  it should "be shown as a fault when it stays so, also of a master that is not known" in bench() { b =>
    def doubt(life: Life): Unit = b.give(b.next(life, 0).copy(server = 5))
    def unproven                = b.supervisor.picture.masters.filter(_.unproven).map(_.master.id)
    doubt(one)
    b.report(one, 0, 0)
    assert(unproven.isEmpty)
    for (_ <- 1 to 6) { doubt(one); doubt(Life(5, 5)); b.clock += 1000 }
    assert(unproven == Seq(1, 5) && b.notices.exists(_.contains("not proven")))
    b.report(one, 0, 0)
    assert(unproven == Seq(5) && !b.notices.exists(_.contains("not proven")))
    b.clock += 10000
    assert(unproven.isEmpty, "none has come for long")
    doubt(Life(5, 5))
    assert(unproven.isEmpty, "a single one")
  }

  "SRV-04: a key of its own" should "prove a master's reports, and no other key" in Directory { d =>
    val other = key.reverse
    val b     = new Bench(d.resolve("log.db"), keys = new Keys(None, Map(1 -> key, 2 -> other)))
    try {
      b.report(one, 0, 1)
      b.report(Life(2, 1), 0, 1)
      b.report(Life(3, 1), 0, 1)
      assert(b.numbers(one) == Seq(0) && b.refused(Refusal.Forged) == 1 && b.refused(Refusal.Foreign) == 1)
      b.give(Protocol.encode(b.next(Life(2, 1), 0, Seq(event(0))), other))
      assert(b.numbers(Life(2, 1)) == Seq(0))
      assert(Protocol.answer(b.sent.last._1, other).exists(_.number == 1), "its answer has its key")
    } finally b.close()
  }

  "SRV-06: events that the log lacks" should "be shown, and those behind be stored" in bench() { b =>
    b.report(one, 0, 3)
    b.report(one, 5, 2)
    assert(b.numbers(one) == Seq(0, 1, 2, 5, 6) && b.answer.number == 7)
    assert(b.notices.exists(_.startsWith("Events 3 to 4 of this life of the master are not in this log")))
    b.report(one, 8, 0)
    assert(b.answer.number == 8 && b.notices.exists(_.startsWith("Events 3 to 4, 7 of")))
    b.report(two, 0, 1)
    assert(!b.notices.exists(_.startsWith("Events")), "of another life")
  }

  "SRV-08: after a restart" should "line, numbers, gaps be as in the log, the master silent" in Directory {
    d =>
      val path   = d.resolve("log.db")
      val before = new Bench(path)
      val events = Seq(
        Event(EventKind.Slave, 0, 7, Burns, state = 1),
        Event(EventKind.Slave, 1, 8, SlaveStatus.Open, state = 1),
        Event(EventKind.Detector, 0, 7, 1, DetectorState.Alarm, 3, slaveTime = 5),
        Event(EventKind.Line, 2, 0, MasterStatus.Fire | MasterStatus.SlaveFault)
      )
      before.report(one, 0, 1)
      before.give(before.next(two, 4, events))
      before.close()
      val after = new Bench(path, server = Server + 7)
      try {
        assert(after.master.master.life.contains(two) && after.master.silent)
        assert(after.states == Seq("alarm", "fault"))
        assert(after.master.json("fire")("at")(0)("since").str == before.today.toString)
        assert(after.notices.exists(_.startsWith("Events 0 to 3")))
        assert(after.notices.exists(_.startsWith("This master does not report")))
        // A report to the server before is not proven.
        after.give(after.next(two, 8, line = ModelMaster.line(0, 0)).copy(server = Server, counter = 100))
        assert(
          after.refused(Refusal.Unproven) == 1 && after.master.silent && after.states == Seq("alarm", "fault")
        )
        assert(after.answer == Answer(two, Server + 7, 1, 100, 8))
        after.give(Protocol.encode(after.next(two, 8, Seq(event(8)), ModelMaster.line(0, 0)), key), there)
        assert(!after.master.silent && after.answer.number == 9 && after.states == Seq("normal", "normal"))
      } finally after.close()
  }

  "SRV-10: a report" should "count only once, and never after a younger one" in bench() { b =>
    val reports =
      Seq.tabulate(4)(i => b.next(one, 0, line = ModelMaster.line(Seq(Burns, 0, SlaveStatus.Open, 0)(i))))
    for (i <- Seq(1, 1, 0, 2, 1, 0, 2)) b.give(reports(i))
    assert(b.refused(Refusal.Replayed) == 5 && b.states == Seq("fault") && b.sent.size == 2)
    b.give(reports(3))
    assert(b.states == Seq("normal"))
    b.give(b.next(two, 0).copy(counter = 0))
    assert(b.refused(Refusal.Replayed) == 6 && b.master.master.life.contains(one), "counters begin at 1")
  }

  "SRV-10: a restarted master" should "be known by another life; its earlier ones are over" in bench() { b =>
    b.report(one, 0, 3)
    b.report(two, 0, 2)
    assert(b.master.master.life.contains(two) && b.numbers(two) == Seq(0, 1) && b.answer.number == 2)
    b.report(one, 3, 1)
    assert(b.refused(Refusal.Replayed) == 1 && b.numbers(one) == Seq(0, 1, 2))
    b.clock += 100000
    b.report(one, 3, 1)
    assert(b.refused(Refusal.Replayed) == 2, "also when the master is silent")
    b.report(Life(1, 0), 0, 1)
    for (l <- Seq(one, two)) b.report(l, 3, 1)
    assert(b.refused(Refusal.Replayed) == 4 && b.master.master.life.contains(Life(1, 0)))
  }

  "SRV-24: a time of day that jumps, and times of the master" should "change nothing" in bench() { b =>
    b.line(Burns)
    for (days <- Seq(-10000, 10000, -3)) {
      b.today = b.today.plusSeconds(86400L * days)
      b.give(
        b.next(one, b.numbers(one).size.toLong, Seq(event(1)), ModelMaster.line(Burns))
          .copy(time = -days * 1000L)
      )
      b.supervisor.tick()
      assert(!b.master.silent && b.states == Seq("alarm") && b.refused(Refusal.Replayed) == 0)
    }
    b.clock += Options().masterTimeoutMs + 1
    assert(b.master.silent && b.numbers(one) == Seq(0, 1, 2))
  }

  "SRV-11: masters that are not on the list, or at another address" should "be refused and counted" in
    bench(Options(masters = Map(1 -> here.getAddress))) { b =>
      b.report(one, 0, 1, address(2, 5000))
      b.report(Life(2, 10), 0, 1)
      assert(b.refused(Refusal.Foreign) == 2 && b.sent.isEmpty && b.supervisor.picture.masters.isEmpty)
      b.report(one, 0, 1)
      assert(b.numbers(one) == Seq(0))
    }

  "SRV-11: more masters than there may be" should "be refused, unless a silent one can go" in bench() { b =>
    for (id <- 1 to Supervisor.MostMasters) b.report(Life(id, 1), 0, 1)
    b.give(b.next(Life(1, 1), 1, line = ModelMaster.line(Burns)))
    b.report(Life(100, 1), 0, 1)
    assert(b.refused(Refusal.Foreign) == 1)
    b.clock += 4000
    for (id <- 3 to Supervisor.MostMasters) b.report(Life(id, 1), 1, 1)
    b.clock += 4000
    b.supervisor.tick()
    b.report(Life(100, 1), 0, 1)
    b.report(Life(101, 1), 0, 1)
    // Master 1 is silent, too, but burns.
    assert(b.supervisor.picture.masters.map(_.master.id) == 1 +: (3 to Supervisor.MostMasters) :+ 100)
    assert(b.refused(Refusal.Foreign) == 2 && b.numbers(Life(2, 1)) == Seq(0), "its log stays")
  }

  "SRV-11: what is no report, or too long for one" should "be counted and not answered" in bench() { b =>
    b.give(Array.empty[Byte])
    b.give(Protocol.encode(Answer(one, Server, 1, 1, 1), key))
    b.give(new Array[Byte](Protocol.MostReportBytes))
    b.give(new Array[Byte](Protocol.MostReportBytes + 1))
    assert(b.refused(Refusal.Malformed) == 3 && b.refused(Refusal.Oversized) == 1)
    assert(b.sent.isEmpty && b.changes == 4)
  }

  "SRV-11: 10,000 forged, replayed, truncated and reordered reports" should "change nothing but counters" in
    bench() { b =>
      val random = new Random(12)
      val heard  = mutable.Buffer.empty[Array[Byte]]
      // What an attacker has heard: of the life before, of the server before, and of this one.
      for (i <- 0 until 20) {
        val states = ModelMaster.line(Seq.fill(5)(if (random.nextBoolean()) Burns else 0): _*)
        val life   = if (i < 10) two else one
        heard += Protocol.encode(b.next(life, i % 10L, Seq(event(i.toLong)), states), key)
      }
      val former =
        heard.take(10).map(d => Protocol.report(d).get.copy(server = Server - 9)).map(Protocol.encode(_, key))
      heard.foreach(b.give(_, here))
      b.supervisor.order(1, Order.Silence, all, 0)
      b.give(b.next(one, 10, line = ModelMaster.line(Burns, 0, 0, SlaveStatus.Open)))
      // What became of the order is not told yet.
      def shown = {
        val json = b.supervisor.picture.json
        json.obj.remove("refused")
        json.render()
      }
      val (before, sent, stored) = (shown, b.sent.size, b.store.after(0, 1000))
      def ignored                = Refusal.all.map(b.refused).sum
      val counted                = ignored
      for (i <- 0 until 10000) {
        val datagram = heard(random.nextInt(heard.size))
        val (bytes, why) = i % 5 match {
          case 0 => (datagram, Refusal.Replayed)
          case 1 => (datagram.take(random.nextInt(datagram.length)), Refusal.Malformed)
          case 2 =>
            // Within what the tag covers, but not where the length of the report stands.
            val at = Iterator.continually(4 + random.nextInt(96)).find(i => i < 48 || i > 49).get
            (datagram.updated(at, (datagram(at) ^ (1 << random.nextInt(8))).toByte), Refusal.Forged)
          case 3 =>
            val report = Protocol.report(datagram).get.copy(life = one, counter = 1000000L + i)
            (Protocol.encode(report, random.nextBytes(16)), Refusal.Forged)
          case 4 => (former(random.nextInt(former.size)), Refusal.Unproven)
        }
        val count = b.refused(why)
        b.give(bytes, if (random.nextBoolean()) here else there)
        assert(b.refused(why) == count + 1, s"datagram $i")
      }
      assert(ignored == counted + 10000)
      assert(shown == before && b.store.after(0, 1000) == stored)
      // Only those that are not proven are answered, so that their master learns the server's life.
      assert(b.sent.size > sent && b.sent.size < sent + 20)
      assert(b.answers.drop(sent).forall(a => a.order == Order.None && a.life == two))
      b.report(one, 10, 1)
      assert(b.answer.number == 11 && b.answer.order == Order.Silence)
    }

  "SRV-12: answers" should "have turns that rise, and another life when there are no more" in bench() { b =>
    b.report(one, 0, 0)
    val field = classOf[Supervisor].getDeclaredFields.find(_.getName.endsWith("turn")).get
    field.setAccessible(true)
    field.setLong(b.supervisor, 0xfffffffeL)
    b.report(one, 0, 0)
    b.report(one, 0, 0)
    assert(b.answers.map(_.turn) == Seq(1L, 0xffffffffL, 1L))
    val lives = b.answers.map(_.server)
    assert(lives.take(2) == Seq(Server, Server) && lives(2) != Server && lives(2) != 0)
    b.report(one, 0, 0)
    assert(b.refused(Refusal.Unproven) == 1, "the old life is over")
    b.give(b.next(one, 0).copy(server = lives(2)))
    assert(b.refused(Refusal.Unproven) == 1)
  }

  it should "never come from life 0" in Directory { d =>
    val b = new Bench(d.resolve("log.db"), server = 0)
    try {
      b.give(b.next(one, 0))
      assert(b.refused(Refusal.Unproven) == 1 && b.answer.server == 1)
    } finally b.close()
  }

  "SRV-13: an order" should "ride on every answer until the master has told the result" in bench() { b =>
    b.report(one, 0, 1)
    val sent = b.sent.size
    assert(
      b.supervisor.order(1, Order.Disable, 5, 600).isRight && b.sent.size == sent,
      "it waits for a report"
    )
    b.supervisor.order(1, Order.Reset, all, 0)
    assert(b.orders == Seq("next", "waiting"))
    for (_ <- 1 to 3) b.report(one, 1, 0)
    val ridden = b.answers.drop(sent)
    assert(ridden.map(a => (a.order, a.node, a.seconds)).distinct == Seq((Order.Disable, 5, 600)))
    assert(
      ridden.map(_.ticket).distinct.size == 1 && ridden.head.ticket != 0 && b.orders == Seq("sent", "waiting")
    )
    val told =
      Event(EventKind.Command, Order.Disable, 5, (ridden.head.ticket & 0xffff).toInt, CommandResult.Done)
    b.give(b.next(one, 1, Seq(told)))
    assert(b.orders == Seq("done", "sent") && b.answer.order == Order.Reset && b.answer.number == 2)
    assert(b.answer.ticket != ridden.head.ticket)
  }

  it should "have failed after its time, and be done when that is told late" in bench() { b =>
    b.report(one, 0, 1)
    b.supervisor.order(1, Order.Silence, all, 0)
    b.report(one, 1, 0)
    val ticket = b.answer.ticket
    b.clock += Options().orderTimeoutMs
    b.supervisor.tick()
    assert(b.orders == Seq("sent"))
    b.clock += 1
    b.supervisor.tick()
    assert(b.orders == Seq("failed"))
    b.report(one, 1, 0)
    assert(b.answer.order == Order.None && b.answer.ticket == 0)
    b.give(b.next(one, 1, Seq(Event(EventKind.Command, Order.Silence, all, (ticket & 0xffff).toInt))))
    assert(b.orders == Seq("done"))
  }

  it should "have failed when the master has restarted" in bench() { b =>
    b.report(one, 0, 1)
    b.supervisor.order(1, Order.Silence, all, 0)
    b.report(two, 0, 1)
    assert(b.master.json("orders")(0)("reason").str == "the master has restarted")
    assert(b.answer.order == Order.None)
  }

  "SRV-13: silence" should "meet no alarm that was not shown when it was asked for" in bench() { b =>
    import SlaveStatus.{Alarm, Latched}
    b.line(Burns, 0)
    b.supervisor.order(1, Order.Silence, all, 0)
    b.line(Burns, Burns)
    assert(b.answer.order == Order.None && b.orders == Seq("next"))
    b.line(Burns, Alarm | Latched)
    assert(b.answer.order == Order.Silence, "the new one has been silenced elsewhere")
    b.supervisor.order(1, Order.Reset, 1, 0)
    b.give(
      b.next(
        one,
        0,
        Seq(Event(EventKind.Command, Order.Silence, all, (b.answer.ticket & 0xffff).toInt)),
        ModelMaster.line(Burns, Burns)
      )
    )
    assert(b.answer.order == Order.Reset && b.answer.node == 1, "a reset of one detector concerns no other")
    b.supervisor.order(1, Order.Silence, all, 0, Some(Set(0)))
    b.give(
      b.next(
        one,
        1,
        Seq(Event(EventKind.Command, Order.Reset, 1, (b.answer.ticket & 0xffff).toInt)),
        ModelMaster.line(Burns, Burns)
      )
    )
    assert(b.answer.order == Order.None, "the page had not shown it")
    b.clock += 5001
    b.give(b.next(one, 2, line = ModelMaster.line(Burns, Burns)))
    assert(b.master.json("orders")(2)("reason").str == "not done: a new alarm")
  }

  "SRV-14: an order" should "not be taken for a master unknown or silent, or behind too many" in bench() {
    b =>
      def why(master: Int) = b.supervisor.order(master, Order.Silence, all, 0).left.getOrElse("")
      b.report(one, 0, 1)
      assert(why(2) == "There is no master 2.")
      assert(Seq.fill(9)(why(1)) == Seq.fill(8)("") :+ "Too many orders are waiting.")
      b.clock += 6000
      assert(why(1) == "Master 1 is silent.")
  }

  private val zones = Expected(
    Map(
      1 -> Vector(
        ExpectedSlave(1, "K", "Kitchen"),
        ExpectedSlave(2, "H1", "Hall"),
        ExpectedSlave(0, "", "Hall"),
        ExpectedSlave(3, "X", ""),
        ExpectedSlave(4, "H2", "Hall"),
        ExpectedSlave(0, "", "Cellar")
      )
    )
  )
  private val asExpected = Seq(1, 2, 0, 3, 4, 0).map(Reported(0, _))
  private def told(a: Answer, result: Int = CommandResult.Done) =
    Event(EventKind.Command, a.order, a.node, (a.ticket & 0xffff).toInt, result)

  "SRV-25: an order for a zone" should "go to each of its slaves, and be told and logged as one" in
    bench(expected = zones) { b =>
      def shown  = b.master.json("orders")(0)
      def logged = b.store.latest(1).head
      var number = 0L
      def answered(result: Int): Unit = {
        b.give(b.next(one, number, Seq(told(b.answer, result)), asExpected))
        number += 1
        b.supervisor.tick()
      }
      b.give(b.next(one, 0, line = asExpected))
      assert(b.master.json("zones").arr.map(_.str) == Seq("Kitchen", "Hall"))
      assert(b.supervisor.orderZone(1, Order.Disable, "Hall", 600).isRight && b.orders == Seq("next"))
      b.give(b.next(one, 0, line = asExpected))
      val first = b.answer
      assert((first.order, first.node, first.seconds) == ((Order.Disable, 2, 600)))
      assert(shown("text").str == "disable zone Hall for 600 s" && shown("progress").str == "0 of 2 slaves")
      b.give(b.next(one, 0, line = asExpected))
      assert((b.answer.node, b.answer.ticket) == ((2, first.ticket)) && b.orders == Seq("sent"))
      answered(CommandResult.Done)
      assert((b.answer.node, b.answer.seconds) == ((4, 600)) && b.answer.ticket != first.ticket)
      assert(b.orders == Seq("sent") && shown("progress").str == "1 of 2 slaves" && shown("reason").isNull)
      assert(logged.event.kind == EventKind.Command, "nothing of the whole before its end")
      answered(CommandResult.Done)
      assert(b.answer.order == Order.None && b.orders == Seq("done") && shown("progress").isNull)
      assert(logged.text == "disable zone Hall for 600 s: done")
      assert(EventText.severity(logged.event) == "info" && logged.received == b.today)
      b.supervisor.orderZone(1, Order.Watch, "Hall", 0)
      b.give(b.next(one, number, line = asExpected))
      answered(CommandResult.NoSuchNode)
      answered(CommandResult.Done)
      val why = "ID 2: no such ID; done at 1 of 2"
      assert(b.master.json("orders")(1)("reason").str == why && b.orders == Seq("done", "failed"))
      assert(logged.text == s"watch zone Hall: failed, $why" && EventText.severity(logged.event) == "fault")
      val csv = new StringBuilder
      LogCsv.write(csv.underlying, zones, b.store.after(_, 100))
      assert(csv.toString.linesIterator.toSeq.last.contains(s"watch zone Hall: failed, $why"))
      b.give(b.next(one, number, line = asExpected))
      assert(
        b.answer.number == number && b.numbers(one) == (0L until number),
        "the master's numbers are its own"
      )
    }

  it should "not be taken for a zone or master that is none, and leave slaves with one ID alone" in
    bench(expected = zones) { b =>
      def why(master: Int, zone: String) =
        b.supervisor.orderZone(master, Order.Test, zone, 60).left.getOrElse("")
      assert(why(1, "Hall") == "Master 1 is silent.")
      b.give(b.next(one, 0, line = asExpected.updated(3, Reported(0, 2))))
      assert(why(2, "Hall") == "There is no master 2.")
      for (zone <- Seq("Attic", "hall", "", "Cellar"))
        assert(why(1, zone) == s"Master 1 has no zone '$zone'.")
      assert(b.orders.isEmpty && why(1, "Hall").isEmpty)
      b.give(b.next(one, 0, line = asExpected))
      assert(b.answer.node == 4)
      b.give(b.next(one, 0, Seq(told(b.answer)), asExpected))
      assert(b.master.json("orders")(0)("reason").str == "ID 2: several have this ID; done at 1 of 2")
      assert(Seq.fill(9)(why(1, "Kitchen")) == Seq.fill(8)("") :+ "Too many orders are waiting.")
    }

  it should "be logged when the log works again" in Directory { d =>
    val b     = new Bench(d.resolve("log.db"), expected = zones)
    val other = DriverManager.getConnection(s"jdbc:sqlite:${d.resolve("log.db")}")
    try {
      b.give(b.next(one, 0, line = asExpected))
      other.createStatement.execute("begin immediate")
      b.supervisor.orderZone(1, Order.Test, "Kitchen", 60)
      b.give(b.next(two, 0))
      b.supervisor.tick()
      b.supervisor.tick()
      assert(b.supervisor.picture.broken.nonEmpty && b.store.after(0, 10).isEmpty)
      other.createStatement.execute("rollback")
      b.clock += Supervisor.ProbeMs
      b.supervisor.tick()
      b.supervisor.tick()
      b.supervisor.tick()
      assert(
        b.store.after(0, 10).map(_.text) ==
          Seq("test zone Kitchen for 60 s: failed, ID 1: the master has restarted; done at 0 of 1")
      )
      b.report(two, 0, 1)
      val after = new Bench(d.resolve("log.db"), expected = zones)
      try {
        assert(after.master.master.life.contains(two) && after.notices.forall(!_.startsWith("Events")))
        assert(after.store.latest(10).map(_.note.nonEmpty) == Seq(true, false))
      } finally after.close()
    } finally { other.close(); b.close() }
  }

  "SRV-23: an acknowledgement" should "be shown with its fire, until there is another one" in bench() { b =>
    def acknowledged = b.master.json("fire")("acknowledged")
    b.line(Burns, 0)
    assert(acknowledged.isNull)
    b.clock += 10
    b.supervisor.order(1, Order.Acknowledge, all, 0)
    b.line(Burns, 0)
    assert(acknowledged.isNull && b.answer.order == Order.Acknowledge)
    val told = Event(EventKind.Command, Order.Acknowledge, all, (b.answer.ticket & 0xffff).toInt)
    b.give(b.next(one, 0, Seq(told), ModelMaster.line(Burns, 0)))
    assert(acknowledged.str == b.today.toString && b.store.latest(1).head.event == told, "it is in the log")
    b.clock += 10
    b.give(b.next(one, 1, line = ModelMaster.line(Burns, Burns)))
    assert(acknowledged.isNull)
  }

  "SRV-15: a silent master" should "be a fault, its fire stay, and pages be told" in bench() { b =>
    b.line(0, Burns)
    assert(b.states == Seq("normal", "alarm"))
    val changes = b.changes
    b.clock += 5001
    b.supervisor.tick()
    b.supervisor.tick()
    assert(b.changes == changes + 1)
    assert(b.states == Seq("unknown", "alarm") && b.master.json("alarms").arr.map(_.str) == Seq("1B"))
    assert(b.notices.exists(_.startsWith("This master does not report")))
    b.line(0, Burns)
    assert(b.states == Seq("normal", "alarm") && !b.notices.exists(_.startsWith("This master does not")))
  }

  private val list = Expected(
    Map(1 -> Vector(ExpectedSlave(1, "K", "")), 2 -> Vector(ExpectedSlave(9, "H", "")))
  )

  "SRV-20: a master that is to be there" should "be shown before it reports, and never go" in
    bench(expected = list) { b =>
      def masters = b.supervisor.picture.masters
      assert(masters.map(_.master.id) == Seq(1, 2) && masters.forall(_.silent))
      assert(b.notices.contains("This master has never reported.") && b.states == Seq("unknown"))
      b.line(0)
      assert(b.states == Seq("normal") && b.notices.isEmpty)
      b.line()
      assert(b.states == Seq("lost"))
      for (id <- 3 to 8) b.report(Life(id, 1), 0, 0)
      b.report(Life(9, 1), 0, 0)
      assert(b.refused(Refusal.Foreign) == 1 && masters.map(_.master.id) == (1 to 8))
    }

  "SRV-21: missing records" should "be shown until they come, also after a restart" in Directory { d =>
    def record(sequence: Int) =
      Event(EventKind.Detector, 0, 1, sequence, DetectorState.Normal, 4, slaveTime = sequence * 10L)
    def notes(b: Bench) = b.notices.find(_.startsWith("Alarm records are missing"))
    val before          = new Bench(d.resolve("log.db"))
    before.give(before.next(one, 0, Seq(record(1), record(5)), ModelMaster.line(0)))
    assert(notes(before).contains("Alarm records are missing in this log: 3 of ID 1."))
    assert(before.master.json("slaves")(0)("notes").arr.map(_.str).contains("3 records missing in the log"))
    before.close()
    val after = new Bench(d.resolve("log.db"))
    try {
      after.give(after.next(one, 2, line = ModelMaster.line(SlaveStatus.Waiting)))
      assert(notes(after).isEmpty, "they may still come")
      after.give(after.next(one, 2, line = ModelMaster.line(0)))
      assert(notes(after).exists(_.contains("3 of ID 1")))
      after.give(after.next(one, 2, Seq(record(3), record(4), record(2)), ModelMaster.line(0)))
      assert(notes(after).isEmpty)
    } finally after.close()
  }

  /** A master's counter of lost frames at the server's times, ms; whether the page tells of them. */
  private def lost(b: Bench, life: Life, ms: Long, count: Long): Boolean = {
    b.clock += ms
    b.give(b.next(life, 0, line = ModelMaster.line(0)).copy(lost = count))
    losing(b)
  }
  private def losing(b: Bench) = b.notices.exists(_.startsWith("Frames are lost, 50 or more within 20 s"))

  "SRV-26: frames that are lost" should "be a fault from 50 within 20 s on, until fewer are" in bench() { b =>
    assert(!lost(b, one, 0, 1000), "before the server's start")
    assert(!lost(b, one, 19000, 1049) && lost(b, one, 1000, 1050))
    assert(!lost(b, one, 1, 1050), "the first ones were earlier")
    assert((1 to 100).forall(i => !lost(b, one, 1000, 1050L + 2 * i)), "two a second")
    assert(lost(b, one, 0, 1270))
    assert((1 to 100).forall(i => lost(b, one, 1000, 1270L + 3 * i)), "three a second")
    b.clock += 20000
    assert(!losing(b), "also without a report")
  }

  it should "be counted over a counter that wraps, or begins anew with a life" in bench() { b =>
    assert(!lost(b, one, 0, 0xffebL) && !lost(b, one, 1000, 28) && lost(b, one, 1000, 29))
    assert(!lost(b, one, 30000, 29) && !lost(b, two, 1000, 1000), "what it was before is not known")
    assert(!lost(b, two, 1000, 1049) && lost(b, two, 1000, 1050) && lost(b, Life(1, 3), 1000, 7))
  }

  it should "be no more than known of a master that was silent" in bench() { b =>
    assert(!lost(b, one, 0, 0) && !lost(b, one, 20001, 1000) && lost(b, one, 20000, 2000))
  }

  /** Whatever keeps the log from being written. */
  private def withoutLog(b: Bench, recovers: Boolean)(begin: => Unit)(end: => Unit): Unit = {
    b.give(b.next(one, 0, Seq(event(0)), ModelMaster.line(0, 0)))
    begin
    b.give(b.next(one, 1, Seq(event(1)), ModelMaster.line(0, Burns)))
    assert(
      b.states == Seq("normal", "alarm") && b.supervisor.picture.broken
        .exists(_.contains("cannot be written"))
    )
    assert(b.answer.number == 1 && b.answer.echo == 2, "answered, not acknowledged")
    assert(b.answer.trouble, "the master is told")
    b.give(b.next(two, 7, Seq(event(7)), ModelMaster.line(SlaveStatus.Open, Burns)))
    assert(b.states == Seq("fault", "alarm") && b.answer.number == 7, "a life that the log does not know")
    assert(b.supervisor.order(1, Order.Silence, all, 0).isRight)
    b.give(b.next(two, 7, Seq(event(7)), ModelMaster.line(0, Burns)))
    assert(b.answer.order == Order.Silence, "orders need no log")
    end
    b.clock += Supervisor.ProbeMs
    b.supervisor.tick()
    assert(b.supervisor.picture.broken.isEmpty == recovers, b.supervisor.picture.broken)
    b.give(b.next(two, 7, Seq(event(7)), ModelMaster.line(0, Burns)))
    assert(b.answer.number == (if (recovers) 8 else 7) && b.answer.trouble == !recovers)
  }

  "SRV-22: while the log is locked" should "all be shown, and events wait" in Directory { d =>
    val b     = new Bench(d.resolve("log.db"))
    val other = DriverManager.getConnection(s"jdbc:sqlite:${d.resolve("log.db")}")
    try
      withoutLog(b, recovers = true)(other.createStatement.execute("begin immediate"))(
        other.createStatement.execute("rollback")
      )
    finally { other.close(); b.close() }
  }

  "SRV-22: while the disk is full" should "all be shown, and events wait" in bench() { b =>
    // A page count that is reached fails as a full disk does.
    val field = classOf[EventStore].getDeclaredFields.find(_.getName.endsWith("writer")).get
    field.setAccessible(true)
    val writer           = field.get(b.store).asInstanceOf[java.sql.Connection]
    def pages(most: Int) = writer.createStatement.execute(s"pragma max_page_count = $most")
    // Room that is there already is used up first.
    def fill(): Unit = {
      pages(1)
      val statement = writer.createStatement
      try while (true) statement.execute("insert into probe values (zeroblob(500))")
      catch { case _: java.sql.SQLException => () }
      try
        while (true)
          statement.execute(
            "insert into event select null, 0, 99, 0, (select count(*) from event), " +
              "1, 0, 0, 0, 0, 0, 0, 0, 0"
          )
      catch { case _: java.sql.SQLException => () }
      try while (true) statement.execute("insert into life select null, 99, (select count(*) from life), 0")
      catch { case _: java.sql.SQLException => () }
    }
    withoutLog(b, recovers = true)(fill())(pages(1000000))
  }

  "SRV-22: when the database is replaced, or gone" should "all be shown, and events wait" in {
    for (
      change <- Seq[Path => Unit](
        Files.delete(_),
        path => Files.copy(path, path.resolveSibling("copy")),
        path => Files.move(path, path.resolveSibling("away"))
      )
    ) Directory { d =>
      val path = d.resolve("log.db")
      val b    = new Bench(path)
      try
        withoutLog(b, recovers = false) {
          change(path)
          if (Files.exists(path.resolveSibling("copy")))
            Files.move(path.resolveSibling("copy"), path, StandardCopyOption.REPLACE_EXISTING)
        }(())
      finally b.close()
    }
  }

  it should "be noticed without an event, too" in Directory { d =>
    val b = new Bench(d.resolve("log.db"))
    try {
      b.line(0)
      Files.delete(d.resolve("log.db"))
      b.clock += Supervisor.ProbeMs
      b.supervisor.tick()
      assert(b.supervisor.picture.broken.exists(_.contains("replaced")))
    } finally b.close()
  }

  "SRV-22: a log that hangs" should "hold up neither page nor answers, and be written later" in bench() { b =>
    b.report(one, 0, 1)
    b.isStuck = true
    b.give(b.next(one, 1, Seq(event(1)), ModelMaster.line(Burns)))
    assert(b.states == Seq("alarm") && b.sent.size == 1)
    b.clock += Supervisor.PatienceMs - 1
    b.supervisor.tick()
    assert(b.sent.size == 1)
    b.clock += 1
    b.supervisor.tick()
    assert(b.answer == Answer(one, Server, 2, 2, 1), "in time, without acknowledging")
    b.give(b.next(one, 1, Seq(event(1), event(2)), ModelMaster.line(0)))
    b.give(b.next(one, 1, Seq(event(1), event(2), event(3)), ModelMaster.line(Burns)))
    assert(
      b.answers.map(_.echo) == Seq(1, 2, 3) && b.answer.number == 1,
      "an older one is not kept waiting"
    )
    b.report(Life(2, 2), 0, 2)
    b.unstick()
    assert(
      b.answers.drop(3).map(a => (a.life, a.echo, a.number)).toSet == Set(
        (one, 4L, 4L),
        (Life(2, 2), 1L, 2L)
      )
    )
    assert(b.numbers(one) == (0 to 3) && b.numbers(Life(2, 2)) == Seq(0, 1) && b.states == Seq("alarm"))
  }

  "SRV-22: when the log was lost" should "the picture be right, and the gap be shown" in Directory { d =>
    val before = new Bench(d.resolve("log.db"))
    before.give(before.next(one, 0, Seq.tabulate(5)(i => event(i.toLong)), ModelMaster.line(0, Burns)))
    before.close()
    val after = new Bench(d.resolve("other.db"), server = Server + 1)
    try {
      after.counter(one)
      after.give(after.next(one, 5, line = ModelMaster.line(0, Burns, SlaveStatus.Disabled)))
      assert(after.states == Seq("normal", "alarm", "off"))
      assert(
        after.notices.exists(_.startsWith("Events 0 to 4 of this life of the master are not in this log"))
      )
      after.report(one, 5, 1)
      assert(after.numbers(one) == Seq(5) && after.answer.number == 6)
    } finally after.close()
  }

  "GW-07: a node that is lost while the gateway is down" should "be so in the log once, whatever restarts" in
    Directory { d =>
      def node(address: Int) =
        Part(RingPart.Node, address, Vector[Byte](1, 9, 0, 0x44, 0, 0, 0, 7, 2, 1, address.toByte))
      val whole = Part(RingPart.Ring, 1, Vector(0, 0))

      /** Servers of these lives, each with gateways of these, which tell of nodes but node 3. */
      def run(server: Long, lives: Long*)(check: Bench => Unit): Unit = {
        val b = new Bench(d.resolve("log.db"), server = server)
        def give(life: Life, first: Long, parts: Part*): Unit = b.give(
          RingProtocol.encode(RingReport(life, server, b.counter(life), first, parts = parts.toVector), key)
        )
        try {
          for (number <- lives) {
            val life  = Life(7, number)
            val parts = Seq(node(1), node(2), node(4)) ++ Option.when(number == 1)(node(3)) :+ whole
            give(life, 0, parts: _*)
            for (_ <- 1 to 100) {
              b.clock += 1000
              give(life, parts.size.toLong)
            }
            b.supervisor.tick()
          }
          check(b)
        } finally b.close()
      }
      def text(b: Bench) = b.supervisor.picture.rings.head
        .json("nodes")
        .arr
        .find(_("address").num == 3)
        .get("text")
        .str
      def told(b: Bench) = b.store.latest(1000).map(_.text).filter(_.startsWith("node 3: "))
      val lost           = "node 3: lost, not heard since the start of its gateway"
      run(Server, 1)(b => assert(text(b) == "normal"))
      run(Server + 1, 2, 3) { b =>
        assert(text(b) == "lost" && told(b) == Seq("node 3: all well", lost))
        assert(b.store.latest(1).last.event.node == 3)
      }
      run(Server + 2)(b => assert(text(b) == "lost"))
      run(Server + 3, 4)(b => assert(text(b) == "lost" && told(b).last == lost && told(b).size == 2))
    }
}

package flyframe.server

import java.net.{InetAddress, InetSocketAddress}
import java.nio.file.Path
import java.time.Instant
import scala.collection.mutable
import org.scalatest.flatspec.AnyFlatSpec
import flyframe.Directory
import flyframe.protocol.{DetectorState, EventKind, ServerDatagram}

/** Which reports count, and what comes of them; without sockets, and with a clock that the test turns. */
class SupervisorSpec extends AnyFlatSpec {
  private val key = Array.tabulate[Byte](32)(i => (7 * i).toByte)

  private class Bench(path: Path, options: Options, withKey: Boolean = true) extends AutoCloseable {
    val store   = EventStore.open(path).fold(fail(_), identity)
    var clock   = 1000000L
    var today   = Instant.parse("2026-03-01T12:00:00Z")
    val sent    = mutable.Buffer.empty[(Array[Byte], InetSocketAddress)]
    var changes = 0
    val supervisor = new Supervisor(
      options,
      Option.when(withKey)(key),
      store,
      (datagram, to) => sent += datagram -> to,
      () => changes += 1,
      () => clock,
      () => today
    )
    private var time = 0L

    def give(bytes: Array[Byte], from: InetSocketAddress): Unit = supervisor.receive(bytes, from)

    /** A report of events first, first + 1, ...; the time of the master goes on. */
    def report(
        life: Life,
        first: Long,
        count: Int,
        from: InetSocketAddress = here,
        time: Long = tick()
    ): Unit =
      give(
        Protocol.encode(Report(life, first, Vector.tabulate(count)(i => event(first + i)), time = time)),
        from
      )
    def tick(): Long = { time += 10; time }

    def acknowledged: Option[Long]     = sent.lastOption.flatMap(s => Protocol.acknowledged(s._1)).map(_._2)
    def refused(why: Refusal): Long    = supervisor.picture.refused.toMap.apply(why.name)
    def numbers(life: Life): Seq[Long] = store.ofLife(life, 0, 100000).map(_.number)
    def master: Picture.Seen           = supervisor.picture.masters.head
    def close(): Unit                  = store.close()
  }
  private def address(ip: Int, port: Int) =
    new InetSocketAddress(InetAddress.getByAddress(Array[Byte](127, 0, 0, ip.toByte)), port)
  private val (here, there)       = (address(1, 5000), address(1, 6000))
  private val (one, two)          = (Life(1, 10), Life(1, 11))
  private def event(number: Long) = Event(EventKind.Scanned, 0, 0, number.toInt & 0xffff)

  private def bench(options: Options = Options(), withKey: Boolean = true)(check: Bench => Unit): Unit =
    Directory { d =>
      val bench = new Bench(d.resolve("log.db"), options, withKey)
      try check(bench)
      finally bench.close()
    }

  "SRV-05: a report" should "be acknowledged to where it came from, when its events are stored" in bench() {
    b =>
      b.report(one, 0, 3)
      assert(b.numbers(one) == Seq(0, 1, 2))
      assert(b.acknowledged.contains(3L) && b.sent.last._2 == here)
      b.report(one, 0, 5)
      assert(b.numbers(one) == (0 to 4) && b.acknowledged.contains(5L))
  }

  "SRV-05: a heartbeat" should "need no answer, and show that the master lives" in bench() { b =>
    b.report(one, 0, 0)
    assert(b.sent.isEmpty && !b.master.silent)
  }

  "SRV-06: a report behind a gap" should "be answered by the number wanted; the page says so" in bench() {
    b =>
      b.report(one, 0, 3)
      b.report(one, 5, 2)
      assert(b.numbers(one) == Seq(0, 1, 2) && b.acknowledged.contains(3L))
      assert(b.master.json("notices").arr.exists(_.str.contains("Events 3 to 4")))
      b.report(one, 3, 4)
      assert(b.numbers(one) == (0 to 6) && b.master.json("notices").arr.isEmpty)
  }

  "SRV-08: after a restart" should "line, numbers, lives be as in the log, the master silent" in Directory {
    d =>
      val path   = d.resolve("log.db")
      val before = new Bench(path, Options())
      val events = Vector(
        Event(EventKind.Present, 0, 7, state = 1, epoch = 3),
        Event(EventKind.Detector, 0, 7, 1, DetectorState.Alarm, 3, masterTime = 500)
      )
      before.give(Protocol.encode(Report(one, 0, Vector.empty, time = 1)), here)
      before.clock += 2000
      before.give(Protocol.encode(Report(two, 0, events, time = 600)), here)
      before.close()
      val after = new Bench(path, Options())
      try {
        assert(after.master.master.life == two && after.master.silent)
        assert(after.master.master.line.alarms == Seq(0))
        assert(after.master.json("slaves")(0)("state").str == "unknown")
        // A report from before the restart tells nothing; one after it does, from another address too.
        after.give(Protocol.encode(Report(two, 0, events, time = 400)), here)
        assert(after.refused(Refusal.Replayed) == 1 && after.master.silent)
        after.give(Protocol.encode(Report(two, 2, Vector(event(2)), time = 700)), there)
        assert(!after.master.silent && after.acknowledged.contains(3L))
        assert(after.master.json("slaves")(0)("state").str == "alarm")
      } finally after.close()
  }

  "SRV-10: reports in the name of a master" should "be refused from elsewhere until it is silent" in bench() {
    b =>
      b.report(one, 0, 2)
      b.report(one, 2, 2, there)
      b.report(two, 0, 2, there)
      assert(b.refused(Refusal.Forged) == 2 && b.sent.size == 1)
      assert(b.numbers(one) == Seq(0, 1) && b.store.record(two).isEmpty)
      b.clock += Options().masterTimeoutMs
      b.report(one, 2, 2, there)
      assert(b.refused(Refusal.Forged) == 3)
      b.clock += 1
      b.report(one, 2, 2, there)
      assert(b.numbers(one) == (0 to 3) && b.sent.last._2 == there)
      b.report(one, 4, 2, here)
      assert(b.refused(Refusal.Forged) == 4)
  }

  "SRV-10: a report not younger than the last" should "be refused, beyond the wrap of time, too" in bench() {
    b =>
      b.report(one, 0, 1, time = 0xfffffff0L)
      b.report(one, 1, 1, time = 0xfffffff0L)
      b.report(one, 1, 1, time = 0xffffff00L)
      assert(b.refused(Refusal.Replayed) == 2 && b.numbers(one) == Seq(0))
      b.report(one, 1, 1, time = 5)
      b.report(one, 2, 1, time = 0xfffffff5L)
      assert(b.refused(Refusal.Replayed) == 3 && b.numbers(one) == Seq(0, 1))
  }

  it should "be refused for 35 minutes; then nobody can tell which is younger" in bench() { b =>
    b.report(one, 0, 1, time = 0xf0000000L)
    b.clock += 1000 * 2147L
    b.today = b.today.plusSeconds(2147)
    b.report(one, 1, 1, time = 0xe0000000L)
    assert(b.refused(Refusal.Replayed) == 1 && b.numbers(one) == Seq(0))
    b.clock += 1000
    b.today = b.today.plusSeconds(1)
    b.report(one, 1, 1, time = 0xe0000000L)
    assert(b.refused(Refusal.Replayed) == 1 && b.numbers(one) == Seq(0, 1))
  }

  it should "be refused for as long after a restart of the server" in Directory { d =>
    for ((seconds, refused) <- Seq((2147L, 1), (2148L, 0), (7200L, 0))) {
      val path   = d.resolve(s"$seconds.db")
      val before = new Bench(path, Options())
      before.report(one, 0, 0, time = 0xf0000000L)
      before.supervisor.close()
      before.close()
      val after = new Bench(path, Options())
      try {
        after.today = before.today.plusSeconds(seconds)
        after.report(one, 0, 1, time = 0xe0000000L)
        assert(after.refused(Refusal.Replayed) == refused && after.numbers(one).size == 1 - refused)
      } finally after.close()
    }
  }

  "SRV-10: a restarted master" should "be known by another boot number; its earlier life is over" in bench() {
    b =>
      b.report(one, 0, 3)
      b.clock += 2000
      b.report(two, 0, 2, time = 1)
      assert(b.master.master.life == two && b.master.master.line == LineState())
      assert(b.numbers(two) == Seq(0, 1) && b.acknowledged.contains(2L))
      b.clock += 2000
      b.report(one, 3, 1)
      assert(b.refused(Refusal.Replayed) == 1 && b.numbers(one) == Seq(0, 1, 2))
      assert(b.master.master.life == two)
  }

  it should "have the detectors of its earlier life whose slaves have not restarted" in bench() { b =>
    def present(i: Int, epoch: Int)           = Event(EventKind.Present, i, i + 1, state = 1, epoch = epoch)
    def told(i: Int, number: Int, state: Int) = Event(EventKind.Detector, i, i + 1, number, state, 5)
    val before =
      (0 to 2).map(present(_, 5)) ++ (0 to 2).map(told(_, 1, DetectorState.Normal)) :+ told(
        1,
        2,
        DetectorState.Alarm
      )
    b.give(Protocol.encode(Report(one, 0, before.toVector, time = 5)), here)
    b.clock += 2000
    // Slave 2A has restarted; the alarm is reported again.
    val after = Vector(present(0, 5), present(1, 5), present(2, 6), told(1, 2, DetectorState.Alarm))
    b.give(Protocol.encode(Report(two, 0, after, time = 5)), here)
    def states = b.master.json("slaves").arr.map(_("state").str)
    assert(states == Seq("normal", "alarm", "unknown"))
    assert(b.store.latest(100).count(_.event.state == DetectorState.Alarm) == 1, "in the log once")
    b.give(Protocol.encode(Report(two, 4, Vector(told(1, 3, DetectorState.Normal)), time = 6)), here)
    assert(states == Seq("normal", "normal", "unknown"))
  }

  it should "not restart within a second" in bench() { b =>
    b.report(one, 0, 1)
    b.clock += 999
    b.report(two, 0, 1, time = 1)
    assert(b.refused(Refusal.Replayed) == 1 && b.store.record(two).isEmpty)
    b.clock += 1
    b.report(two, 0, 1, time = 2)
    assert(b.numbers(two) == Seq(0))
  }

  it should "not be taken for its earlier life when that is replayed while it is silent" in bench() { b =>
    b.report(one, 0, 3, time = 100)
    b.clock += 2000
    b.report(two, 0, 1, time = 1)
    b.clock += 10000
    b.report(one, 0, 3, there, time = 100)
    assert(b.refused(Refusal.Replayed) == 1)
    assert(b.master.master.life == two && b.master.silent)
  }

  "SRV-11: masters that are not on the list, or at another address" should "be refused and counted" in {
    val list = Options(masters = Map(1 -> here.getAddress))
    bench(list) { b =>
      b.report(one, 0, 1, address(2, 5000))
      b.report(Life(2, 10), 0, 1)
      assert(b.refused(Refusal.Foreign) == 2 && b.sent.isEmpty && b.supervisor.picture.masters.isEmpty)
      b.report(one, 0, 1)
      assert(b.numbers(one) == Seq(0))
    }
  }

  "SRV-11: more masters than there may be" should "be refused, unless a silent one can go" in bench() { b =>
    for (id <- 1 to Supervisor.MostMasters) b.report(Life(id, 1), 0, 1)
    b.report(Life(100, 1), 0, 1)
    assert(b.refused(Refusal.Foreign) == 1)
    b.clock += 4000
    for (id <- 2 to Supervisor.MostMasters) b.report(Life(id, 1), 1, 1)
    b.clock += 4000
    b.supervisor.tick()
    b.report(Life(100, 1), 0, 1)
    assert(b.supervisor.picture.masters.map(_.master.life.master) == (2 to Supervisor.MostMasters) :+ 100)
    assert(b.numbers(Life(1, 1)) == Seq(0), "its log stays")
  }

  "SRV-11: what is no report, or too long for one" should "be counted and not answered" in bench() { b =>
    b.give(Array.empty, here)
    b.give(Protocol.acknowledgement(one, 0), here)
    b.give(new Array[Byte](Protocol.MostReportBytes), here)
    b.give(new Array[Byte](Protocol.MostReportBytes + 1), here)
    assert(b.refused(Refusal.Malformed) == 3 && b.refused(Refusal.Oversized) == 1)
    assert(b.sent.isEmpty && b.changes == 4)
  }

  "SRV-13: a command" should "be sent again, the same bytes, until the master has answered" in bench() { b =>
    b.report(one, 0, 1)
    assert(b.supervisor.order(1, ServerDatagram.AlarmClear, ServerDatagram.AllNodes).isRight)
    b.sent.remove(0)
    b.supervisor.tick()
    assert(b.sent.size == 1 && b.sent.head._2 == here)
    assert(
      Protocol
        .command(b.sent.head._1, key)
        .contains(Command(one, 1, ServerDatagram.AlarmClear, ServerDatagram.AllNodes))
    )
    for (_ <- 1 to 3) { b.clock += 500; b.supervisor.tick(); b.supervisor.tick() }
    assert(b.sent.size == 4 && b.sent.map(_._1.toSeq).distinct.size == 1)
    assert(b.master.json("orders")(0)("state").str == "sent")
    val told = Event(EventKind.Command, ServerDatagram.AlarmClear, ServerDatagram.AllNodes, sequence = 1)
    b.give(Protocol.encode(Report(one, 1, Vector(told), time = b.tick())), here)
    assert(b.master.json("orders")(0)("state").str == "done")
    b.clock += 5000
    b.supervisor.tick()
    assert(b.sent.size == 5, "and one acknowledgement")
  }

  it should "be sent to where the last report came from, and wait for those before it" in bench() { b =>
    b.report(one, 0, 1)
    b.supervisor.order(1, ServerDatagram.AlarmClear, ServerDatagram.AllNodes)
    b.supervisor.order(1, ServerDatagram.DetectorReset, 7)
    assert(b.master.json("orders").arr.map(_("state").str) == Seq("sent", "waiting"))
    b.clock += 6000
    b.report(one, 1, 0, there)
    b.supervisor.tick()
    assert(b.sent.last._2 == there)
    val told =
      Event(EventKind.Command, ServerDatagram.AlarmClear, ServerDatagram.AllNodes, sequence = 1, state = 2)
    b.give(Protocol.encode(Report(one, 1, Vector(told), time = b.tick())), there)
    b.supervisor.tick()
    assert(b.master.json("orders").arr.map(_("state").str) == Seq("failed", "sent"))
    assert(b.master.json("orders")(0)("reason").str == "no answer from the line")
    assert(Protocol.command(b.sent.last._1, key).contains(Command(one, 2, ServerDatagram.DetectorReset, 7)))
  }

  "SRV-14: a command without an answer" should "have failed after its tries; a late answer counts" in
    bench(Options(commandTries = 3, commandIntervalMs = 100)) { b =>
      b.report(one, 0, 1)
      b.supervisor.order(1, ServerDatagram.AlarmClear, ServerDatagram.AllNodes)
      for (_ <- 1 to 10) { b.clock += 100; b.supervisor.tick() }
      assert(b.sent.size == 1 + 3 && b.master.json("orders")(0)("state").str == "failed")
      val told = Event(EventKind.Command, ServerDatagram.AlarmClear, ServerDatagram.AllNodes, sequence = 1)
      b.give(Protocol.encode(Report(one, 1, Vector(told), time = b.tick())), here)
      assert(b.master.json("orders")(0)("state").str == "done")
    }

  it should "have failed when the master has restarted; the next one counts from 1" in bench() { b =>
    b.report(one, 0, 1)
    b.supervisor.order(1, ServerDatagram.AlarmClear, ServerDatagram.AllNodes)
    b.clock += 2000
    b.report(two, 0, 1)
    assert(b.master.json("orders")(0)("reason").str == "the master has restarted")
    b.supervisor.order(1, ServerDatagram.DetectorReset, 3)
    assert(Protocol.command(b.sent.last._1, key).contains(Command(two, 1, ServerDatagram.DetectorReset, 3)))
  }

  it should "not be taken without key, for a master unknown or silent, or behind too many" in {
    def why(b: Bench, master: Int = 1) =
      b.supervisor.order(master, ServerDatagram.AlarmClear, ServerDatagram.AllNodes).left.getOrElse("")
    bench(withKey = false) { b =>
      b.report(one, 0, 1)
      assert(why(b).contains("without a key") && !b.supervisor.picture.commands)
    }
    bench() { b =>
      b.report(one, 0, 1)
      assert(why(b, 2) == "There is no master 2.")
      assert(Seq.fill(9)(why(b)) == Seq.fill(8)("") :+ "Too many commands are waiting.")
      b.clock += 6000
      assert(why(b) == "Master 1 is silent.")
    }
  }

  it should "never use a counter again, not even after a restart of the server" in Directory { d =>
    for (counter <- 1 to 3) {
      val b = new Bench(d.resolve("log.db"), Options())
      try {
        b.report(one, 0, 0, time = 1000 * counter)
        b.supervisor.order(1, ServerDatagram.AlarmClear, ServerDatagram.AllNodes)
        assert(Protocol.command(b.sent.last._1, key).map(_.counter).contains(counter.toLong))
      } finally b.close()
    }
  }

  "SRV-15: a silent master" should "show its detectors as unknown, with what they told before" in bench() {
    b =>
      val events = Vector(
        Event(EventKind.Present, 0, 1, state = 1),
        Event(EventKind.Present, 1, 2, state = 1),
        Event(EventKind.Detector, 1, 2, 1, DetectorState.Alarm)
      )
      b.give(Protocol.encode(Report(one, 0, events, time = 9)), here)
      def shown = b.master.json("slaves").arr.map(s => (s("label").str, s("state").str))
      assert(shown == Seq("1A" -> "unknown", "1B" -> "alarm"))
      val changes = b.changes
      b.clock += 5001
      b.supervisor.tick()
      assert(b.changes == changes + 1, "pages are told")
      assert(shown == Seq("1A" -> "unknown", "1B" -> "unknown"))
      assert(b.master.json("slaves")(1)("notes").arr.map(_.str).contains("before: alarm"))
      assert(b.master.json("alarms").arr.map(_.str) == Seq("1B"))
  }

  "SRV-15: states" should "be normal, alarm, fault, lost and unknown, and an alarm hide a fault" in bench() {
    b =>
      val slaves = Vector.tabulate(8)(i => Event(EventKind.Present, i, i + 1, state = if (i == 5) 3 else 1))
      def told(position: Int, state: Int) = Event(EventKind.Detector, position, position + 1, 1, state)
      val events = slaves ++ Vector(
        told(0, DetectorState.Normal),
        told(1, DetectorState.Alarm),
        told(2, DetectorState.Open),
        told(3, DetectorState.Short),
        told(4, DetectorState.Off),
        told(5, DetectorState.Normal),
        Event(EventKind.Lost, 7, 8)
      )
      b.give(Protocol.encode(Report(one, 0, events, time = 9)), here)
      def shown = b.master.json("slaves").arr.map(s => s("state").str + ": " + s("text").str)
      assert(
        shown == Seq(
          "normal: normal",
          "alarm: alarm",
          "fault: line open",
          "fault: line short",
          "unknown: off",
          "fault: self-test failed (3)",
          "unknown: nothing told yet",
          "lost: lost"
        )
      )
      assert(b.master.json("cut").num == 7)
      b.give(
        Protocol.encode(Report(one, events.size.toLong, Vector(told(5, DetectorState.Alarm)), time = 10)),
        here
      )
      assert(shown(5) == "alarm: alarm")
  }
}

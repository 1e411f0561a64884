package flyframe.server

import java.time.Instant
import org.scalatest.flatspec.AnyFlatSpec
import flyframe.protocol.{CommandResult, DetectorState, EventKind, MasterStatus, Order, SelfTest, SlaveStatus}

/** What a line is after a report, and how it is shown. */
class LineStateSpec extends AnyFlatSpec {
  import SlaveStatus._
  private val start            = Instant.parse("2026-01-02T03:04:05Z")
  private def at(seconds: Int) = start.plusSeconds(seconds.toLong)
  private val life             = Life(1, 7)
  private val Second           = 1000000L
  private def report(seconds: Int, slaves: Seq[Reported], events: Event*) = Report(
    life,
    1,
    1,
    0,
    events.toVector,
    slaves.toVector,
    seconds * Second,
    ModelMaster.statusOf(slaves),
    present = slaves.count(!_.has(Absent))
  )
  private def line(reports: Report*): LineState =
    reports.foldLeft(LineState())((l, r) => l.after(r, at((r.time / Second).toInt)))
  private def alarm(position: Int, seconds: Int) =
    Event(EventKind.Detector, position, position + 1, 1, DetectorState.Alarm, masterTime = seconds * Second)

  private def seen(l: LineState, expected: Expected = Expected(), silent: Boolean = false) =
    Picture.Seen(Master(1, Some(life), l), expected, silent, false, Nil, Map.empty).json
  private def states(l: LineState, expected: Expected = Expected(), silent: Boolean = false) =
    seen(l, expected, silent)("slaves").arr.map(_("state").str).toSeq
  private def texts(l: LineState, expected: Expected = Expected()) =
    seen(l, expected)("slaves").arr.map(_("text").str).toSeq
  private def notices(l: LineState, expected: Expected = Expected()) =
    seen(l, expected)("notices").arr.map(_.str).toSeq
  private def wrong(l: LineState, expected: Expected) =
    seen(l, expected)("slaves").arr.map(_("wrong").arr.map(_.str).mkString("; ")).toSeq

  "SRV-09: the picture" should "be that of the last report, whatever events say" in {
    val calm = ModelMaster.line(0, 0, 0)
    assert(states(line(report(1, calm, alarm(1, 1)))) == Seq.fill(3)("normal"))
    val burns = ModelMaster.line(0, Alarm | Latched | Sounding, 0)
    assert(states(line(report(1, burns))) == Seq("normal", "alarm", "normal"))
    assert(states(line(report(1, burns), report(2, calm))) == Seq.fill(3)("normal"))
    assert(states(line(report(1, calm), report(2, calm.take(1)))) == Seq("normal"))
  }

  "SRV-09: every bit of a slave's status" should "be shown, alarms before faults before modes" in {
    val shown = Seq(
      0                     -> "normal: normal",
      Alarm                 -> "alarm: alarm",
      (Alarm | Latched)     -> "alarm: alarm",
      Latched               -> "alarm: alarm, smoke is gone",
      (Latched | Open)      -> "alarm: alarm, smoke is gone",
      Sounding              -> "normal: normal",
      Open                  -> "fault: line open",
      Short                 -> "fault: line short",
      Unwatched             -> "fault: not watched",
      HostDead              -> "fault: host dead",
      Disabled              -> "off: disabled",
      (Disabled | HostDead) -> "fault: host dead",
      Testing               -> "test: testing",
      (Testing | TestAlarm) -> "test: test alarm",
      Waiting               -> "normal: normal",
      Dropped               -> "fault: records dropped",
      Unwell                -> "fault: self-test not good",
      Configuration         -> "fault: FPGA configuration damaged",
      Wrong                 -> "fault: wrong slave",
      Absent                -> "lost: lost",
      (Absent | Wrong)      -> "lost: lost"
    )
    val json = seen(line(report(1, ModelMaster.line(shown.map(_._1): _*))))("slaves").arr
    assert(json.map(s => s("state").str + ": " + s("text").str) == shown.map(_._2))
    def notes(i: Int) = json(i)("notes").arr.map(_.str).toSeq
    assert(notes(4) == Seq("line open") && notes(5) == Seq("sounding") && notes(11) == Seq("disabled"))
    assert(notes(14) == Seq("records wait") && notes(20) == Seq("wrong slave"))
    for (bit <- (0 to 15).map(1 << _)) assert(EventText.slave(bit).nonEmpty, f"$bit%04x")
  }

  it should "say more where an event has told more" in {
    val event = Event(EventKind.Slave, 0, 1, Unwell | Dropped, state = 6, slaveTime = 3 << 8 | 0xf)
    val l     = line(report(1, ModelMaster.line(Unwell | Dropped), event))
    val notes = seen(l)("slaves")(0)("notes").arr.map(_.str)
    assert(notes.contains("self-test failed (6)") && notes.contains("3 dropped"))
    def told(status: Int, epoch: Int) = Event(EventKind.Slave, 0, 1, status, 1, epoch)
    def lost(events: Event*) =
      seen(line(report(1, ModelMaster.line(0), events: _*)))("slaves")(0)("notes").arr
        .map(_.str)
        .contains("records lost while it was absent")
    assert(
      lost(told(Absent | Waiting, 1), told(0, 2)) && lost(
        told(Absent | Waiting, 1),
        told(0, 2),
        told(Open, 2)
      )
    )
    assert(!lost(told(Absent | Waiting, 1), told(0, 1)) && !lost(told(Absent, 1), told(0, 2)))
    assert(!lost(told(Waiting, 1), told(0, 2)))
    val other = l.after(report(2, Seq(Reported(Unwell, 9))), at(2))
    assert(
      !seen(other)("slaves")(0)("notes").arr.map(_.str).contains("self-test failed (6)"),
      "another slave"
    )
  }

  "SRV-09: every bit of a master's status" should "be a notice if it is a fault, else a sign" in {
    for (bit <- (0 until MasterStatus.Width).map(1 << _)) {
      val isFault = (MasterStatus.Faults & bit) != 0
      val calm    = LineState(Vector(Reported(0, 1)), status = bit)
      val before  = notices(LineState(Vector(Reported(0, 1)))).size
      assert(seen(calm)("signs").arr.isEmpty == isFault, f"$bit%05x")
      if (isFault) assert(notices(calm).size == before + 1, f"$bit%05x")
    }
    assert(notices(LineState(selfTest = 13)).exists(_.contains("failed (13)")))
    assert(notices(LineState(selfTest = SelfTest.NotRun)).exists(_.contains("not run")))
    assert(notices(LineState(present = 3)).exists(_.startsWith("3 slaves more than this master lists")))
  }

  "SRV-09: the cut" should "be where the master says, or before the slaves at the end that are absent" in {
    def cut(l: LineState) = seen(l)("cut")
    assert(cut(line(report(1, ModelMaster.line(0, Absent, Absent)))).num == 1)
    assert(cut(line(report(1, ModelMaster.line(0, Absent, 0)))).isNull)
    assert(cut(line(report(1, ModelMaster.line(0, 0)))).isNull)
    val ring = report(1, ModelMaster.line(0, 0, 0)).copy(status = MasterStatus.RingOpen, cut = 2)
    assert(cut(line(ring)).num == 2)
  }

  "SRV-23: a fire" should "begin with its alarm record, also of a report that comes late" in {
    val (calm, burns) = (ModelMaster.line(0, 0), ModelMaster.line(0, Alarm | Latched))
    assert(line(report(10, burns)).fires == Map(1 -> at(10)), "without a record")
    assert(line(report(10, burns, alarm(1, 8))).fires == Map(1 -> at(8)))
    assert(line(report(10, calm, alarm(1, 8)), report(11, burns)).fires == Map(1 -> at(8)), "record first")
    assert(line(report(10, calm, alarm(1, 8)), report(60, burns)).fires == Map(1 -> at(60)), "an old record")
    assert(line(report(900, burns, alarm(1, 100), alarm(1, 200))).fires == Map(1 -> at(100)))
    val again = line(
      report(1, burns, alarm(1, 1)),
      report(50, ModelMaster.line(0, Latched)),
      report(60, burns, alarm(1, 60))
    )
    assert(again.fires == Map(1 -> at(1)), "until it is reset")
    assert(
      line(report(1, burns), report(2, calm)).fires.isEmpty && !line(
        report(1, burns),
        report(2, calm)
      ).isBurning
    )
  }

  it should "stay when its slave is absent, until the master's fire is over" in {
    val burns  = report(1, ModelMaster.line(0, Alarm))
    val gone   = report(2, ModelMaster.line(0, Absent))
    val on     = gone.copy(status = MasterStatus.Fire)
    val behind = on.copy(slaves = on.slaves.take(1))
    val kept   = report(2, ModelMaster.line(0, Absent | Latched)).copy(status = MasterStatus.Fire)
    for (r <- Seq(on, behind, kept)) {
      assert(line(burns, r).fires == Map(1 -> at(1)))
      assert(line(burns, r, gone).fires.isEmpty)
    }
    assert(states(line(burns, on)) == Seq("normal", "alarm"))
    assert(texts(line(burns, on)) == Seq("normal", "alarm, then lost"))
    assert(texts(line(burns, kept)) == Seq("normal", "alarm, smoke is gone, then lost"))
  }

  it should "begin no later for a new life of the master" in {
    val burns = line(report(5, ModelMaster.line(0, Alarm)))
    val empty = burns.renewed.after(report(1, Nil), at(100))
    assert(!empty.isBurning)
    val found = empty.after(report(2, ModelMaster.line(0, Latched), alarm(1, 2)), at(101))
    assert(found.fires == Map(1 -> at(5)))
    assert(empty.after(report(100, ModelMaster.line(0, Latched)), at(200)).fires == Map(1 -> at(200)))
  }

  it should "be told with place, zone and time, the first alarm first; also when no slave tells it" in {
    val list = Expected(Map(1 -> Vector(ExpectedSlave(1, "K1", "Kitchen"), ExpectedSlave(2, "H1", "Hall"))))
    val l = line(report(1, ModelMaster.line(0, Alarm)), report(3, ModelMaster.line(Alarm | Latched, Latched)))
    val fire = seen(l, list)("fire")
    assert(
      fire("at").arr.map(f =>
        (f("label").str, f("zone").str, f("node").num, f("since").str, f("smoke").bool)
      ) ==
        Seq(("H1", "Hall", 2.0, at(1).toString, false), ("K1", "Kitchen", 1.0, at(3).toString, true))
    )
    assert(seen(l, list)("alarms").arr.map(_.str) == Seq("H1", "K1"))
    val unknown = LineState(Vector(Reported(0, 1)), status = MasterStatus.Fire)
    assert(seen(unknown)("fire")("at").arr.isEmpty && notices(unknown).exists(_.contains("no slave does")))
    assert(seen(line(report(1, ModelMaster.line(0))))("fire").isNull)
  }

  "SRV-15: a silent master" should "keep fire and faults, and what was normal be unknown" in {
    val l = line(report(1, ModelMaster.line(0, Alarm, Open, Absent, Disabled, Testing)))
    assert(states(l, silent = true) == Seq("unknown", "alarm", "fault", "lost", "off", "test"))
    val first = seen(l, silent = true)("slaves")(0)
    assert(first("notes").arr.map(_.str).contains("before: normal"))
    assert(seen(l, silent = true)("fire")("at").arr.size == 1)
  }

  private val list = Expected(Map(1 -> Vector.tabulate(3)(i => ExpectedSlave(i + 1, s"D${i + 1}", ""))))
  private def nodes(ids: Int*) = line(report(1, ids.map(Reported(0, _))))

  "SRV-20: a line as it is to be" should "have no fault" in {
    assert(wrong(nodes(1, 2, 3), list) == Seq("", "", "") && notices(nodes(1, 2, 3), list).isEmpty)
    assert(states(nodes(1, 2, 3), list) == Seq.fill(3)("normal"))
  }

  "SRV-20: slaves that are missing, extra, swapped or doubled" should "be faults" in {
    assert(wrong(nodes(1, 2), list) == Seq("", "", "ID 3 is missing"))
    assert(states(nodes(1, 2), list) == Seq("normal", "normal", "lost"))
    val absent = line(report(1, Seq(Reported(0, 1), Reported(Absent, 2), Reported(0, 3))))
    assert(wrong(absent, list) == Seq("", "ID 2 is missing", ""))
    assert(wrong(nodes(1, 2, 3, 9), list).last == "no slave is expected here, but ID 9 is")
    assert(states(nodes(1, 2, 3, 9), list).last == "fault")
    assert(
      wrong(nodes(1, 3, 2), list) == Seq(
        "",
        "ID 2 is expected, it is at D3; here is ID 3, which belongs to D3",
        "ID 3 is expected, it is at D2; here is ID 2, which belongs to D2"
      )
    )
    assert(wrong(nodes(1, 9, 3), list)(1) == "ID 2 is expected; here is ID 9, an unknown slave")
    assert(
      wrong(nodes(1, 1, 3), list) == Seq(
        "same ID as D2",
        "ID 2 is expected; here is ID 1, which belongs to D1; same ID as D1",
        ""
      )
    )
    for (ids <- Seq(Seq(1, 2), Seq(1, 3, 2), Seq(1, 1, 3), Seq(1, 2, 3, 9), Nil)) {
      val l = nodes(ids: _*)
      assert(notices(l, list).exists(_.startsWith("Not as it is to be")), ids)
      assert(notices(l.after(report(2, ids.map(Reported(0, _))), at(2)), list).nonEmpty, "it stays")
      assert(
        notices(l.after(report(3, (1 to 3).map(Reported(0, _))), at(3)), list).isEmpty,
        "until it is right"
      )
    }
  }

  "SRV-20: without a list" should "doubles be faults all the same, and the page say that there is none" in {
    val l = nodes(1, 2, 1)
    assert(wrong(l, Expected()) == Seq("same ID as 2A", "", "same ID as 1A"))
    assert(states(l) == Seq("fault", "normal", "fault") && texts(l).head == "same ID as 2A")
    assert(notices(l).exists(_.startsWith("There is no list")))
    val gone = line(report(1, Seq(Reported(0, 1), Reported(Absent, 1))))
    assert(wrong(gone, Expected()) == Seq("", ""), "one that is gone is no double")
  }

  "SRV-20: an ordinary slave" should "be no alarm slave, and belong where the list says so" in {
    val l = nodes(1, 0, 0, 2)
    assert(states(l) == Seq("normal", "unknown", "unknown", "normal") && texts(l)(1) == "no alarm slave")
    assert(wrong(l, Expected()) == Seq.fill(4)(""), "no doubles")
    def expected(ids: Int*) =
      Expected(Map(1 -> ids.zipWithIndex.map { case (n, i) => ExpectedSlave(n, s"D$i", "") }.toVector))
    assert(wrong(l, expected(1, 0, 0, 2)) == Seq.fill(4)(""))
    assert(
      wrong(l, expected(1, 2)) == Seq(
        "",
        "ID 2 is expected, it is at 2B; here is an ordinary slave",
        "no slave is expected here, but an ordinary slave is",
        "no slave is expected here, but ID 2 is"
      )
    )
    assert(
      wrong(nodes(1, 5), expected(1, 0))(1) == "an ordinary slave is expected; here is ID 5, an unknown slave"
    )
    val hostless = line(report(1, Seq.fill(2)(Reported(HostDead | Unwell, 0))))
    assert(wrong(hostless, Expected()) == Seq("same ID as 1B", "same ID as 1A"), "no ID has been set")
  }

  "SRV-08: a line from the log" should "be as its last events tell" in {
    def slave(position: Int, status: Int) = Event(EventKind.Slave, position, position + 1, status, state = 3)
    val master = Event(EventKind.Line, 3, 1, sequence = 0x0005, epoch = 1, slaveTime = 8)
    val l      = LineState.fromLog(Seq(slave(0, Unwell), slave(2, Alarm), master), Map(2 -> at(1)), at(9))
    assert(l.slaves == Vector(Reported(Unwell, 1), Reported(Absent, 0), Reported(Alarm, 3)))
    assert(l.status == 0x10005 && (l.present, l.cut, l.lost) == (3, 1, 8L) && l.fires == Map(2 -> at(1)))
    assert(l.details(0) == Detail(1, 3, 0, 0, Unwell))
    assert(LineState.fromLog(Nil, Map.empty, at(9)) == LineState())
    assert(LineState.fromLog(Seq(slave(0, Latched)), Map.empty, at(9)).fires == Map(0 -> at(9)))
  }

  "SRV-09, LM-08: every kind of event" should "have a text" in {
    val texts = (1 to 5).map(kind => EventText.text(Event(kind, 1, 2, 3, 1)))
    assert(texts.distinct.size == 5 && texts.forall(_.nonEmpty))
    assert(EventText.text(alarm(3, 1)) == "alarm" && EventText.severity(alarm(3, 1)) == "alarm")
    val test = alarm(3, 1).copy(state = DetectorState.Alarm | DetectorState.Test)
    assert(EventText.text(test) == "test: alarm" && EventText.severity(test) == "info")
    def slave(status: Int) = Event(EventKind.Slave, 1, 2, status)
    assert(EventText.text(slave(Alarm | Sounding | Open)) == "slave: alarm, line open, sounding")
    assert(
      Seq(0, Alarm, Open, Absent, Testing).map(s => EventText.severity(slave(s))) ==
        Seq("info", "alarm", "fault", "fault", "info")
    )
    assert(EventText.text(slave(0)) == "slave: all well")
    assert(
      EventText.text(Event(EventKind.Line, 5, 0, 0x0001, 0, 1)) ==
        "master: fire, The master has no list of its slaves: it cannot miss any, slaves that answer: 5"
    )
    def command(order: Int, node: Int, result: Int) =
      EventText.text(Event(EventKind.Command, order, node, 1, result))
    assert(command(Order.Silence, 0xffff, CommandResult.Done) == "silence: done")
    assert(command(Order.Disable, 7, CommandResult.NoSuchNode) == "disable ID 7: no such ID")
    assert(EventText.node(Event(EventKind.Command, 1, 0xffff)).isEmpty)
    for (order <- 1 to 6) assert(!EventText.order(order, 1).startsWith("order"))
  }
}

package flyframe.rules

import flyframe.model.{Datagram, EtherCatFrame, Fcs, SentFrame, WireFrame}
import flyframe.params.EscParams
import flyframe.protocol.Command._
import flyframe.protocol.DetectorState.{Alarm, Normal, Open, Short, Test}
import flyframe.protocol.{DetectorMode, SlaveStatus}
import flyframe.registers.AlarmRegisters

/** The smoke detector, its state, and its records in passing frames: ALARM, DET, AP (docs/rules/alarm.md). */
object AlarmRules extends Rules {
  private def some(p: EscParams) = p.hasAlarm
  private val Status             = 0x0ea8
  private val Node               = 0x0a

  /** With a debounce of 20 us, at a master that expects records; the first one is that of a normal line. */
  private def start(s: Steps): Unit = {
    confirm(s, 0, life = 0)
    startUnconfirmed(s)
  }
  private def startUnconfirmed(s: Steps): Unit = {
    import s._
    hostPut(0x0012, Node)
    hostPut(0x0ea5, 0x77)
    hostPut(0x0ea0, 2, 0)
    become(s, Normal)
  }
  private def become(s: Steps, state: Int): Unit = {
    s.bench.setLine(state)
    s.bench.advanceUs(60)
  }

  /** Bits of the status word, of those that the host does not cause. */
  private def status(s: Steps): Int = s.word(Status) & ~(SlaveStatus.HostDead | SlaveStatus.Unwell)
  private def kind(s: Steps): Int   = status(s) & ~SlaveStatus.Waiting

  /** The alarm record in a datagram. */
  private case class Record(sequence: Int, state: Int, epoch: Int, time: Seq[Int], index: Int) {
    def acknowledgement(tag: Int): Datagram =
      Datagram(
        Apwr,
        0,
        AlarmRegisters.Acknowledge,
        EtherCatFrame.little(sequence) ++ time.take(2) ++ EtherCatFrame.little(tag & 0xffff)
      )
    def is(sequence: Int, state: Int): Boolean = this.sequence == sequence && this.state == state
  }
  private def record(reply: Reply): Record = {
    assert(reply.command == Nop && reply.adp == Node && reply.ado == Status && reply.length == 12)
    assert(reply.workingCounter == 1 && reply.irq == 0)
    val d = reply.data
    Record(d(0) | d(1) << 8, d(2), d(3), d.drop(4), reply.index)
  }

  /** What a frame with one datagram brings. */
  private def collect(s: Steps): Option[Record] = {
    val bytes = s.good(s.send(EtherCatFrame(Nil)))
    if ((bytes(14) | (bytes(15) & 7) << 8) == 0) None else Some(record(s.replies(bytes).head))
  }
  private def acknowledge(s: Steps, r: Record, tag: Int): Unit =
    assert(s.exchange(r.acknowledgement(tag)).head.workingCounter == 1)

  private def confirm(s: Steps, number: Int, life: Int = 7): Unit = assert(
    s.write(Bwr, 0, AlarmRegisters.Confirm, number & 0xff, number >> 8 & 0xff, life, 0).workingCounter == 1
  )

  /** Takes and acknowledges all that is on offer, with tags from `tag` on. */
  private def drain(s: Steps, tag: Int = 0): Seq[Record] = {
    var records = Vector.empty[Record]
    // No longer than needed: time passes meanwhile, which the model knows nothing of.
    def waits = (status(s) & SlaveStatus.Waiting) != 0
    var left  = 400
    while (left > 0 && waits) {
      for (r <- collect(s)) {
        acknowledge(s, r, tag + records.size)
        records :+= r
      }
      left -= 1
    }
    assert(left > 0)
    records
  }
  private def drained(s: Steps, tag: Int = 0): Seq[(Int, Int)] = drain(s, tag).map(r => r.sequence -> r.state)

  rule("DET-01, DET-02, DET-07, ALARM-09: it watches and reports from the reset on, without a host", some) {
    s =>
      import s._
      assert(hostGet(0x0ea0, 7) == Seq(0xe8, 3, 0xd0, 7, 0, 0, 1))
      assert(status(s) == 0, "supplied, enabled, nothing to say yet")
      start(s)
      assert(collect(s).get.is(1, Normal) && status(s) == SlaveStatus.Waiting)
      bench.hostWrite(0x0ea6, 0)
      bench.advanceUs(60)
      assert(kind(s) == SlaveStatus.Unwatched)
      bench.hostWrite(0x0ea6, 1)
      bench.advanceUs(60)
      assert(kind(s) == 0)
  }
  rule("DET-03: a state counts when it has lasted for the debounce time", some) { s =>
    import s._
    start(s)
    bench.hostWrite(0x0ea0, 20) // 200 us
    bench.advanceUs(300)
    bench.setLine(Alarm)
    bench.advanceUs(150)
    assert(kind(s) == 0)
    bench.setLine(Normal)
    bench.advanceUs(300)
    bench.setLine(Alarm)
    bench.advanceUs(150)
    assert(kind(s) == 0, "it has been interrupted")
    bench.advanceUs(100)
    assert((kind(s) & SlaveStatus.Alarm) != 0)
  }
  rule("DET-03: a line that does not come to rest is an alarm, or open if it was never above normal", some) {
    s =>
      import s._
      for ((one, other, state) <- Seq((Alarm, Normal, Alarm), (Short, Alarm, Alarm), (Open, Normal, Open))) {
        bench.reset()
        start(s)
        bench.hostWrite(0x0ea0, 20)
        bench.advanceUs(300)
        for (i <- 1 to 40) {
          bench.setLine(if (i % 2 == 0) other else one)
          bench.advanceUs(9)
        }
        assert(drained(s).sorted == Seq(1 -> Normal, 2 -> state), s"$one, $other")
      }
  }
  rule("DET-04, ALARM-06: a restart takes the supply away for the off time; lamp and sounder end", some) {
    s =>
      import s._
      start(s)
      become(s, Alarm)
      hostPut(0x0ea2, 1, 0)
      assert(put(0x0e8c, 2))
      assert(kind(s) == SlaveStatus.Unwatched && bench.hostRead(0x0e8c) == 0)
      bench.setLine(Normal)
      bench.advanceUs(700)
      assert(kind(s) == SlaveStatus.Unwatched)
      bench.advanceUs(1500)
      assert(kind(s) == 0)
      assert(drained(s).toSet == Set(1 -> Normal, 2 -> Alarm, 3 -> Normal))
  }
  rule("DET-05, ALARM-02: each change is a record; what is there behind a restart is a new one", some) { s =>
    import s._
    start(s)
    hostPut(0x0ea2, 0, 0)
    for (state <- Seq(Open, Short, Alarm, Normal)) become(s, state)
    val records = drain(s)
    assert(
      records.map(r => r.sequence -> r.state) ==
        Seq(4 -> Alarm, 1 -> Normal, 2 -> Open, 3 -> Short, 5 -> Normal)
    )
    assert(records.forall(_.epoch == 0x77) && records.map(_.time).distinct.size == 5)
    become(s, Alarm)
    assert(drained(s) == Seq(6 -> Alarm))
    bench.hostWrite(0x0e8c, 2)
    bench.advanceUs(1200)
    assert(drained(s) == Seq(7 -> Alarm), "no record of no supply")
    assert((kind(s) & SlaveStatus.Sounding) != 0)
  }
  rule("DET-06: a disabled detector says nothing; then its state counts anew", some) { s =>
    import s._
    start(s)
    assert(put(0x0eb2, 10, 0) && put(0x0eb0, DetectorMode.Disable))
    for (state <- Seq(Alarm, Open, Short, Alarm)) {
      become(s, state)
      assert(kind(s) == SlaveStatus.Disabled)
    }
    assert(get(0x0eb0, 1).contains(Seq(DetectorMode.Disable)) && drained(s) == Seq(1 -> Normal))
    bench.hostWrite(0x0eb0, DetectorMode.Watch)
    bench.advanceUs(60)
    assert(kind(s) == (SlaveStatus.Alarm | SlaveStatus.Latched | SlaveStatus.Sounding))
    assert(drained(s) == Seq(2 -> Alarm))
  }
  rule("DET-06: a detector that is tested reports tests, no alarm; then its state counts anew", some) { s =>
    import s._
    start(s)
    assert(put(0x0eb2, 10, 0) && put(0x0eb0, DetectorMode.Test))
    bench.advanceUs(60)
    become(s, Alarm)
    assert(kind(s) == (SlaveStatus.Testing | SlaveStatus.TestAlarm))
    become(s, Open)
    assert(kind(s) == (SlaveStatus.Testing | SlaveStatus.Open))
    become(s, Alarm)
    val tests = Seq(2 -> Normal, 3 -> Alarm, 4 -> Open, 5 -> Alarm).map { case (n, state) =>
      n -> (state | Test)
    }
    assert(drained(s) == (1 -> Normal) +: tests)
    assert(put(0x0eb0, DetectorMode.Watch))
    bench.advanceUs(60)
    assert(kind(s) == (SlaveStatus.Alarm | SlaveStatus.Latched | SlaveStatus.Sounding))
    assert(drained(s) == Seq(6 -> Alarm))
  }
  rule("ALARM-03, AP-02, AP-05: a frame takes the oldest alarm, then the oldest other record", some) { s =>
    start(s)
    for (state <- Seq(Open, Alarm, Normal, Alarm)) become(s, state)
    for (_     <- 1 to 5) assert(collect(s).get.is(3, Alarm))
    val first = collect(s).get
    val came  = s.exchange(first.acknowledgement(9))
    if (s.p.maxSubTelegrams > 1) assert(record(came(1)).is(3, Alarm), "this frame still has it")
    assert(collect(s).get.is(5, Alarm))
    assert(drained(s) == Seq(5 -> Alarm, 1 -> Normal, 2 -> Open, 4 -> Normal))
  }
  rule("AP-10, ALARM-03: the index is the position that the first datagram has counted", some) { s =>
    import s._
    start(s)
    become(s, Alarm)
    assert(collect(s).get.index == 0, "no datagram counts")
    if (p.maxSubTelegrams > 2) for (before <- Seq(0, 5, 0xfe, 0xff, 0x1ff)) {
      val came = exchange(Datagram(Brd, before, 0, Seq(0)), Datagram(Brd, 7, 0, Seq(0)))
      assert(record(came(2)).index == ((before + 1) & 0xff))
    }
  }
  rule("ALARM-04: number and time acknowledge a record; anything else, or a bad frame, does not", some) { s =>
    import s._
    start(s)
    val Some(r) = collect(s)
    exchange(r.copy(sequence = 2).acknowledgement(0))
    exchange(r.copy(sequence = 0x101).acknowledgement(0))
    exchange(r.copy(time = r.time.map(_ ^ 0x5a)).acknowledgement(0))
    spoiled(r.acknowledgement(0))
    assert(status(s) == SlaveStatus.Waiting)
    acknowledge(s, r, 0)
    assert(status(s) == 0 && collect(s).isEmpty)
  }
  rule("ALARM-04: a master of another life hears again what is not confirmed", some) { s =>
    start(s)
    become(s, Alarm)
    become(s, Open)
    confirm(s, 0)
    assert(drained(s, tag = 0x20) == Seq(2 -> Alarm, 1 -> Normal, 3 -> Open))
    confirm(s, 0x21)
    assert(collect(s).isEmpty)
    confirm(s, 0xffff, life = 8)
    assert(drained(s, tag = 0x8000) == Seq(1 -> Normal, 3 -> Open), "and nothing was confirmed by that")
    confirm(s, 0x8001, life = 8)
    confirm(s, 0x8001, life = 9)
    assert(drained(s) == Seq(3 -> Open))
  }
  rule("ALARM-04: the server has all but what is less than 256 ahead of its number", some) { s =>
    start(s)
    confirm(s, 0)
    become(s, Alarm)
    drain(s, tag = 0xfff0) // the alarm; then what was before
    for (number <- Seq(0xfff0, 0xfef2, 0xff80)) confirm(s, number)
    confirm(s, 0xfff1)
    confirm(s, 0xfff0)
    confirm(s, 1, life = 8)
    assert(drain(s, tag = 0x1000).map(_.sequence) == Seq(1), "only the alarm had gone")
    confirm(s, 0x0f00, life = 8)
    confirm(s, 1, life = 9)
    assert(drained(s) == Nil)
  }
  rule(
    "ALARM-04: a record may be acknowledged and confirmed in one frame, also in one that has it",
    p => some(p) && p.maxSubTelegrams > 2
  ) { s =>
    import s._
    start(s)
    become(s, Alarm)
    confirm(s, 0)
    val Some(r) = collect(s)
    val came    = exchange(r.acknowledgement(4), Datagram(Bwr, 0, AlarmRegisters.Confirm, Seq(5, 0, 7, 0)))
    assert(came.take(2).map(_.workingCounter) == Seq(1, 1) && record(came(2)) == r.copy(index = 1))
    confirm(s, 0, life = 8)
    assert(drained(s) == Seq(1 -> Normal), "it has gone")
  }
  rule("ALARM-05: a full queue takes every alarm, and says how many records were dropped", some) { s =>
    import s._
    start(s)
    for (i <- 1 to 15) become(s, if (i % 2 == 1) Open else Normal)
    assert((status(s) & SlaveStatus.Dropped) == 0 && hostGet(0x0eae, 1) == Seq(0))
    become(s, Alarm)
    assert((status(s) & SlaveStatus.Dropped) != 0 && hostGet(0x0eae, 1) == Seq(1))
    become(s, Short)
    assert(hostGet(0x0eae, 1) == Seq(2))
    assert(drained(s).map(_._1) == 17 +: (3 to 16) :+ 18)
    become(s, Open)
    become(s, Alarm)
    assert(hostGet(0x0eae, 1) == Seq(2), "those that the master has are not counted")
    assert(drained(s) == Seq(20 -> Alarm, 19 -> Open))
  }
  rule("ALARM-05: of 16 alarms one that the master has, or the newest, makes room for another", some) { s =>
    import s._
    start(s)
    hostPut(0x0ea2, 0, 0)
    def again(): Unit = {
      bench.hostWrite(0x0e8c, 2)
      bench.advanceUs(1200)
    }
    become(s, Alarm)
    for (_ <- 1 to 15) again()
    assert(hostGet(0x0eae, 1) == Seq(1), "the normal state from before")
    become(s, Normal)
    assert(hostGet(0x0eae, 1) == Seq(2))
    become(s, Alarm)
    assert(hostGet(0x0eae, 1) == Seq(3))
    assert(drained(s) == ((2 to 16) :+ 19).map(_ -> Alarm))
    again()
    assert(hostGet(0x0eae, 1) == Seq(4) && drained(s) == Seq(20 -> Alarm))
    confirm(s, 0, life = 8)
    assert(drained(s) == ((3 to 16) ++ Seq(19, 20)).map(_ -> Alarm), "the oldest that the master has")
    assert((status(s) & SlaveStatus.Dropped) != 0)
    confirm(s, 0x0100, life = 8)
    assert((status(s) & SlaveStatus.Dropped) == 0 && hostGet(0x0eae, 1) == Seq(4), "until all have gone")
  }
  rule("ALARM-06: an alarm switches lamp and sounder on, orders off", some) { s =>
    import s._
    val (lamp, sounder) = (SlaveStatus.Latched, SlaveStatus.Sounding)
    start(s)
    assert(kind(s) == 0)
    become(s, Alarm)
    assert(kind(s) == (SlaveStatus.Alarm | lamp | sounder))
    become(s, Normal)
    assert(kind(s) == (lamp | sounder), "until they are switched off")
    assert(write(Bwr, 0, 0x0e8c, 1).workingCounter == 1 && kind(s) == lamp)
    become(s, Alarm)
    assert(put(0x0e8c, 1) && kind(s) == (SlaveStatus.Alarm | lamp))
    become(s, Open)
    assert(kind(s) == (SlaveStatus.Open | lamp))
    become(s, Alarm)
    assert(kind(s) == (SlaveStatus.Alarm | lamp | sounder), "a new alarm sounds")
    become(s, Normal)
    assert(put(0x0e8c, 3))
    assert((kind(s) & (lamp | sounder)) == 0)
  }
  rule("ALARM-07: messages to all and to one interrupt the host until it has read of them", some) { s =>
    import s._
    assert(!bench.interrupt)
    assert(write(Bwr, 0, 0x0e90, 1, 2, 3, 4, 5, 6, 7, 8).workingCounter == 1)
    def acknowledges(messages: Int) = {
      val told = bench.interrupt && bench.hostRead(0x0e8d) == messages
      if (p.acknowledgesByWrite) {
        assert(bench.interrupt, "PDI-09")
        bench.hostWrite(0x0e8d, 0)
      }
      told && !bench.interrupt && bench.hostRead(0x0e8d) == 0
    }
    assert(acknowledges(1))
    assert(hostGet(0x0e90, 8) == (1 to 8))
    bench.hostWrite(0x0012, Node)
    assert(put(0x0103, 1))
    assert(write(Fpwr, Node, 0x0e98, 8, 7, 6, 5, 4, 3, 2, 1).workingCounter == 1)
    assert(acknowledges(2))
    assert(write(Fpwr, Node + 1, 0x0e98, 1, 1, 1, 1, 1, 1, 1, 1).workingCounter == 0)
    assert(hostGet(0x0e98, 8) == (1 to 8).reverse && !bench.interrupt)
    assert(put(0x0e90, 9) && !bench.interrupt, "not before the last byte")
  }
  rule("ALARM-08: what the host has said of this slave, the master can read", some) { s =>
    import s._
    hostPut(0x0ea4, 1, 2, 0)
    assert(get(0x0ea4, 3).contains(Seq(1, 2, 0)) && !put(0x0ea4, 9))
    assert(get(0x0ea0, 4).contains(Seq(0xe8, 3, 0xd0, 7)))
  }
  rule("ALARM-09: nothing is appended for a master that does not confirm what it has", some) { s =>
    startUnconfirmed(s)
    assert(s.write(Bwr, 0, AlarmRegisters.Confirm, 0).workingCounter == 1, "not all of it")
    assert(status(s) == SlaveStatus.Waiting && collect(s).isEmpty)
    become(s, Alarm)
    assert(collect(s).isEmpty)
    confirm(s, 0)
    assert(collect(s).get.is(2, Alarm))
  }
  rule("ALARM-09: a record that is no alarm and has left twice rests for 15 frames each time", some) { s =>
    start(s)
    def comes(frames: Int) = (1 to frames).map(_ => collect(s).isDefined)
    val rests              = Seq.fill(15)(false)
    assert(comes(34) == Seq(true, true) ++ rests ++ Seq(true) ++ rests ++ Seq(true))
    become(s, Alarm)
    assert(comes(5).forall(identity), "an alarm never rests")
    acknowledge(s, collect(s).get, 0)
    assert(comes(3) == Seq(true, true, false), "what follows begins anew")
  }
  rule("ALARM-10, GEN-09: the state of the slave can be read, by bus and host", some) { s =>
    import s._
    start(s)
    hostPut(0x0ea4, 5)
    val links = if (p.ports == 4) 15 else (1 << p.ports) - 1
    val state = Seq(0x40, 0x14, Node, 0, 5, 0x77, 0, links) // waiting, host dead, unwell
    assert(get(Status, 8).contains(state) && hostGet(Status, 8) == state)
    assert(!put(Status, 1))
    hostPut(0x0ea4, 1)
    assert((word(Status) & SlaveStatus.Unwell) == 0)
    become(s, Short)
    assert(kind(s) == SlaveStatus.Short)
    bench.setLink(nextPort, up = false)
    assert(hostGet(Status + 7, 1) == Seq(links & ~(1 << nextPort)))
  }
  rule("ALARM-11: a host that has not said for as long as it said that it lives is dead", some) { s =>
    import s._
    def dead = (word(Status) & SlaveStatus.HostDead) != 0
    assert(dead && get(0x0eb4, 2).contains(Seq(0, 0)))
    hostPut(0x0eb4, 3, 0)
    bench.advanceUs(1700)
    assert(!dead)
    hostPut(0x0eb4, 3, 0)
    bench.advanceUs(1700)
    assert(!dead)
    bench.advanceUs(1700)
    assert(dead && hostGet(0x0eb4, 2) == Seq(0, 0) && !put(0x0eb4, 9))
  }
  rule("ALARM-12: damage of the configuration shows", some) { s =>
    import s._
    assert(kind(s) == 0)
    bench.damage()
    bench.advanceUs(1)
    assert(kind(s) == SlaveStatus.Configuration)
  }
  rule("AP-01: other frames than EtherCAT, and frames to port 1, pass as they are", some) { s =>
    import s._
    start(s)
    assert(put(0x0100, 0))
    val foreign = (0 until 80).map(_ * 3 & 0xff).updated(12, 8).updated(13, 6)
    assert(good(send(foreign)).dropRight(4) == foreign)
    val frame = EtherCatFrame(Seq(Datagram(Nop, 0, 0, Seq(1))))
    assert(good(send(frame, port = nextPort), at = 0).dropRight(4) == frame)
  }
  rule("AP-02: no datagram beyond maxSubTelegrams", p => p.hasAlarm && p.maxSubTelegrams < 100) { s =>
    import s._
    start(s)
    become(s, Alarm)
    for (count <- 1 to p.maxSubTelegrams) {
      val came = exchange(Seq.fill(count)(Datagram(Nop, 0, 0, Nil)): _*)
      assert(came.size == (if (count < p.maxSubTelegrams) count + 1 else count))
    }
  }
  rule("AP-03, AP-04, AP-06: behind other datagrams, which work as ever", some) { s =>
    import s._
    start(s)
    if (p.maxSubTelegrams >= 5) {
      val replies =
        exchange(Datagram(Apwr, 0, 0x0f80, Seq(1, 2, 3)), Datagram(Aprd, 0, 0x0f80, Seq.fill(20)(0)))
      assert(replies.map(_.workingCounter) == Seq(1, 1, 1) && replies(1).data.take(3) == Seq(1, 2, 3))
      assert(replies.map(_.more) == Seq(true, true, false) && record(replies(2)).is(1, Normal))
    } else assert(exchange(Datagram(Apwr, 0, 0x0f80, Seq(1, 2, 3))).head.workingCounter == 1)
  }
  rule("AP-07: a bad frame stays bad", some) { s =>
    import s._
    start(s)
    val bytes           = EtherCatFrame(Nil)
    val sent: SentFrame = marked(bench.send(0, WireFrame.ofBytes(bytes ++ Fcs.of(bytes).map(_ ^ 0x10))))
    assert(sent.payload.size == 128 + 1, "it got a wrong FCS, and the mark behind that")
    assert(status(s) == SlaveStatus.Waiting)
  }
}

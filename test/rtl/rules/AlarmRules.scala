package flyframe.rules

import flyframe.model.{Datagram, EtherCatFrame, Fcs, SentFrame, WireFrame}
import flyframe.params.EscParams
import flyframe.protocol.Command._
import flyframe.protocol.DetectorState.{Alarm, Normal, Off, Open, Short}

/** The smoke detector and its reports in passing frames: ALARM, DET, AP (docs/rules/alarm.md). */
object AlarmRules extends Rules {
  private def some(p: EscParams) = p.hasAlarm
  private val Record             = 0x0e80
  private val Node               = 0x0a

  /** Switches the detector on, with a debounce of 20 us. */
  private def start(s: Steps, report: Boolean = true): Unit = {
    import s._
    hostPut(0x0012, Node)
    hostPut(0x0ea0, 2, 0)
    hostPut(0x0ea5, 0x77, if (report) 3 else 1)
    become(s, Normal)
  }
  private def become(s: Steps, state: Int): Unit = {
    s.bench.setLine(state)
    s.bench.advanceUs(60)
  }
  private def state(s: Steps): Int   = s.bench.hostRead(0x0e89) & 7
  private def waiting(s: Steps): Int = s.bench.hostRead(0x0e88)
  private def acknowledge(s: Steps, sequence: Int): Seq[Reply] =
    s.exchange(Datagram(Apwr, 0, 0x0e8a, EtherCatFrame.little(sequence)))

  private def confirm(s: Steps, sequence: Int): Seq[Reply] =
    s.exchange(Datagram(Apwr, 0, 0x0e8e, EtherCatFrame.little(sequence)))

  /** The datagrams of what leaves for an empty frame. */
  private def collect(s: Steps): Seq[Reply] = {
    val bytes = s.good(s.send(EtherCatFrame(Nil)))
    if ((bytes(14) | (bytes(15) & 7) << 8) == 0) Nil else s.replies(bytes)
  }
  private def isRecord(reply: Reply, sequence: Int, state: Int) =
    reply.command == Nop && reply.index == (sequence & 0xff) && reply.adp == Node && reply.ado == Record &&
      reply.data.take(4) == Seq(sequence & 0xff, sequence >> 8, state, 0x77) && reply.workingCounter == 1

  rule("DET-01, DET-02: no supply until the host switches the detector on; then its state counts", some) {
    s =>
      import s._
      become(s, Normal)
      assert(state(s) == Off && (bench.hostRead(0x0e89) & 0x10) == 0 && waiting(s) == 0)
      start(s)
      assert(state(s) == Normal && (bench.hostRead(0x0e89) & 0x10) != 0 && waiting(s) == 1)
  }
  rule("DET-03: a state counts when it has lasted for the debounce time", some) { s =>
    import s._
    start(s)
    bench.hostWrite(0x0ea0, 20) // 200 us
    bench.setLine(Alarm)
    bench.advanceUs(150)
    assert(state(s) == Normal)
    bench.setLine(Normal)
    bench.advanceUs(10)
    bench.setLine(Alarm)
    bench.advanceUs(150)
    assert(state(s) == Normal, "it has been interrupted")
    bench.advanceUs(100)
    assert(state(s) == Alarm && waiting(s) == 2)
  }
  rule("DET-04: a restart takes the supply away for the off time", some) { s =>
    import s._
    start(s)
    become(s, Alarm)
    hostPut(0x0ea2, 1, 0)
    assert(put(0x0e8c, 2))
    assert(state(s) == Off && (bench.hostRead(0x0e89) & 0x10) == 0 && bench.hostRead(0x0e8c) == 0)
    bench.setLine(Normal)
    bench.advanceUs(700)
    assert(state(s) == Off)
    bench.advanceUs(1500)
    assert(state(s) == Normal && waiting(s) == 3)
  }
  rule("DET-05, ALARM-02: open line, short circuit, alarm, normal: each change is an event", some) { s =>
    start(s)
    for (state      <- Seq(Open, Short, Alarm, Normal)) become(s, state)
    for ((state, i) <- Seq(Normal, Open, Short, Alarm, Normal).zipWithIndex) {
      val Seq(record) = collect(s)
      assert(isRecord(record, i + 1, state))
      acknowledge(s, i + 1)
    }
    assert(collect(s).isEmpty)
  }
  rule(
    "ALARM-03, AP-02, AP-05: the oldest event rides in every passing frame until it is acknowledged",
    some
  ) { s =>
    start(s)
    become(s, Alarm)
    for (_ <- 1 to 3) assert(isRecord(collect(s).head, 1, Normal))
    val came = acknowledge(s, 1)
    assert(came.head.workingCounter == 1)
    if (s.p.maxSubTelegrams > 1) assert(isRecord(came(1), 1, Normal), "this frame still has it")
    assert(isRecord(collect(s).head, 2, Alarm))
    acknowledge(s, 2)
    assert(collect(s).isEmpty && waiting(s) == 2)
    confirm(s, 2)
    assert(waiting(s) == 0)
  }
  rule("ALARM-04: an event stays until it is confirmed, and is reported again if the master asks", some) {
    s =>
      import s._
      start(s)
      become(s, Alarm)
      become(s, Open)
      acknowledge(s, 1)
      acknowledge(s, 2)
      for (n <- Seq(0, 3, 0x102, 0xffff)) confirm(s, n)
      assert(waiting(s) == 3, "only what the master has seen can be confirmed")
      confirm(s, 1)
      assert(waiting(s) == 2 && isRecord(collect(s).head, 3, Open))
      assert(put(0x0e8c, 4) && bench.hostRead(0x0e8c) == 0)
      assert(isRecord(collect(s).head, 2, Alarm) && waiting(s) == 2)
      confirm(s, 2)
      assert(waiting(s) == 2, "not seen by this master")
      acknowledge(s, 2)
      acknowledge(s, 3)
      become(s, Normal)
      confirm(s, 3)
      assert(waiting(s) == 1 && isRecord(collect(s).head, 4, Normal))
  }
  rule(
    "ALARM-04: an event may be acknowledged and confirmed in one frame, also in one that has its record",
    p => some(p) && p.maxSubTelegrams > 2
  ) { s =>
    import s._
    start(s)
    become(s, Alarm)
    def both(number: Int) = exchange(
      Seq(0x0e8a, 0x0e8e).map(ado => Datagram(Apwr, 0, ado, EtherCatFrame.little(number))): _*
    )
    for ((number, state) <- Seq(1 -> Normal, 2 -> Alarm)) {
      val came = both(number)
      assert(came.take(2).map(_.workingCounter) == Seq(1, 1) && isRecord(came(2), number, state))
      assert(waiting(s) == 2 - number)
    }
    assert(collect(s).isEmpty)
  }
  rule("ALARM-04: another number, and a bad frame, acknowledge nothing", some) { s =>
    import s._
    start(s)
    for (n <- Seq(0, 2, 0x101, 0xffff)) acknowledge(s, n)
    val bytes = EtherCatFrame(Seq(Datagram(Apwr, 0, 0x0e8a, Seq(1, 0))))
    marked(bench.send(0, WireFrame.ofBytes(bytes ++ Fcs.of(bytes).map(_ ^ 0xff))))
    assert(waiting(s) == 1 && isRecord(collect(s).head, 1, Normal))
  }
  rule("ALARM-03, GEN-09: the record can be read, by bus and host", some) { s =>
    import s._
    assert(get(Record, 8).contains(Seq.fill(8)(0)))
    start(s, report = false)
    assert(get(Record, 4).contains(Seq(1, 0, Normal, 0x77)) && hostGet(Record, 4) == Seq(1, 0, Normal, 0x77))
    assert(!put(Record, 1) && get(0x0e88, 1).contains(Seq(1)))
  }
  rule("ALARM-05: when the queue is full the newest state is reported as soon as there is room", some) { s =>
    start(s)
    for (i <- 1 to 20) become(s, if (i % 2 == 1) Alarm else Open)
    assert(waiting(s) == 16)
    become(s, Short)
    for (i <- 1 to 16) acknowledge(s, i)
    assert(waiting(s) == 16 && collect(s).isEmpty)
    confirm(s, 1)
    assert(waiting(s) == 16 && isRecord(collect(s).head, 17, Short))
    acknowledge(s, 17)
    confirm(s, 16)
    assert(waiting(s) == 1)
    confirm(s, 17)
    assert(waiting(s) == 0)
  }
  rule("ALARM-06: an alarm switches buzzer and lamp on, a command of the master off", some) { s =>
    import s._
    def latched = (bench.hostRead(0x0e89) & 0x20) != 0
    start(s)
    assert(!latched)
    become(s, Alarm)
    assert(latched)
    become(s, Normal)
    assert(latched, "until it is cleared")
    assert(write(Bwr, 0, 0x0e8c, 1).workingCounter == 1 && !latched)
    become(s, Alarm)
    assert(latched)
    assert(put(0x0e8c, 1) && !latched && state(s) == Alarm)
    become(s, Normal)
    assert(!latched)
  }
  rule("ALARM-07: messages to all and to one interrupt the host until it has read of them", some) { s =>
    import s._
    assert(!bench.interrupt)
    assert(write(Bwr, 0, 0x0e90, 1, 2, 3, 4, 5, 6, 7, 8).workingCounter == 1)
    assert(bench.interrupt && bench.hostRead(0x0e8d) == 1 && !bench.interrupt)
    assert(hostGet(0x0e90, 8) == (1 to 8))
    bench.hostWrite(0x0012, Node)
    assert(put(0x0103, 1))
    assert(write(Fpwr, Node, 0x0e98, 8, 7, 6, 5, 4, 3, 2, 1).workingCounter == 1)
    assert(bench.interrupt && bench.hostRead(0x0e8d) == 2 && bench.hostRead(0x0e8d) == 0)
    assert(write(Fpwr, Node + 1, 0x0e98, 1, 1, 1, 1, 1, 1, 1, 1).workingCounter == 0)
    assert(hostGet(0x0e98, 8) == (1 to 8).reverse && !bench.interrupt)
    assert(put(0x0e90, 9) && !bench.interrupt, "not before the last byte")
  }
  rule("ALARM-08: what the host has said of this slave, the master can read", some) { s =>
    import s._
    hostPut(0x0ea4, 1, 2, 3)
    assert(get(0x0ea4, 3).contains(Seq(1, 2, 3)) && !put(0x0ea4, 9))
    assert(get(0x0ea0, 4).contains(Seq(0xe8, 3, 0xd0, 7)))
  }
  rule("ALARM-09: without leave of the host nothing is appended", some) { s =>
    start(s, report = false)
    assert(waiting(s) == 1 && collect(s).isEmpty)
    s.bench.hostWrite(0x0ea6, 3)
    assert(isRecord(collect(s).head, 1, Normal))
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
      assert(replies.map(_.more) == Seq(true, true, false) && isRecord(replies(2), 1, Normal))
    } else assert(exchange(Datagram(Apwr, 0, 0x0f80, Seq(1, 2, 3))).head.workingCounter == 1)
  }
  rule("AP-07: a bad frame stays bad", some) { s =>
    import s._
    start(s)
    val bytes           = EtherCatFrame(Nil)
    val sent: SentFrame = marked(bench.send(0, WireFrame.ofBytes(bytes ++ Fcs.of(bytes).map(_ ^ 0x10))))
    assert(sent.payload.size == 129 && waiting(s) == 1)
  }
}

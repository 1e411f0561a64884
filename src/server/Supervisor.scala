package flyframe.server

import java.net.InetSocketAddress
import java.security.SecureRandom
import java.sql.SQLException
import java.time.Instant
import scala.collection.mutable
import flyframe.protocol.{CommandResult, EventKind, Order, RingResult, ServerDatagram, SlaveStatus}

/** The masters and what comes from them: which reports count, the lines, the log, the orders (SRV-05 to
  * SRV-14). For several threads. What a report tells is shown at once; the log comes behind and can hold up
  * nothing: neither page nor answers.
  *
  * @param send
  *   sends a datagram
  * @param changed
  *   called, under the lock, when something has changed that the page shows
  * @param inBackground
  *   runs what may take long: all writing
  * @param clockMs
  *   a clock that never jumps, milliseconds: all decisions go by it
  * @param timeOfDay
  *   the other one, which is only shown and written down
  * @param random
  *   for lives of the server and tickets
  */
final class Supervisor(
    options: Options,
    keys: Keys,
    expected: Expected,
    store: EventStore,
    send: (Array[Byte], InetSocketAddress) => Unit,
    changed: () => Unit,
    inBackground: (() => Unit) => Unit,
    clockMs: () => Long = () => System.nanoTime() / 1000000,
    timeOfDay: () => Instant = () => Instant.now,
    random: () => Long = Supervisor.secureRandom
) {
  import Supervisor._
  private val masters = mutable.LinkedHashMap.empty[Int, Master]
  private val orders  = mutable.Map.empty[Int, Orders]
  private val silent  = mutable.Set.empty[Int]
  private val refused = mutable.Map.empty[Refusal, Long].withDefaultValue(0L)
  private val admits  = new Admission(options, keys, clockMs)
  private val records = mutable.Map.empty[Int, RecordGaps]
  private val rings   = new Rings(isSilentSince, options.orderTimeoutMs, clockMs, timeOfDay)
  private var broken  = Option.empty[String]

  // The life of the server; the number of the last answer in it; the last ticket.
  private var life   = newLife()
  private var turn   = 0L
  private var ticket = random() & 0xffffffffL

  // What is to be written, one report per master; those whose answers wait for it. What the server itself
  // has to say, and how often it has.
  private val toWrite   = mutable.LinkedHashMap.empty[Int, Sent]
  private val toNote    = mutable.Buffer.empty[LogEntry]
  private var noted     = 0L
  private val waiting   = mutable.LinkedHashMap.empty[Int, Waiting]
  private var isWriting = false
  private var probedMs  = clockMs()

  // After a start: what the log tells, and who is to be there. No master has reported yet.
  for (id <- expected.masters.keys.toSeq.sorted) masters(id) = Master(id)
  try {
    for (r <- store.youngest) {
      val id = r.life.master
      if (masters.contains(id) || masters.size < MostMasters) {
        val line = LineState.fromLog(store.states(r.life), store.alarms(id), timeOfDay())
        masters(id) = Master(id, Some(r.life), line, stored = Some(r.next), gaps = r.gaps)
        store.records(id, MostRecords).foreach(gapsOf(id).seen)
      }
    }
    rings.restore(store.rings)
  } catch { case e: SQLException => broken = Some(s"The log cannot be read (${e.getMessage}).") }
  silent ++= masters.keys

  private def gapsOf(master: Int): RecordGaps = records.getOrElseUpdate(master, new RecordGaps)

  /** 0 stands for a server that is not known. */
  private def newLife(): Long = Iterator.continually(random()).find(_ != 0).get

  /** A datagram has come. A report is shown, stored and answered; all else is counted. */
  def receive(datagram: Array[Byte], from: InetSocketAddress): Unit = synchronized {
    val result = for {
      report <- admits.authentic(datagram, from.getAddress)
      _      <- if (report.server == life) Right(()) else doubt(report, from)
      _      <- admits.admit(report, hasRoom(report))
    } yield report match {
      case r: Report     => take(r, from)
      case r: RingReport => takeRing(r, from)
    }
    result.left.foreach(count)
  }

  /** The answer tells the master this life of the server; no event is acknowledged by it, and nothing is
    * ordered.
    */
  private def doubt(report: Sent, from: InetSocketAddress): Left[Refusal, Nothing] = {
    if (admits.doubt(report)) answer(report, from, report.first, None)
    Left(Refusal.Unproven)
  }

  private def count(why: Refusal): Unit = {
    refused(why) += 1
    changed()
  }

  private def hasRoom(report: Sent): Boolean = report match {
    case _: RingReport => rings.hasRoom(report.life.master)
    case _             => hasRoom(report.life.master)
  }

  private def hasRoom(id: Int): Boolean =
    masters.contains(id) || masters.size < MostMasters || masters.keys.exists(mayGo)

  /** A master that another one may take the place of. */
  private def mayGo(id: Int): Boolean =
    isSilent(masters(id)) && !expected.masters.contains(id) && !masters(id).line.isBurning

  private def take(report: Report, from: InetSocketAddress): Unit = {
    val id     = report.life.master
    val now    = timeOfDay()
    val before = masters.get(id)
    if (before.isEmpty && masters.size >= MostMasters) masters.keys.find(mayGo).foreach(forget)
    val held = before match {
      case Some(m) if m.life.contains(report.life) => m
      case other =>
        orders.get(id).foreach(_.abandon())
        Master(
          id,
          Some(report.life),
          other.fold(LineState())(_.line.renewed),
          fireMs = other.fold(0L)(_.fireMs),
          lost = other.fold(LostFrames())(_.lost)
        )
    }
    silent -= id
    val line = held.line.after(report, now)
    val m = held.copy(
      line = line,
      heardMs = Some(clockMs()),
      heard = Some(now),
      fireMs = if (line.fires.keys.forall(held.line.fires.contains)) held.fireMs else clockMs(),
      lost = held.heardMs.fold(held.lost)(held.lost.after(_, held.line.lost, line.lost))
    )
    masters(id) = m
    report.events.foreach(ordersOf(id).told)
    if (m.stored.exists(_ >= report.end)) settle(report)
    log(report, from, m.stored)
  }

  private def takeRing(report: RingReport, from: InetSocketAddress): Unit = {
    rings.take(report, from)
    for ((id, address) <- rings.takeLost())
      note(
        id,
        Event(LogEntry.RingNode, node = address, state = 1),
        s"node $address: lost, not heard since the start of its gateway"
      )
    log(report, from, rings.get(report.life).flatMap(_.stored))
    sendToRings()
  }

  /** A report is answered when the log has it.
    *
    * @param stored
    *   number of what the log wants next
    */
  private def log(report: Sent, from: InetSocketAddress, stored: Option[Long]): Unit = {
    val id = report.life.master
    changed()
    // An earlier report of this master still waits for the log: this one has all that is wanted of it.
    waiting.remove(id).foreach(answerStored)
    toWrite -= id
    if (stored.exists(_ >= report.end)) answerStored(Waiting(report, from, 0))
    else {
      waiting(id) = Waiting(report, from, clockMs() + PatienceMs)
      toWrite(id) = report
      write()
    }
  }

  /** Messages for nodes leave. */
  private def sendToRings(): Unit = for {
    (life, to, order) <- rings.due()
    key               <- keys.of(life.master)
  } {
    val counted = nextTurn()
    val message =
      RingSend(life, this.life, counted, order.counter.get, order.destination, order.urgent, order.data)
    send(RingProtocol.encode(message, key), to)
  }

  private def forget(id: Int): Unit = {
    masters -= id
    silent -= id
    orders -= id
    records -= id
  }

  /** Writes in the background what there is to write. */
  private def write(): Unit = if (!isWriting) {
    isWriting = true
    inBackground { () =>
      try Iterator.continually(next()).takeWhile(_.nonEmpty).flatten.foreach(_())
      catch { case e: Throwable => synchronized { isWriting = false }; throw e }
    }
  }

  private def next(): Option[() => Unit] = synchronized {
    val job = toWrite.headOption match {
      case Some((id, report)) =>
        toWrite -= id
        Some(() => writeOne(report))
      // They can wait for a log that works.
      case None => Option.when(toNote.nonEmpty && broken.isEmpty)(() => writeNotes())
    }
    isWriting = job.nonEmpty
    job
  }

  private def writeNotes(): Unit = {
    val notes = synchronized(toNote.toVector)
    for (_ <- logged(store.note(notes))) synchronized {
      toNote --= notes
      changed()
    }
  }

  // Not under the lock, since it may take long.
  private def writeOne(report: Sent): Unit = {
    val settled = report match {
      case r: Report => logged(store.take(r, timeOfDay())).map { case (e, next) => () => written(r, e, next) }
      case r: RingReport =>
        logged(store.take(r, timeOfDay())).map { case (e, next) => () => rings.stored(next, e) }
    }
    synchronized {
      settled.foreach(_())
      val id = report.life.master
      waiting.get(id).filter(_.report eq report).foreach { w =>
        waiting -= id
        answerStored(w)
      }
      changed()
    }
  }

  private def written(report: Report, entries: Seq[LogEntry], record: LifeRecord): Unit = {
    val id = report.life.master
    entries.filter(_.event.kind == EventKind.Detector).foreach(e => gapsOf(id).seen(e.event))
    settle(report)
    masters
      .get(id)
      .filter(_.life.contains(report.life))
      .foreach(m => masters(id) = m.copy(stored = Some(record.next), gaps = record.gaps))
  }

  /** The log has all events of a report. If all that the slaves have told was in it, and they have no more to
    * tell, what is missing before that does not come any more.
    */
  private def settle(report: Report): Unit =
    if (report.events.size < ServerDatagram.Most)
      for ((s, position) <- report.slaves.zipWithIndex if !s.has(SlaveStatus.Waiting | SlaveStatus.Absent))
        gapsOf(report.life.master).settled(s.node, position)

  /** Does what needs the log; says whether the log works. */
  private def logged[A](body: => A): Option[A] =
    try {
      val result = body
      synchronized { broken = None }
      Some(result)
    } catch {
      case e: SQLException =>
        val why = s"The log cannot be written (${e.getMessage.takeWhile(_ != '\n')}). What is shown of the " +
          "detectors is right, of rings it may be old; events and messages wait at masters and gateways."
        synchronized { broken = Some(why) }
        None
    }

  /** Answers a report that counts. */
  private def answerStored(w: Waiting): Unit = w.report match {
    case report: Report =>
      val m      = masters.get(report.life.master).filter(_.life.contains(report.life))
      val stored = m.flatMap(_.stored).getOrElse(report.first)
      val line   = LineState(report.slaves)
      answer(report, w.from, stored, m.flatMap(m => ordersOf(m.id).ride(clockMs(), concerned(line, _))))
    case report: RingReport =>
      answer(report, w.from, rings.get(report.life).flatMap(_.stored).getOrElse(report.first), None)
  }

  /** Positions of slaves that an order would silence or reset. */
  private def concerned(line: LineState, t: Ticket): Set[Int] = {
    val bits = t.order match {
      case Order.Silence => SlaveStatus.Sounding
      case Order.Reset   => SlaveStatus.Alarm | SlaveStatus.Latched
      case _             => 0
    }
    val all = line.positions(bits)
    if (t.node == ServerDatagram.AllNodes) all else all.filter(line.slaves(_).node == t.node)
  }

  private def answer(report: Sent, from: InetSocketAddress, number: Long, order: Option[Ticket]): Unit = {
    val turn  = nextTurn()
    val plain = Answer(report.life, life, turn, report.counter, number, trouble = broken.nonEmpty)
    val full =
      order.fold(plain)(t =>
        plain.copy(ticket = t.number, order = t.order, node = t.node, seconds = t.seconds)
      )
    keys.of(report.life.master).foreach(key => send(Protocol.encode(full, key), from))
  }

  /** With a turn that comes again a tag would, too. */
  private def nextTurn(): Long = {
    if (turn == LastTurn) {
      life = newLife()
      turn = 0
    }
    turn += 1
    turn
  }

  private def isSilentSince(heardMs: Option[Long]): Boolean =
    heardMs.forall(clockMs() - _ > options.masterTimeoutMs)
  private def isSilent(m: Master): Boolean = isSilentSince(m.heardMs)

  private def ordersOf(master: Int): Orders = orders.getOrElseUpdate(
    master,
    new Orders(
      options.orderTimeoutMs,
      () => { ticket = if (ticket == 0xffffffffL) 1 else ticket + 1; ticket }
    )
  )

  /** An operator's order; Left: why it cannot be sent. It leaves with the answer to the next report.
    *
    * @param shown
    *   positions of slaves that the page showed sounding (silence), or in alarm or latched (reset); None: as
    *   the last report has them
    */
  def order(
      master: Int,
      code: Int,
      node: Int,
      seconds: Int,
      shown: Option[Set[Int]] = None
  ): Either[String, Request] = synchronized {
    for {
      m <- reachable(master)
      about = code match {
        case Order.Silence => Some(shown.getOrElse(m.line.positions(SlaveStatus.Sounding)))
        case Order.Reset   => Some(shown.getOrElse(m.line.positions(SlaveStatus.Alarm | SlaveStatus.Latched)))
        case _             => None
      }
      request <- ordersOf(master).add(code, node, seconds, clockMs(), timeOfDay(), about)
    } yield {
      changed()
      request
    }
  }

  /** An operator's order for the slaves of a zone; Left: why it cannot be sent. */
  def orderZone(master: Int, code: Int, zone: String, seconds: Int): Either[String, Request] = synchronized {
    for {
      m     <- reachable(master)
      nodes <- expected.zones(master).toMap.get(zone).toRight(s"Master $master has no zone '$zone'.")
      doubled = nodes.filter(m.line.answering(_).size > 1).toSet
      request <- ordersOf(master).addZone(code, zone, nodes, doubled, seconds, clockMs(), timeOfDay())
    } yield {
      changed()
      request
    }
  }

  /** A message for a node of a ring (GW-06), or for all, destination 0; Left: why it cannot be sent. */
  def sendToRing(
      gateway: Int,
      destination: Int,
      urgent: Boolean,
      data: Vector[Byte]
  ): Either[String, RingOrder] = synchronized {
    val result = rings.send(gateway, destination, urgent, data)
    if (result.isRight) changed()
    sendToRings()
    result
  }

  private def reachable(master: Int): Either[String, Master] = for {
    m <- masters.get(master).toRight(s"There is no master $master.")
    _ <- Either.cond(!isSilent(m), (), s"Master $master is silent.")
  } yield m

  /** To be called often: answers what has waited for the log too long, gives up orders, notices masters that
    * have become silent, and looks after the log.
    */
  def tick(): Unit = synchronized {
    val now = clockMs()
    for ((id, w) <- waiting.toSeq if now - w.untilMs >= 0) {
      waiting -= id
      answerStored(w)
    }
    for ((_, o)  <- orders if o.tick(now)) changed()
    for ((id, o) <- orders; r <- o.takeEnded()) note(id, r)
    if (rings.tick()) changed()
    for ((id, o) <- rings.takeEnded()) note(id, o)
    if (toNote.nonEmpty && broken.isEmpty) write()
    for ((id, m) <- masters if isSilent(m) && silent.add(id)) changed()
    sendToRings()
    if (now - probedMs >= ProbeMs && !isWriting) {
      probedMs = now
      val before = broken
      isWriting = true
      inBackground { () =>
        try logged(store.probe())
        finally
          synchronized {
            isWriting = false
            if (broken != before) changed()
            if (toWrite.nonEmpty) write()
          }
      }
    }
  }

  /** Has the log told what became of an order for a zone. */
  private def note(master: Int, r: Request): Unit = for (outcome <- r.outcome) {
    val result = outcome.fold(_ => CommandResult.NoAnswer, _ => CommandResult.Done)
    val event  = Event(LogEntry.ZoneOrder, r.tickets.head.order, ServerDatagram.AllNodes, state = result)
    val text   = s"${r.text}: ${outcome.fold("failed, " + _, _ => "done")}"
    note(master, event, text)
  }

  /** Has the log told how a message for a node of a ring has ended without a result of its gateway. */
  private def note(gateway: Int, o: RingOrder): Unit = for (why <- o.outcome.flatMap(_.left.toOption)) {
    val name = o.counter.fold("message of the server")(n => s"message $n of the server")
    note(
      gateway,
      Event(LogEntry.RingResult, node = o.destination, state = RingResult.NotConfirmed),
      s"$name ${o.text}: $why"
    )
  }

  private def note(id: Int, event: Event, text: String): Unit = {
    noted += 1
    toNote += LogEntry(0, timeOfDay(), Life(id, life), noted, event, note = Some(text))
    if (toNote.size > MostNotes) toNote.remove(0)
  }

  /** All there is to be shown. */
  def picture: Picture = synchronized {
    val now = clockMs()
    // Masters none of whose reports was proven are shown, too.
    val strangers =
      admits.unproven.filterNot(id => masters.contains(id) || rings.isKnown(id)).take(MostMasters)
    val shown = masters.values.toVector ++ strangers.map(Master(_))
    Picture(
      shown.sortBy(_.id).map { m =>
        Picture.Seen(
          m,
          expected,
          isSilent(m),
          admits.isUnproven(m.id),
          orders.get(m.id).fold(Seq.empty[Ticket])(_.all),
          records.get(m.id).fold(Map.empty[Int, Int])(_.missing),
          m.lost.areTooMany(now)
        )
      },
      Refusal.all.map(r => r.name -> refused(r)),
      broken,
      rings.picture(admits.isUnproven)
    )
  }
}

object Supervisor {

  /** Masters at a time. */
  val MostMasters = 8

  /** An answer waits so long for the log, ms: then it leaves without acknowledging anything new. */
  val PatienceMs = 100

  /** Whether the log can be written is found out so often, ms. */
  val ProbeMs = 5000

  /** Records of a master's slaves that are looked through for gaps at the start. */
  private val MostRecords = 100000

  /** Entries of the server that wait for a log that can be written. */
  private val MostNotes = 1000

  private val LastTurn = 0xffffffffL

  private lazy val generator           = new SecureRandom
  private val secureRandom: () => Long = () => generator.nextLong()

  /** A report whose answer waits for the log. */
  private final case class Waiting(report: Sent, from: InetSocketAddress, untilMs: Long)
}

package flyframe.transport

import scala.collection.mutable

private[transport] class CountersModel {
  private val counts               = mutable.Map.empty[Counter.Value, Int].withDefaultValue(0)
  def add(c: Counter.Value): Unit  = counts(c) += 1
  def apply(c: Counter.Value): Int = counts(c)
}

/** Answers that wait for a place in the port. The newest of a kind takes the place of an older one. */
private[transport] class AnswersModel(
    p: TransportParams,
    clock: ClockModel,
    slots: SlotsModel,
    counts: CountersModel
) {
  private case class Waiting(toAll: Boolean, frame: BusFrame, since: Long) {
    def id: FrameId = FrameId.of(frame.id)
  }
  private var waiting = Vector.empty[Waiting]

  def put(frame: BusFrame, toAll: Boolean): Unit = {
    val answer = Waiting(toAll, frame, clock.now)
    val same   = waiting.indexWhere(a => a.frame.id == frame.id && a.toAll == toAll)
    val most   = if (answer.id.urgent) Sizes.Answers else Sizes.Answers - 4
    if (slots.waits(frame)) ()
    else if (same >= 0) waiting = waiting.updated(same, answer)
    else if (waiting.size < most) waiting :+= answer
    else counts.add(Counter.AnswerLost)
  }

  /** Nobody awaits an old answer (TB-27). */
  def dropOld(): Unit = {
    val (old, others) = waiting.partition(a => clock.now >= a.since + p.staleUs(a.id))
    old.foreach(_ => counts.add(Counter.AnswerLost))
    waiting = others
  }

  def queueOne(urgent: Boolean): Boolean = {
    val i = waiting.indexWhere { a =>
      a.id.urgent == urgent && !slots.waits(a.frame.id) && slots.hasRoom(a.id)
    }
    if (i >= 0) {
      slots.put(waiting(i).frame)
      waiting = waiting.patch(i, Nil, 1)
    }
    i >= 0
  }
}

/** The golden model of a node's transport. */
class TransportModel(p: TransportParams, start: Long = 0) extends TransportUnderTest {
  private val counts   = new CountersModel
  private val clock    = new ClockModel(start)
  private val slots    = new SlotsModel(p, clock)
  private val answers  = new AnswersModel(p, clock, slots, counts)
  private val sender   = new SenderModel(p, slots, counts)
  private val receiver = new ReceiverModel(p, answers, counts)
  private val station  = new StationModel(p, slots, start)
  private val departed = mutable.Buffer.empty[Int]

  def poll(now: Long): Long = {
    clock.now = now
    departed.foreach(id => sender.left(FrameId.of(id), now))
    departed.clear()
    sender.collect() // what an answer has ended sends nothing more, and nothing of it stays
    val stale = slots.takeBack(sender.has, () => station.helloAgain())
    answers.dropOld()
    val due = Seq(stale, sender.poll(now), receiver.poll(now), station.poll(now)).min
    sender.collect()
    def one = answers.queueOne(urgent = true) || sender.queueOne(urgent = true) ||
      answers.queueOne(urgent = false) || station.queueOne() || sender.queueOne(urgent = false)
    while (one) {}
    sender.collect()
    due min slots.lookHold()
  }

  def receive(frame: BusFrame, now: Long): Unit = {
    val id = FrameId.of(frame.id)
    clock.now = now
    if (id.source == 0 || id.source > Sizes.LastAddress) counts.add(Counter.WrongSource)
    else if (id.source == p.address) counts.add(Counter.OwnAddress)
    else if (id.destination != 0 && id.destination != p.address) counts.add(Counter.Foreign)
    else if (frame.dlc > 8) counts.add(Counter.Malformed)
    else if (!id.isData) control(id, frame.data, now)
    else if (id.pipe != Sizes.ProcessData) receiver.data(id, frame.data, now)
    else if (!id.end) counts.add(Counter.WrongEnd)
    else if (!station.arrives(id.source, id.number, frame.data, now)) counts.add(Counter.Unwatched)
  }

  private def control(id: FrameId, bytes: Seq[Int], now: Long): Unit = {
    val toAll     = id.destination == 0
    def toAllBit  = bytes.lift(1).exists(b => (b & Sizes.ToAll) != 0)
    def isOpening = id.pipe != Sizes.ProcessData && toAllBit == toAll
    def isAnswer  = id.pipe != Sizes.ProcessData && !toAll
    val isGood = id.end && (id.number match {
      case Code.Open    => isOpening && bytes.size == 8
      case Code.Short   => isOpening && bytes.size >= 3
      case Code.Close   => isOpening && bytes.size == 2
      case Code.Done    => isAnswer && bytes.size == 4 && bytes(3) <= 2
      case Code.Missing => isAnswer && bytes.size == 8
      case Code.Busy    => isAnswer && bytes.size == 3
      case Code.Unknown => isAnswer && bytes.size == 1 && (bytes.head & 0x7f) == 0
      case Code.Hello   => toAll && id.pipe == 0 && bytes.size == 8
      case _            => false
    })
    if (!isGood) counts.add(Counter.Malformed)
    else
      id.number match {
        case Code.Open | Code.Short => receiver.opening(id, bytes, now)
        case Code.Close             => receiver.close(id, bytes, now)
        case Code.Hello =>
          if (receiver.hello(id.source, bytes.head & 0x7f, now)) station.hello(id.source, now)
        case _ => sender.answer(id, bytes, now)
      }
  }

  def left(id: Int): Unit = {
    slots.left(id)
    departed += id
  }

  def queued(): Seq[BusFrame] = slots.drain()
  def aborted(): Seq[Int]     = slots.drainAborted()

  def send(
      tag: Int,
      destination: Int,
      urgent: Boolean,
      data: Seq[Int],
      now: Long,
      members: Option[Set[Int]]
  ): Boolean = {
    val who = members.getOrElse(this.members(now))
    sender.send(tag, destination, urgent, data, now, who, station.known)
  }

  def cancel(tag: Int): Unit                                     = sender.cancel(tag)
  def ended(): Seq[Ended]                                        = sender.ended()
  def received: Option[Received]                                 = receiver.received
  def take(now: Long, refused: Boolean): Unit                    = receiver.take(refused, now)
  def members(now: Long): Set[Int]                               = station.members(now)
  def setHello(bytes: Seq[Int], now: Long): Unit                 = station.setHello(bytes)
  def watch(source: Int, number: Int): Boolean                   = station.watch(source, number)
  def forgetValues(): Unit                                       = station.forgetValues()
  def count(counter: Counter.Value): Int                         = counts(counter)
  def value(s: Int, number: Int, now: Long): (Seq[Int], Boolean) = station.value(s, number, now)
  def setObject(destination: Int, number: Int, data: Seq[Int], now: Long): Boolean =
    station.set(destination, number, data)
}

package flyframe.transport

import scala.collection.mutable

/** The sending side: pipes, and messages under way in turn (TP-01, TP-02, TP-05). */
private[transport] class SenderModel(p: TransportParams, slots: SlotsModel, counts: CountersModel) {
  import SenderModel._

  private val numbers  = mutable.Map.empty[(Int, Int), Int].withDefaultValue(0)
  private val unheard  = mutable.Map.empty[(Int, Int), Int].withDefaultValue(0)
  private val leftAt   = mutable.Map.empty[(Int, Int), Long]
  private val underWay = mutable.Queue.empty[OutgoingModel] // the one whose turn it is in front
  private val over     = mutable.Buffer.empty[Ended]

  private def isUsedUp(destination: Int, pipe: Int) = unheard(destination -> pipe) >= MostUnheard

  /** Its receivers have not forgotten it yet (TB-26). */
  private def rests(destination: Int, pipe: Int, now: Long) =
    isUsedUp(destination, pipe) && now / Second - leftAt(destination -> pipe) / Second < p.restPipe

  def send(
      tag: Int,
      destination: Int,
      urgent: Boolean,
      data: Seq[Int],
      now: Long,
      members: Set[Int],
      known: Set[Int]
  ): Boolean = {
    val pipes = if (urgent) Sizes.ProcessData else Sizes.ProcessData - 1
    val pipe = (0 until pipes).find { n =>
      !underWay.exists(m => m.destination == destination && m.pipe == n) &&
      !slots.waitsOf(destination, n) && !rests(destination, n, now)
    }
    val isPossible = destination >= 0 && destination <= Sizes.LastAddress && destination != p.address &&
      data.nonEmpty && data.size <= Sizes.Message
    val hasPlace = underWay.size < (if (urgent) Sizes.Outgoing else Sizes.Outgoing - 1)
    for (n <- pipe if isPossible && hasPlace) {
      val number = numbers(destination -> n)
      numbers(destination -> n) = number + 1 & 0xff
      unheard(destination -> n) = if (isUsedUp(destination, n)) 1 else unheard(destination -> n) + 1
      leftAt(destination -> n) = now
      val who = if (destination == 0) members - p.address else Set(destination)
      underWay +=
        new OutgoingModel(
          p,
          tag,
          destination,
          urgent,
          n,
          number,
          data.toIndexedSeq,
          who,
          (who ++ known).size,
          now
        )
    }
    isPossible && hasPlace && pipe.nonEmpty
  }

  def cancel(tag: Int): Unit = underWay.filter(_.tag == tag).foreach(_.cancel())

  /** A frame is of a message that has not ended. */
  def has(id: FrameId): Boolean = (id.isData || id.number <= Code.Close) &&
    underWay.exists(m => m.destination == id.destination && m.pipe == id.pipe)

  /** A frame has left. Answers have identifiers with a pipe, too, but are no frames of a message. */
  def left(id: FrameId, now: Long): Unit =
    if (id.isData || id.number <= Code.Close) {
      leftAt(id.destination -> id.pipe) = now
      underWay.filter(m => m.destination == id.destination && m.pipe == id.pipe).foreach(_.left(now))
    }

  /** An answer has come, of the right form. */
  def answer(id: FrameId, bytes: Seq[Int], now: Long): Unit = {
    val life        = if (id.number == Code.Unknown) bytes.head else bytes(1)
    val destination = if ((life & Sizes.ToAll) != 0) 0 else id.source
    underWay.find(m => m.destination == destination && m.pipe == id.pipe) match {
      case Some(m) =>
        val wrong    = m.answer(id.source, id.number, bytes, now)
        val isOfThis = id.number != Code.Unknown && bytes.head == m.number
        if (isOfThis && destination != 0 && !wrong.contains(Counter.Unexpected))
          unheard(destination -> m.pipe) = 0
        wrong.foreach(counts.add)
      case None => counts.add(Counter.Unexpected)
    }
  }

  /** Puts one frame into the port, if there is one to be sent and room for it. */
  def queueOne(urgent: Boolean): Boolean = {
    val frame = underWay.iterator
      .filter(_.urgent == urgent)
      .flatMap(m => m.next(slots).filter(f => slots.hasRoom(FrameId.of(f.id))).map(m -> _))
      .nextOption()
    for ((m, f) <- frame) {
      slots.put(f)
      m.sent()
      underWay -= m
      underWay += m
    }
    frame.nonEmpty
  }

  def poll(now: Long): Long =
    underWay.iterator
      .map(m => m.poll(now, slots.waitsOf(m.destination, m.pipe)))
      .minOption
      .getOrElse(Long.MaxValue)

  def collect(): Unit = for (m <- underWay.toList; e <- m.end) {
    underWay -= m
    over += e
  }

  def ended(): Seq[Ended] = {
    val all = over.toList
    over.clear()
    all
  }
}

private object SenderModel {
  val Second = 1000000L

  /** Numbers of a pipe that are used while nobody may have heard of them. */
  val MostUnheard = 100
}

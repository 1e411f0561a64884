package flyframe.transport

import scala.collection.mutable

/** The time at which a node was looked at last, us. */
private[transport] class ClockModel(var now: Long)

/** The frames of a node that wait in its port, each once (TP-06). */
private[transport] class SlotsModel(p: TransportParams, clock: ClockModel) {
  private val places  = p.slots // how many there may be (TB-04)
  private val waiting = mutable.Map.empty[Int, BusFrame]
  private val since   = mutable.Map.empty[Int, Long]
  private val back    = mutable.Buffer.empty[Int]
  private val fresh   = mutable.Buffer.empty[BusFrame]

  def waits(id: Int): Boolean = waiting.contains(id)

  /** Exactly this frame waits. */
  def waits(frame: BusFrame): Boolean = waiting.get(frame.id).contains(frame)

  /** A frame of this pipe to this destination waits, one that its sender has made. */
  def waitsOf(destination: Int, pipe: Int): Boolean = waiting.keys.map(FrameId.of).exists { id =>
    id.destination == destination && id.pipe == pipe && (id.isData || id.number <= Code.Close)
  }

  /** Everything leaves a place for what is urgent, data frames leave two more for what must not wait behind
    * them, urgent ones one (TB-04). One place more is there for values, and for a data frame while those to
    * other destinations do not leave, in turn (TB-34).
    */
  def hasRoom(id: FrameId): Boolean = {
    val ids = waiting.keys.map(FrameId.of)
    def isStuck(o: FrameId) =
      o.destination != id.destination && clock.now >= since(o.word) + SlotsModel.StuckUs
    def hasOneMore =
      if (isPart(id)) isTimeOfData && ids.filter(isPart).forall(isStuck) else !isTimeOfData
    def ofData            = (if (id.urgent) 1 else 2) - (if (hasOneMore) 1 else 0)
    val left              = (if (id.urgent) 0 else 1) + (if (id.isData) ofData else 0)
    def isOneOfManyValues = isValue(id) && ids.count(isValue) >= places - 4
    !isHeld(id) && waiting.size + left < places && !isOneOfManyValues
  }

  private def isPart(id: FrameId)  = id.isData && id.pipe != Sizes.ProcessData
  private def isValue(id: FrameId) = id.isData && id.pipe == Sizes.ProcessData

  /** Since when data frames are held back, and then go free: as answers wait (TB-31). */
  private var heldSince = Option.empty[Long]

  private def answers = waiting.keys.map(FrameId.of).filter(_.isAnswer)

  /** How many times have passed: data frames are held back in the first one, go free in the second. */
  private def timesSince(begin: Long) = (clock.now - begin) / p.holdUs

  /** There are times for answers and values, and times for data frames. */
  private def isTimeOfData = heldSince.fold(clock.now / p.holdUs)(timesSince) % 2 == 1

  /** OPEN, too, is held back for an answer before which its data would leave: these would else be taken for
    * sent.
    */
  private def isHeld(id: FrameId) = (isPart(id) || !id.isData && id.number == Code.Open) &&
    heldSince.nonEmpty && !isTimeOfData &&
    answers.exists(a => a.urgent == id.urgent && id.destination < a.destination)

  /** All has been put. When data frames go free, or are held back anew; where one answer follows another the
    * times go on.
    */
  def lookHold(): Long = {
    heldSince = heldSince.filter(_ => answers.nonEmpty)
    heldSince match {
      case Some(begin)                       => begin + (timesSince(begin) + 1) * p.holdUs
      case None if waiting.size + 3 < places => Long.MaxValue
      case None                              => (clock.now / p.holdUs + 1) * p.holdUs
    }
  }

  def put(frame: BusFrame): Unit = {
    waiting(frame.id) = frame
    since(frame.id) = clock.now
    fresh += frame
    if (FrameId.of(frame.id).isAnswer) heldSince = heldSince.orElse(Some(clock.now))
  }

  def left(id: Int): Unit = waiting -= id

  /** Takes back what has waited for too long (TB-27).
    *
    * @param isUnderWay
    *   a frame is of a message that has not ended
    * @param onHello
    *   is called if HELLO is one of them
    * @return
    *   when the next one will have
    */
  def takeBack(isUnderWay: FrameId => Boolean, onHello: () => Unit): Long = {
    val ends =
      for (id <- waiting.keys.toSeq if !isUnderWay(FrameId.of(id)))
        yield id -> (since(id) + p.staleUs(FrameId.of(id)))
    val (stale, others) = ends.partition(_._2 <= clock.now)
    back ++= stale.map(_._1)
    if (stale.exists(s => FrameId.of(s._1).isHello)) onHello()
    others.map(_._2).minOption.getOrElse(Long.MaxValue)
  }

  def drainAborted(): Seq[Int] = {
    val all = back.toList
    back.clear()
    all
  }

  def drain(): Seq[BusFrame] = {
    val all = fresh.toList
    fresh.clear()
    all
  }
}

private object SlotsModel {

  /** Data frames that wait for so long do not leave: half of the time after which their message ends. */
  val StuckUs = 5000000L
}

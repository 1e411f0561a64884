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

  /** Places for data frames, for other frames and for urgent ones are so many that each finds one behind
    * those before it (TB-04).
    */
  def hasRoom(id: FrameId): Boolean =
    !isHeld(id) && waiting.size < (if (id.urgent) places else if (isPart(id)) places - 3 else places - 1)

  private def isPart(id: FrameId) = id.isData && id.pipe != Sizes.ProcessData

  /** Since when data frames are held back, and then go free: as answers wait (TB-31). */
  private var heldSince = Option.empty[Long]

  private def answers = waiting.keys.map(FrameId.of).filter(_.isAnswer)

  /** How many times have passed: data frames are held back in the first one, go free in the second. */
  private def timesSince(begin: Long) = (clock.now - begin) / p.holdUs

  /** OPEN, too, is held back for an answer before which its data would leave: these would else be taken for
    * sent.
    */
  private def isHeld(id: FrameId) = (isPart(id) || !id.isData && id.number == Code.Open) &&
    heldSince.exists(timesSince(_) % 2 == 0) &&
    answers.exists(a => a.urgent == id.urgent && id.destination < a.destination)

  /** All has been put. When data frames go free, or are held back anew; where one answer follows another the
    * times go on.
    */
  def lookHold(): Long = {
    heldSince = heldSince.filter(_ => answers.nonEmpty)
    heldSince.fold(Long.MaxValue)(begin => begin + (timesSince(begin) + 1) * p.holdUs)
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

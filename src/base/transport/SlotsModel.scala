package flyframe.transport

import scala.collection.mutable

/** The frames of a node that wait in its port, each once (TP-06).
  *
  * @param places
  *   how many there may be (TB-04)
  */
private[transport] class SlotsModel(places: Int) {
  private val waiting = mutable.Map.empty[Int, BusFrame]
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
    waiting.size < (if (id.urgent) places
                    else if (id.isData && id.pipe != Sizes.ProcessData) places - 3
                    else places - 1)

  def put(frame: BusFrame): Unit = {
    waiting(frame.id) = frame
    fresh += frame
  }

  def left(id: Int): Unit = waiting -= id

  def drain(): Seq[BusFrame] = {
    val all = fresh.toList
    fresh.clear()
    all
  }
}

package flyframe.can

import scala.collection.mutable

/** Acceptance filters (CAN-43).
  *
  * @param words
  *   value and mask of an entry as they are in force
  */
class CanFiltersModel(count: Int, words: Int => (Int, Int)) {
  import CanFiltersModel.InUse

  /** The lowest entry that matches. */
  def matching(frame: CanFrame): Option[Int] = (0 until count).find { entry =>
    val (value, mask) = words(entry)
    (value & InUse) != 0 && ((value ^ frame.word) & mask & ~InUse) == 0
  }
}

object CanFiltersModel {

  /** Bit 29 of the value. */
  val InUse: Int = 1 << 29
}

/** The FIFO of received frames, 16 bytes each (CAN-44). */
class CanFifoModel(size: Int) {
  private val frames = mutable.Queue.empty[BigInt]

  def level: Int = frames.size

  /** The oldest frame as a number, its first byte lowest; 0 if there is none. */
  def oldest: BigInt = frames.headOption.getOrElse(BigInt(0))

  /** Takes a frame.
    *
    * @return
    *   false if there was no room
    */
  def put(bytes: Seq[Int]): Boolean = {
    val fits = frames.size < size
    if (fits) frames.enqueue(bytes.foldRight(BigInt(0))((byte, above) => above << 8 | byte))
    fits
  }

  def release(): Unit = if (frames.nonEmpty) frames.dequeue()
}

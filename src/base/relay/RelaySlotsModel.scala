package flyframe.relay

import flyframe.can.{CanBridgeSlots, CanFrame}

/** The slots of port F in relay mode: several are on their way at once (FR-55, RB-12).
  *
  * @param frame
  *   the frame in a slot
  */
class RelaySlotsModel(slots: Int, frame: Int => CanFrame) extends CanBridgeSlots {
  private val age    = Array.fill(slots)(0L)
  private val frames = new Array[CanFrame](slots) // of those that are pending
  private var born   = 0L

  /** Maps, a bit per slot. */
  var pending: Int = 0
  var sent: Int    = 0
  var failed: Int  = 0

  /** For tests: a slot is sent, or has failed. */
  var settles: (Int, Boolean) => Unit = (_, _) => ()

  private var begun = 0 // those that have a sequence

  private def bits(map: Int) = (0 until slots).filter(s => (map >> s & 1) == 1)

  def isPending(slot: Int): Boolean = (pending >> slot & 1) == 1
  def isHeld(slot: Int): Boolean    = (begun >> slot & 1) == 1
  def evict(map: Int): Unit         = abort(map)

  def request(map: Int): Unit = {
    val fresh = map & ~pending
    for (slot <- bits(fresh)) {
      age(slot) = born
      born += 1
      frames(slot) = frame(slot)
    }
    pending |= fresh
    sent &= ~fresh
    failed &= ~fresh
  }

  /** Gives up those of `map` that have not begun.
    *
    * @return
    *   those that have
    */
  def abort(map: Int): Int = {
    val waiting = map & pending & ~begun
    pending &= ~waiting
    failed |= waiting
    bits(waiting).foreach(settles(_, false))
    map & pending & begun
  }

  /** All that are pending fail. */
  def drop(): Unit = {
    begun = 0
    abort(pending)
  }

  def pendingFrame(slot: Int): CanFrame = frames(slot)

  /** The slot to begin next, among those whose identifier word is not on its way. */
  def next(isBusy: Int => Boolean): Option[Int] =
    if ((pending & ~begun) == 0) None
    else
      bits(pending & ~begun)
        .filterNot(s => isBusy(frames(s).word))
        .minByOption(s => (frames(s).order, age(s)))

  def begins(slot: Int): Unit = begun |= 1 << slot

  /** A slot that has begun is done. */
  def ends(slot: Int, isSent: Boolean): Unit = {
    begun &= ~(1 << slot)
    pending &= ~(1 << slot)
    if (isSent) sent |= 1 << slot else failed |= 1 << slot
    settles(slot, isSent)
  }
}

package flyframe.can

/** The slots of a port: which wait, which is offered to the engine, and how attempts end (CAN-40, CAN-41,
  * CB-08, CB-12).
  *
  * @param frame
  *   the frame in a slot
  * @param offerCycles
  *   core cycles from a change to the new offer
  */
class CanSlotsModel(slots: Int, frame: Int => CanFrame, offerCycles: Int) extends CanBridgeSlots {
  private val age     = Array.fill(slots)(0L)
  private var born    = 0L
  private var offered = Option.empty[Int]
  private var left    = 0 // cycles until the new offer

  /** Maps, a bit per slot. */
  var pending: Int = 0
  var sent: Int    = 0
  var failed: Int  = 0

  /** The slot on the wire, and whether it is to be aborted. */
  private var active  = Option.empty[Int]
  private var aborted = false

  private def is(map: Int, slot: Int) = (map >> slot & 1) == 1
  private def bits(map: Int)          = (0 until slots).filter(is(map, _))

  private def changes(): Unit = {
    offered = offered.filter(is(pending, _))
    left = offerCycles
  }

  /** `cycles` core cycles pass. */
  def pass(cycles: Int): Unit = if (left > 0) {
    left = (left - cycles) max 0
    if (left == 0) offered = bits(pending).minByOption(s => (frame(s).order, age(s)))
  }

  /** Core cycles up to the next change of the offer; 0: none is under way. */
  def untilOffer: Int = left

  def isPending(slot: Int): Boolean = is(pending, slot)
  def isHeld(slot: Int): Boolean    = active.contains(slot)

  def request(map: Int): Unit = {
    val begun = map & ~pending
    for (slot <- bits(begun)) {
      age(slot) = born
      born += 1
    }
    pending |= begun
    sent &= ~begun
    failed &= ~begun
    if (begun != 0) changes()
  }

  def abort(map: Int): Unit = {
    val onWire = active.fold(0)(1 << _)
    if ((map & onWire) != 0) aborted = true
    drop(map & pending & ~onWire)
  }

  def evict(map: Int): Unit = drop(map & pending & ~active.fold(0)(1 << _))

  private def drop(map: Int): Unit = if (map != 0) {
    failed |= map
    pending &= ~map
    changes()
  }

  /** The slot that is offered. */
  def offer: Option[Int] = offered

  /** The slot offered is on the wire. */
  def begins(): Unit = {
    active = offered
    aborted = false
  }

  /** The slot on the wire has been sent.
    *
    * @return
    *   which it is
    */
  def succeeds(): Int = {
    val slot = active.get
    active = None
    pending &= ~(1 << slot)
    sent |= 1 << slot
    changes()
    slot
  }

  /** The attempt was in vain; it stays pending, unless it was the only one. */
  def fails(oneShot: Boolean): Unit = {
    val slot = active.get
    active = None
    if (aborted || oneShot) drop(1 << slot)
  }
}

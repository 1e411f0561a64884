package flyframe.can

import flyframe.params.CanParams
import flyframe.registers.CanRegisters

/** The slots of a port, as a bridge uses them. */
trait CanBridgeSlots {
  def isPending(slot: Int): Boolean

  /** It is on the wire, or on its way. */
  def isHeld(slot: Int): Boolean
  def request(map: Int): Unit

  /** Takes slots back that are not held. */
  def evict(map: Int): Unit
}

/** Frames of the other port find a slot, or are dropped (BR-01, BR-02).
  *
  * @param slots0
  *   the address of slot 0
  */
class CanBridgeModel(slots: CanBridgeSlots, memory: CanMemoryModel, slots0: Int, records: CanRecords) {
  private def at(slot: Int)    = slots0 + slot * CanRegisters.FrameBytes
  private def frame(slot: Int) = CanFrame.of(memory.bytes(at(slot), CanRegisters.FrameBytes))

  def take(fresh: CanFrame): Unit = {
    val all  = CanParams.BridgeSlots
    val free = all.find(!slots.isPending(_))
    // Of several that are last in CAN order the one in the last slot.
    val last = all.filterNot(slots.isHeld).maxByOption(s => (frame(s).order, s))
    val slot = free.orElse(last.filter(s => fresh.order < frame(s).order))
    if (free.isEmpty) {
      records.dropInBridge()
      slot.foreach(s => slots.evict(1 << s))
    }
    for (s <- slot) {
      val bytes = fresh.bytes()
      memory.put(at(s), bytes.take(5))
      memory.put(at(s) + 8, bytes.drop(8))
      slots.request(1 << s)
    }
  }
}

package flyframe.can

import chisel3._
import chisel3.util._
import flyframe.params.CanParams
import flyframe.ram.RamUse

/** Finds the pending slot that is first in CAN order (CAN-41, CB-08).
  *
  * The slots are listed by age in a block RAM. Whenever the pending ones change, the list is walked, oldest
  * first, and their keys compared; those that are pending still go to a second list, which takes the place of
  * the first when the walk is done. So a walk may be broken off at any time, and begins anew with every
  * change. The frame found before stays on offer meanwhile.
  */
class SlotOrder(p: CanParams) extends Module {
  private val slotBits = log2Ceil(p.slots)

  /** Slots that wait or are being sent; those of them that may begin, see [[SlotStates]]. They have changed,
    * first seen in this cycle: by the host, or late, by a sample, which was taken three cycles ago.
    */
  val pending     = IO(Input(UInt(p.slots.W)))
  val mayBegin    = IO(Input(UInt(p.slots.W)))
  val changedNow  = IO(Input(Bool()))
  val changedLate = IO(Input(Bool()))

  /** It may be a cycle with `changedNow`, which is known early: nothing is appended then. */
  val mayChange = IO(Input(Bool()))

  /** A slot that is about to become pending, as the youngest. It is taken when `appended`. */
  val append   = IO(Input(Valid(UInt(slotBits.W))))
  val appended = IO(Output(Bool()))

  /** Reads the key of a slot, see [[CanOrder]]. If `ready`, it is there in the next cycle. */
  val read  = IO(Output(Valid(UInt(slotBits.W))))
  val ready = IO(Input(Bool()))
  val key   = IO(Input(UInt(32.W)))

  val offer = IO(Output(new Offer))

  /** Block RAM for the list. It belongs to somebody else while this `rests`, and the list is empty then. */
  val ram   = IO(new RamUse(SlotOrder.words(p), slotBits))
  val rests = IO(Input(Bool()))

  private val changed = changedNow || changedLate

  // Reset: both lists are empty, and there is nothing to do.
  private val bank  = RegInit(false.B)
  private val count = RegInit(0.U((slotBits + 1).W)) // of the list in force
  private val walks = RegInit(false.B)
  private val at    = Reg(UInt((slotBits + 1).W))    // the entry that is read next
  private val to    = Reg(UInt((slotBits + 1).W))    // how many go to the other list

  // Two entries are read ahead, so that what is read does not hang on whether a key can be. Reset: none is.
  private val isThere = RegInit(false.B) // an entry
  private val first   = RegInit(0.U.asTypeOf(Valid(UInt(slotBits.W))))
  private val second  = RegInit(0.U.asTypeOf(Valid(UInt(slotBits.W))))
  private val slot    = first.bits
  private val isAtEnd = at === count
  private val wants   = first.valid && pending(slot)
  private val keeps   = wants && ready
  private val stays   = wants && !ready
  private val isRoom  = !(first.valid && second.valid) && !(isThere && (first.valid || second.valid))
  private val reads   = walks && !isAtEnd && isRoom
  read.valid := wants
  read.bits  := slot
  isThere    := reads
  when(reads) { at := at + 1.U }
  when(!stays) {
    first.valid := second.valid || isThere
    first.bits  := Mux(second.valid, second.bits, ram.readData)
  }
  second.valid := isThere && (stays || second.valid) || (stays && second.valid)
  when(isThere) { second.bits := ram.readData }

  // A key comes in the cycle behind its read, in which its slot is kept, and is compared in the next.
  private val comes    = RegNext(keeps && !changed, false.B)
  private val compares = RegNext(comes && !changed, false.B)
  private val thisKey  = RegNext(key)
  private val keptSlot = RegNext(slot)
  private val thisSlot = RegNext(keptSlot)
  private val found    = RegInit(false.B) // the best so far is one; reset: none
  private val bestKey  = Reg(UInt(32.W))
  private val bestSlot = Reg(UInt(slotBits.W))
  private val isDone   = walks && isAtEnd && !isThere && !first.valid && !second.valid && !comes && !compares

  appended        := append.valid && !walks && !mayChange && !changedLate
  ram.readAddress := bank ## at(slotBits - 1, 0)
  // What may be appended next is written behind the list in each cycle: that it is appended is known too late
  // for the memory. Behind a list of all slots is no place, and none to append.
  ram.write        := Mux(walks, comes, !count(slotBits))
  ram.writeAddress := Mux(walks, !bank ## to(slotBits - 1, 0), bank ## count(slotBits - 1, 0))
  ram.writeData    := Mux(walks, keptSlot, append.bits)
  when(appended) { count := count + 1.U }
  when(comes) { to := to + 1.U }
  when(compares && (!found || thisKey < bestKey)) {
    found    := true.B
    bestKey  := thisKey
    bestSlot := thisSlot
  }
  when(isDone) {
    walks := false.B
    bank  := !bank
    count := to
  }
  when(changed) {
    walks := true.B
    bank  := bank
    count := count
  }
  when(changed || rests) {
    isThere      := false.B
    first.valid  := false.B
    second.valid := false.B
    at           := 0.U
    to           := 0.U
    found        := false.B
  }
  when(rests) { count := 0.U }

  // What was found counts a fixed time behind the last change.
  private val waits   = RegInit(0.U(log2Ceil(p.offerCycles + 1).W)) // reset: no change is under way
  private val offered = RegInit(0.U.asTypeOf(new Offer))            // reset: none
  private val due     = waits === 1.U && !walks && !changed
  private val before  = Reg(new Offer)                              // the one that `offered` has replaced
  private val recent = RegInit(0.U(2.W)) // it did so one or two cycles ago; reset: it did not
  recent := recent(0) ## due
  when(!pending(offered.slot)) { offered.valid := false.B }
  when(waits > 1.U || due) { waits := waits - 1.U }
  when(due) {
    before           := offer
    offered.valid    := found
    offered.slot     := bestSlot
    offered.firstBit := bestKey(31)
  }
  when(changedLate) { // it was before one by the host a cycle ago
    waits := Mux(waits === (p.offerCycles - 1).U, (p.offerCycles - 2).U, (p.offerCycles - 3).U)
  }
  when(changedNow) { waits := (p.offerCycles - 1).U }
  when(changedLate && recent.orR) { // the change was first
    offered       := before
    offered.valid := before.valid && pending(before.slot)
  }
  offer       := offered
  offer.valid := offered.valid && mayBegin(offered.slot)
}

object SlotOrder {

  /** Words of its memory; 64 at least, so that it goes to block RAM. */
  def words(p: CanParams): Int = 64 max 2 * p.slots
}

package flyframe.relay

import chisel3._
import chisel3.util._
import flyframe.can.{RelaySide, SlotOrder}
import flyframe.params.CanParams
import flyframe.ram.RamUse

/** An entry of [[SlotList]] as a walk comes by. */
class ListedSlot(slotBits: Int) extends Bundle {
  val slot = UInt(slotBits.W)

  /** Its place, by which its key can be looked up until the next walk. */
  val place = UInt(slotBits.W)

  /** The next one has the same identifier, whatever the kind of frame. */
  val sameAsNext = Bool()
}

/** The slots that are pending, in CAN order, older ones first (FR-55), with their keys, in a block RAM.
  *
  * A walk goes through all of them, one a cycle, and writes those that are kept to a second list, which takes
  * the place of the first one then. A slot that is new is put in its place by the walk. So nothing is ever
  * moved, and nothing needs a register for each slot.
  */
class SlotList(p: CanParams, schedule: Schedule) extends Module {
  import SlotList._
  private val slotBits = log2Ceil(p.slots)

  /** A walk begins; it is over within [[SlotList.walkCycles]], before which no other may begin. */
  val walk = IO(Input(Bool()))

  /** What it comes by; `recordCycles` of the [[Schedule]] later, whether that is kept. */
  val entry = IO(Output(Valid(new ListedSlot(slotBits))))
  val keeps = IO(Input(Bool()))

  /** The slot that it comes by in two cycles, if it does, and the one in the next cycle. */
  val coming = IO(Output(UInt(slotBits.W)))
  val next   = IO(Output(Valid(UInt(slotBits.W))))

  /** A slot that becomes pending. It waits until it is `appended`, which a walk does. */
  val append   = IO(Input(Valid(UInt(slotBits.W))))
  val appended = IO(Output(Bool()))

  /** Reads the key of a slot, see [[flyframe.can.CanOrder]]. If `ready`, it is there in the next cycle. */
  val read  = IO(Output(Valid(UInt(slotBits.W))))
  val ready = IO(Input(Bool()))
  val key   = IO(Input(UInt(KeyBits.W)))

  /** Behind a walk: the key of the entry that had a place in it is there in the next cycle. */
  val look   = IO(Input(UInt(slotBits.W)))
  val looked = IO(Output(UInt(KeyBits.W)))

  /** Block RAM for the list. It belongs to [[flyframe.can.SlotOrder]] in bus mode, when the list is empty. */
  val ram = IO(new RamUse(SlotOrder.words(p), RelaySide.listBits(p)))
  val on  = IO(Input(Bool()))

  private class Word extends Bundle {
    val key  = UInt(KeyBits.W)
    val slot = UInt(slotBits.W)
  }
  private val got = ram.readData.asTypeOf(new Word)

  // Reset: both lists are empty, and there is no walk.
  private val bank  = RegInit(false.B)
  private val count = RegInit(0.U((slotBits + 1).W)) // of the list in force
  private val walks = RegInit(false.B)
  private val at    = RegInit(0.U((slotBits + 1).W)) // the place to be read
  private val to    = RegInit(0.U((slotBits + 1).W)) // how many have been written
  private val reads = (walk || walks) && at =/= count

  // A place is read in a cycle, in the next its word is there. In the fourth the entry comes by. When it is
  // known whether it is kept it is written to the second list or held: if it is not kept, the next one takes
  // its place.
  private val comes     = RegNext(reads && on, false.B)
  private val comesAt   = RegNext(at(slotBits - 1, 0))
  private val passes    = RegNext(comes && on, false.B)
  private val passing   = RegNext(got)
  private val passingAt = RegNext(comesAt)
  // In parts, as the way from the memory has no time for all of it.
  private val differs = (passing.key ^ got.key) & ~Kinds.U(KeyBits.W)
  private val isSame  = (0 until KeyBits by 2).map(i => RegNext(comes && !differs(i + 1, i).orR))
  when(reads) { at := at + 1.U }
  coming                := got.slot
  next.valid            := passes
  next.bits             := passing.slot
  entry.valid           := RegNext(passes && on, false.B)
  entry.bits.slot       := RegNext(passing.slot)
  entry.bits.place      := RegNext(passingAt)
  entry.bits.sameAsNext := isSame.reduce(_ && _)

  // The new slot, and, once it is in its place, the entry that comes by: it is written only when it is kept.
  private val held    = Reg(new Word)
  private val isAsked = RegInit(false.B)                            // for the key; reset: no slot is new
  private val isHeld  = RegInit(false.B)
  private val joins   = RegInit(false.B)                            // it is put in its place by this walk
  private val isIn    = RegInit(false.B)                            // it is there
  private val isNew   = RegNext(append.valid && !appended, false.B) // as it is known late in its cycle
  read.valid := isNew && !isAsked && !isHeld
  read.bits  := append.bits
  isAsked    := read.valid && ready
  when(isAsked) {
    isHeld    := true.B
    held.key  := key
    held.slot := append.bits
  }
  when(walk) {
    walks := true.B
    joins := isHeld
  }

  private def late[T <: Data](signal: T): T = ShiftRegister(signal, schedule.recordCycles)
  private val isBy =
    ShiftRegister(entry.valid && on, schedule.recordCycles, false.B, true.B) // reset: no walk
  private val by     = late(RegNext(passing))
  private val wasBy  = RegNext(isBy, false.B) // reset: no walk
  private val isKept = RegNext(isBy && keeps && on, false.B)
  // From the first read of a walk to the last entry there is always one under way.
  private val isOver = walks && !comes && !passes && !entry.valid && !isBy && !wasBy
  private val isLess = late(RegNext(held.key < passing.key))
  private val first  = joins && !isIn && isBy && isLess // the new slot is in front of it
  private val isLast = joins && !isIn && isOver
  private val behind = Mux(isKept, to + 1.U, to)
  when(first || (isIn && isBy)) { held := by }
  when(first) { isIn := true.B }
  appended         := isOver && joins
  ram.readAddress  := Mux(reads, bank ## at(slotBits - 1, 0), (bank ^ !walks) ## look)
  ram.write        := Mux(isIn, isKept, isBy || isLast)
  ram.writeAddress := !bank ## Mux(isIn, to, behind)(slotBits - 1, 0)
  ram.writeData    := Mux(isIn || first || isLast, held, by).asUInt
  to               := Mux(first, behind + 1.U, behind)
  when(isOver) {
    walks  := false.B
    joins  := false.B
    isIn   := false.B
    isHeld := isHeld && !joins
    bank   := !bank
    count  := to + isLast
    at     := 0.U
    to     := 0.U
  }
  looked := got.key
  when(!on) {
    walks  := false.B
    joins  := false.B
    isIn   := false.B
    isHeld := false.B
    count  := 0.U
    at     := 0.U
    to     := 0.U
  }
}

object SlotList {
  val KeyBits = 32

  /** Bits of a key that tell the kind of a frame: those of remote frames with either identifier. */
  private val Kinds = 1 << 20 | 1

  /** How long a walk takes, its first cycle counted. */
  def walkCycles(p: CanParams, schedule: Schedule): Int = p.slots + 5 + schedule.recordCycles
}

package flyframe.relay

import chisel3._
import chisel3.util._
import flyframe.params.CanParams

/** An entry of the list of own frames, as it is behind what has happened. */
class OwnEntry(slotBits: Int) extends Bundle {
  val listed = new ListedSlot(slotBits)

  /** It stays in the list; it has a sequence, of which these are the low bits; copies that have not begun. */
  val kept     = Bool()
  val begun    = Bool()
  val sequence = UInt(OwnRecord.SequenceBits.W)
  val waits    = Vec(2, Bool())
}

/** The own frame that is next at a port. */
class OwnNext(slotBits: Int) extends Bundle {
  val slot  = UInt(slotBits.W)
  val place = UInt(slotBits.W) // in the list

  /** It has no sequence yet; else the low bits of its sequence. */
  val isNew    = Bool()
  val sequence = UInt(OwnRecord.SequenceBits.W)
}

/** Which own frame is next at each port (FR-55): the first in the list of which a copy waits there, or that
  * may get a sequence. That is the first one without, in front of which none of the same identifier has one.
  */
class OwnChoice(p: CanParams) extends Module {
  private val slotBits = log2Ceil(p.slots)

  /** The list is walked anew; it has come to its end. */
  val begins = IO(Input(Bool()))

  /** In the order of the list. */
  val entry = IO(Input(Valid(new OwnEntry(slotBits))))

  /** New frames may begin; the low bits of the next sequence. */
  val mayBegin     = IO(Input(Bool()))
  val nextSequence = IO(Input(UInt(OwnRecord.SequenceBits.W)))

  /** What is next, from the end of the list on. */
  val next = IO(Output(Vec(2, Valid(new OwnNext(slotBits)))))

  private val it = entry.bits

  // Frames of one identifier are side by side. No reset: a walk begins before anything is looked at.
  private val isSame   = Reg(Bool())                // as the one in front
  private val isBegun  = Reg(Bool())                // one with this identifier has a sequence
  private val has      = Reg(Bool())                // the first one without a sequence
  private val fresh    = Reg(new OwnNext(slotBits))
  private val isPast   = Reg(Bool())                // those with its identifier
  private val isFull   = Reg(Bool())                // the sequences are used up (RB-16)
  private val hasOld   = Reg(Vec(2, Bool()))
  private val old      = Reg(Vec(2, new OwnNext(slotBits)))
  private val isBehind = Reg(Vec(2, Bool()))        // it comes behind `fresh`
  private val passed   = isPast || (has && !isSame) // in this cycle
  private val taken    = isSame && isBegun

  private val now = Wire(new OwnNext(slotBits))
  now.slot     := it.listed.slot
  now.place    := it.listed.place
  now.isNew    := !it.begun
  now.sequence := it.sequence

  when(entry.valid) {
    isSame  := it.listed.sameAsNext
    isBegun := taken || (it.kept && it.begun)
    isPast  := passed
    when(it.kept && it.begun) {
      when(!passed) { has := false.B } // then it has the identifier of `fresh`, if there is one
      when(it.sequence === nextSequence) { isFull := true.B }
      for (p <- 0 to 1) when(it.waits(p)) { hasOld(p) := true.B }
    }
    when(it.kept && !it.begun && !passed && !has && !taken) { has := true.B }
    // Written until there is one: that this entry is one is known too late to ask for it here.
    when(!has) { fresh := now }
    for (p <- 0 to 1) when(!hasOld(p)) {
      old(p)      := now
      isBehind(p) := passed
    }
  }
  when(begins) {
    isSame := false.B
    has    := false.B
    isPast := false.B
    isFull := false.B
    hasOld := VecInit(false.B, false.B)
  }
  for (p <- 0 to 1) {
    val isNew = mayBegin && has && !isFull && !(hasOld(p) && !isBehind(p))
    next(p).valid := isNew || hasOld(p)
    next(p).bits  := Mux(isNew, fresh, old(p))
  }
}

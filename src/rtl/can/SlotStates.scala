package flyframe.can

import chisel3._
import chisel3.util._
import flyframe.params.CanParams

/** What relay mode does with slots: several may be on their way at once. */
class RelaySlots(p: CanParams) extends Bundle {

  /** Slots on their way; one that is done, and whether it was sent; all that are pending fail (RB-25). */
  val begun = UInt(p.slots.W)
  val ends  = Valid(UInt(log2Ceil(p.slots).W))
  val sent  = Bool()
  val drops = Bool()
}

/** Which slots are pending, which have been sent, which have failed (CAN-40, CB-04, CB-12).
  *
  * @param hasRelay
  *   there is relay mode, too
  */
class SlotStates(p: CanParams, hasRelay: Boolean = false) extends Module {
  private val bridgeSlots = CanParams.BridgeSlots
  private val slotBits    = log2Ceil(p.slots)

  val relay: Option[RelaySlots] = Option.when(hasRelay)(IO(Input(new RelaySlots(p))).suggestName("relay"))

  val oneShot = IO(Input(Bool()))

  /** Orders of the host. A slot that is requested becomes pending in the next cycle. */
  val request     = IO(Input(Valid(UInt(slotBits.W))))
  val abort       = IO(Input(UInt(p.slots.W)))
  val clearSent   = IO(Input(UInt(p.slots.W)))
  val clearFailed = IO(Input(UInt(p.slots.W)))

  /** From [[ProtocolEngine]]: this slot is begun; its attempt is over, and went well. */
  val takes = IO(Input(Valid(UInt(slotBits.W))))
  val ends  = IO(Input(Bool()))
  val sent  = IO(Input(Bool()))

  /** A bridge takes slots back that are not on the wire; those that are, at this moment. */
  val evict: Option[UInt] = Option.when(p.bridge)(IO(Input(UInt(bridgeSlots.size.W))))
  val held: Option[UInt]  = Option.when(p.bridge)(IO(Output(UInt(bridgeSlots.size.W))))

  val pending   = IO(Output(UInt(p.slots.W)))
  val sentAll   = IO(Output(UInt(p.slots.W)))
  val failedAll = IO(Output(UInt(p.slots.W)))

  /** The slot that is or was on the wire. */
  val current = IO(Output(UInt(slotBits.W)))

  /** A slot has left `pending`, first seen in this cycle: by an abort, or by the end of an attempt. */
  val aborted = IO(Output(Bool()))
  val ended   = IO(Output(Bool()))

  // Reset: nothing is to be sent.
  private val waits  = RegInit(0.U(p.slots.W))
  private val well   = RegInit(0.U(p.slots.W))
  private val badly  = RegInit(0.U(p.slots.W))
  private val onWire = RegInit(false.B)
  private val aborts = RegInit(false.B) // the one on the wire
  private val last   = Reg(UInt(slotBits.W))
  private val isOnIt = onWire || takes.valid

  // The slot that is begun or was begun last, or, in relay mode, the one that is done. An attempt ends long
  // behind its beginning. An order to abort it counts up to that cycle.
  private val ofRelay    = relay.fold(false.B)(_.ends.valid)
  private val slot       = Mux(takes.valid, takes.bits, last)
  private val one        = UIntToOH(relay.fold(slot)(r => Mux(ofRelay, r.ends.bits, slot)), p.slots)
  private val abortsIt   = (aborts && !takes.valid) || (abort & one).orR
  private val over       = ends && (sent || oneShot || abortsIt)
  private val onIt       = Mux(isOnIt, one, 0.U)
  private val goes       = abort | evict.fold(0.U)(_ << bridgeSlots.start)
  private val mayGo      = goes & waits & ~onIt
  private val gone       = relay.fold(mayGo)(r => (mayGo & ~r.begun) | Mux(r.drops, waits, 0.U))
  private val doneOne    = Mux(over || ofRelay, one, 0.U)
  private val isWell     = relay.fold(sent)(r => Mux(ofRelay, r.sent, sent))
  private val requestOne = Mux(request.valid, UIntToOH(request.bits, p.slots), 0.U)
  waits  := (waits & ~gone & ~doneOne) | requestOne
  well   := (well & ~clearSent & ~requestOne) | Mux(isWell, doneOne, 0.U)
  badly  := (badly & ~clearFailed & ~requestOne) | gone | Mux(isWell, 0.U, doneOne)
  last   := Mux(takes.valid, takes.bits, last)
  onWire := isOnIt && !ends
  aborts := isOnIt && !ends && abortsIt

  held.foreach(_ := ((onIt | relay.fold(0.U(p.slots.W))(_.begun)) >> bridgeSlots.start))

  pending   := waits
  sentAll   := well
  failedAll := badly
  current   := last
  aborted   := RegNext(gone.orR, false.B)
  ended     := RegNext(over || ofRelay, false.B)
}

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

  /** It is decided which slots begin: none is given up or taken back. */
  val holds = Bool()
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

  /** Orders of the host. A slot that is requested becomes pending in the next cycle; one that is aborted or
    * taken back, or whose attempt is over, is pending for one cycle more.
    */
  val request     = IO(Input(Valid(UInt(slotBits.W))))
  val abort       = IO(Input(UInt(p.slots.W)))
  val clearSent   = IO(Input(UInt(p.slots.W)))
  val clearFailed = IO(Input(UInt(p.slots.W)))

  /** From [[ProtocolEngine]]: this slot is begun; its attempt is over, and went well. */
  val takes = IO(Input(Valid(UInt(slotBits.W))))
  val ends  = IO(Input(Bool()))
  val sent  = IO(Input(Bool()))

  /** A bridge takes slots back that are not on the wire; those that are, as far as is known: one that begins
    * in this cycle stays, too.
    */
  val evict: Option[UInt] = Option.when(p.bridge)(IO(Input(UInt(bridgeSlots.size.W))))
  val held: Option[UInt]  = Option.when(p.bridge)(IO(Output(UInt(bridgeSlots.size.W))))

  /** Slots that are pending; those of them that may begin, as they were so before and are not given up in
    * this cycle.
    */
  val pending   = IO(Output(UInt(p.slots.W)))
  val mayBegin  = IO(Output(UInt(p.slots.W)))
  val sentAll   = IO(Output(UInt(p.slots.W)))
  val failedAll = IO(Output(UInt(p.slots.W)))

  /** The slot that is or was on the wire. */
  val current = IO(Output(UInt(slotBits.W)))

  /** A slot leaves `pending` with this cycle: by an abort, or by the end of an attempt. */
  val aborted = IO(Output(Bool()))
  val ended   = IO(Output(Bool()))

  /** In bus mode, where nobody `holds`, the same as `aborted`, and known early in the cycle; with a switch of
    * the mode also if nothing is pending.
    */
  val mayAbort = IO(Output(Bool()))

  /** Slots may leave `pending` so; known early. */
  val mayLeave = IO(Output(Bool()))

  // Reset: nothing is to be sent.
  private val waits  = RegInit(0.U(p.slots.W))
  private val well   = RegInit(0.U(p.slots.W))
  private val badly  = RegInit(0.U(p.slots.W))
  private val onWire = RegInit(false.B)
  private val aborts = RegInit(false.B) // the one on the wire
  private val last   = Reg(UInt(slotBits.W))

  // The slot that is begun or was begun last. An attempt ends long behind its beginning. An order to abort it
  // counts from the cycle in which it is begun to that in which it ends.
  private val isNew    = RegNext(takes.valid, false.B)
  private val ofBegin  = Mux(isNew, RegNext(abort), 0.U) // an order in the cycle in which it was begun
  private val abortsIt = (aborts && !isNew) || (abort | ofBegin)(last)
  private val drops    = relay.fold(false.B)(_.drops)
  when(takes.valid) { last := takes.bits }
  onWire := (onWire || takes.valid) && !ends && !drops
  aborts := onWire && !ends && abortsIt

  // What is given up is told a cycle later from what was begun meanwhile. Reset: nothing leaves.
  private val givenUp = abort | evict.fold(0.U)(_ << bridgeSlots.start)
  private val leaves  = RegNext(givenUp, 0.U(p.slots.W))
  private val isOver  = RegNext(onWire && ends && !drops, false.B) && RegNext(sent || oneShot || abortsIt)
  private val isSent  = RegNext(sent)
  private val ofRelay = relay.fold(false.B)(_.ends.valid)
  private val one     = UIntToOH(relay.fold(last)(r => Mux(ofRelay, r.ends.bits, last)), p.slots)
  private val doneOne = Mux(isOver || ofRelay, one, 0.U)
  private val onIt    = Mux(onWire || isOver || ofRelay, one, 0.U)
  private val mayGo   = leaves & waits & ~onIt
  private val gone =
    relay.fold(mayGo)(r => Mux(r.holds, 0.U, mayGo & ~r.begun) | Mux(drops, waits & ~doneOne, 0.U))
  private val isWell     = relay.fold(isSent)(r => Mux(ofRelay, r.sent, isSent))
  private val requestOne = Mux(request.valid, UIntToOH(request.bits, p.slots), 0.U)
  private val stays      = waits & ~gone & ~doneOne
  waits := stays | requestOne
  well  := (well & ~clearSent & ~requestOne) | Mux(isWell, doneOne, 0.U)
  badly := (badly & ~clearFailed & ~requestOne) | gone | Mux(isWell, 0.U, doneOne)

  held.foreach { h =>
    val onBus = Mux(onWire, UIntToOH(last, p.slots), 0.U)
    h := (onBus | relay.fold(0.U(p.slots.W))(_.begun)) >> bridgeSlots.start
  }

  pending   := waits
  sentAll   := well
  failedAll := badly
  current   := last
  mayBegin  := RegNext(stays & ~givenUp, 0.U(p.slots.W)) // reset: nothing is to be sent
  aborted   := gone.orR
  mayAbort  := mayGo.orR || drops
  mayLeave  := RegNext(givenUp.orR, false.B) || drops
  ended     := isOver || RegNext(ofRelay, false.B)
}

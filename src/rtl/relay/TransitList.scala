package flyframe.relay

import chisel3._
import chisel3.util._

/** Which slots of the transit buffer of an output wait, and in which order (FR-48, RB-08).
  *
  * The list has each slot once: first those that wait, of these first those whose identifier is there, in CAN
  * order, then the others, older ones first; behind them those that are free, and in the last place the one
  * that leaves or has left last. So nothing needs to be kept of a slot, and all are free at once.
  */
class TransitList extends Module {
  import TransitList._

  /** A frame waits in `fresh`; its identifier is not there yet. */
  val put   = IO(Input(Bool()))
  val fresh = IO(Output(UInt(SlotBits.W)))

  /** The frame that is meant: whether it waits; it gets this place among those whose identifier is there; it
    * waits no more.
    */
  val slot   = IO(Input(UInt(SlotBits.W)))
  val waits  = IO(Output(Bool()))
  val ranks  = IO(Input(Valid(UInt(CountBits.W))))
  val remove = IO(Input(Bool()))

  /** The first one leaves; nothing waits any more. */
  val take = IO(Input(Bool()))
  val drop = IO(Input(Bool()))

  /** How many wait, and of how many of these the identifier is there. */
  val size  = IO(Output(UInt(CountBits.W)))
  val known = IO(Output(UInt(CountBits.W)))
  val slots = IO(Output(Vec(Most, UInt(SlotBits.W))))

  /** The one that leaves. */
  val leaving = IO(Output(UInt(SlotBits.W)))

  // Reset: nothing waits.
  private val list     = RegInit(VecInit(Seq.tabulate(Most + 1)(_.U(SlotBits.W))))
  private val sizeReg  = RegInit(0.U(CountBits.W))
  private val knownReg = RegInit(0.U(CountBits.W))

  private val isIt   = (0 until Most).map(i => list(i) === slot && i.U < sizeReg)
  private val behind = isIt.scanLeft(false.B)(_ || _) // `slot` has an earlier place
  private val at     = OHToUInt(isIt)

  fresh   := VecInit(list.take(Most))(sizeReg(CountBits - 2, 0))
  waits   := isIt.reduce(_ || _)
  size    := sizeReg
  known   := knownReg
  slots   := VecInit(list.take(Most))
  leaving := list(Most)

  private val removes = remove && waits
  for (i <- 0 until Most) {
    val isLast = i == Most - 1
    when(take || (removes && (behind(i) || isIt(i)))) {
      list(i) := (if (isLast) Mux(take, list(Most), slot) else list(i + 1))
    }
    when(ranks.valid && waits && !behind(i)) {
      when(i.U === ranks.bits) { list(i) := slot }
      if (i > 0) when(i.U > ranks.bits) { list(i) := list(i - 1) }
    }
  }
  when(take) { list(Most) := list(0) }

  when(put) { sizeReg := sizeReg + 1.U }
  when(take || removes) { sizeReg := sizeReg - 1.U }
  when((take && knownReg =/= 0.U) || (removes && at < knownReg)) { knownReg := knownReg - 1.U }
  when(ranks.valid && waits) { knownReg := knownReg + 1.U }
  when(drop) {
    sizeReg  := 0.U
    knownReg := 0.U
  }
}

object TransitList {

  /** Frames that may wait. */
  val Most      = 8
  val SlotBits  = 4
  val CountBits = 4
}

package flyframe.relay

import chisel3._
import chisel3.util._
import flyframe.can.CanName
import flyframe.ram.DualPortRam

/** The pins of [[TransitLists]]. */
abstract class TransitListsPins extends Module {
  import TransitLists._

  /** Of each receiver: the identifier of the frame that comes, until it is taken. */
  val names = IO(Input(Vec(2, Valid(new CanName))))
  val taken = IO(Output(Vec(2, Bool())))

  /** The receiver and the output that are meant in this cycle; how many wait there, and of how many of these
    * the identifier is there.
    */
  val port  = IO(Input(UInt(1.W)))
  val out   = IO(Input(UInt(1.W)))
  val size  = IO(Output(UInt(CountBits.W)))
  val known = IO(Output(UInt(CountBits.W)))

  /** Asks for a slot that is free: it is `slot` a cycle later (or two, see [[Schedule]]). If it is `put`
    * then, a frame waits in it, whose identifier is not there yet.
    */
  val asks = IO(Input(Bool()))
  val put  = IO(Input(Bool()))

  /** A walk begins: the frame in `it`, which waits, gets its place by the identifier of `port`; or it waits
    * no more. It takes `walkCycles` of the [[Schedule]], in which nothing else may be ordered but a `drop`;
    * the number of identifiers is right a cycle later.
    */
  val ranks   = IO(Input(Bool()))
  val removes = IO(Input(Bool()))
  val it      = IO(Input(UInt(SlotBits.W)))

  /** Looks at the first one of an output: two cycles later (or three) it is `first`, and told whether a frame
    * with the order of two cycles before would be before it. If there is a `take` then, it leaves; that
    * output is `out` in the cycle before.
    */
  val looks    = IO(Input(Valid(UInt(1.W))))
  val order    = IO(Input(UInt(KeyBits.W)))
  val isBefore = IO(Output(Bool()))
  val take     = IO(Input(Bool()))
  val first    = IO(Output(UInt(SlotBits.W)))
  val slot     = IO(Output(UInt(SlotBits.W)))

  /** The slots that leave. */
  val leaving = IO(Output(Vec(2, UInt(SlotBits.W))))

  /** Nothing waits at an out any more. */
  val drop = IO(Input(Vec(2, Bool())))
}

/** Which slots of the transit buffers wait, and in which order, for both outputs (FR-48, RB-08, RB-28).
  *
  * The list of an output has its slots once each, in a block RAM: first those that wait, of these first those
  * whose identifier is there, in transit order, then the others, older ones first; behind them those that are
  * free. The one that leaves, or has left last, is in none. So nothing needs to be kept of a slot, all are
  * free at once, and one walk at a time moves the entries between two places by one.
  *
  * @param schedule
  *   whether there is time for a register behind the RAM
  */
class TransitLists(schedule: Schedule) extends TransitListsPins {
  import TransitLists._

  /** What goes with an entry, behind the register of the RAM if there is one. */
  private def late[T <: Data](signal: T): T = ShiftRegister(signal, schedule.entryCycles - 1)

  private class Entry extends Bundle {
    val slot = UInt(SlotBits.W)
    val key  = UInt(KeyBits.W)
  }
  private val ram = DualPortRam(Words, SlotBits + KeyBits)(clock)

  // A frame is removed from the list in whose last place a walk writes in this cycle: the memory gives the
  // old word of that place. The slot that is written is taken instead; its key stays `held`. Reset: it is
  // not.
  private val meets   = WireDefault(false.B)
  private val hasMet  = RegNext(meets, false.B)
  private val metSlot = Reg(UInt(SlotBits.W))
  private val word    = WireDefault(ram.io.readData.asTypeOf(new Entry))
  when(hasMet) { word.slot := metSlot }
  private val got = late(word)

  // Where a list begins in its half of 16 places, which it goes round. Reset: nothing waits, the lists are
  // written anew.
  private val firsts   = RegInit(VecInit(Seq.fill(2)(0.U(PlaceBits.W))))
  private val sizes    = RegInit(VecInit(Seq.fill(2)(0.U(CountBits.W))))
  private val knowns   = RegInit(VecInit(Seq.fill(2)(0.U(CountBits.W))))
  private val leavings = RegInit(VecInit(Seq.fill(2)(Most.U(SlotBits.W))))
  private val writing  = RegInit(0.U((PlaceBits + 2).W))
  private val isReady  = writing(PlaceBits + 1)
  when(!isReady) { writing := writing + 1.U }

  // ---- the walk: up from the first place, or down from the last one, to that of the slot ----

  private val held      = Reg(new Entry)                 // what the place at hand gets
  private val walks     = RegInit(false.B)               // reset: no walk
  private val isFirst   = Reg(Bool())                    // the cycle behind the read of the key
  private val isDown    = Reg(Bool())
  private val of        = Reg(UInt(1.W))                 // the output
  private val sought    = Reg(UInt(SlotBits.W))
  private val index     = Reg(UInt(CountBits.W))
  private val moves     = Reg(Bool())                    // from the place at hand on
  private val isCounted = Reg(Bool())                    // nothing was dropped meanwhile
  private val isThere   = late(isFirst)                  // the key
  private val reads     = Wire(Bool())                   // an entry
  private val sees      = RegInit(false.B)               // it is there; reset: none
  private val offset    = Wire(UInt(CountBits.W))        // the place that is read
  private val seenAt    = RegNext(late(offset))
  private val isKnown   = seenAt < knowns(of)            // it has an identifier
  private val isLess    = (held.key -& got.key)(KeyBits) // by a carry chain
  private val shifts    = sees && (moves || !isKnown || isLess)
  private val ends      = sees && got.slot === sought
  reads := (walks && !ends) || removes
  // What was read behind the one that is sought is not seen. Reset: no walk.
  sees := (if (schedule.isLong) RegNext(reads, false.B) && !ends else reads)
  when(walks) {
    isFirst := false.B
    index   := Mux(isDown, index - 1.U, index + 1.U)
  }
  when(isThere || shifts) {
    held.slot := Mux(isThere, sought, got.slot)
    when(!meets && !late(hasMet)) { held.key := got.key }
  }
  when(shifts) { moves := true.B }
  when(ends) { walks := false.B }
  when(ends && isCounted) {
    knowns(of) := Mux(isDown, knowns(of) - isKnown, knowns(of) + 1.U)
    sizes(of)  := sizes(of) - isDown
  }
  when(ranks || removes) {
    walks     := true.B
    isFirst   := ranks // else the first place is read in this cycle already
    isDown    := removes
    of        := out
    sought    := it
    index     := Mux(removes, size - 2.U, 0.U)
    moves     := removes
    isCounted := true.B
  }
  when(removes) {
    meets     := sees && of === out // only the walk of a rank through a full list is not over by now
    metSlot   := held.slot
    held.slot := it
  }
  when(late(looks.valid)) { held.key := order }

  // ---- what comes and leaves ----

  size    := sizes(out)
  known   := knowns(out)
  slot    := got.slot
  leaving := leavings
  private val outThen   = RegNext(out)
  private val sizeThen  = RegNext(size)
  private val knownThen = RegNext(known)
  first    := RegNext(got.slot)
  isBefore := RegNext(isLess)
  when(put) { sizes(out) := size + 1.U }
  when(take) {
    leavings(outThen) := first
    firsts(outThen)   := firsts(outThen) + 1.U
    sizes(outThen)    := sizeThen - 1.U
    knowns(outThen)   := knownThen - knownThen.orR
  }
  for (p <- 0 to 1) when(drop(p)) {
    sizes(p)  := 0.U
    knowns(p) := 0.U
    isCounted := false.B
  }

  // ---- the memory: both lists, then an identifier of each receiver ----

  private val readOf    = Mux(looks.valid, looks.bits, Mux(asks || removes, out, of))
  private val readPlace = firsts(readOf) + offset
  offset := Mux(removes, size - 1.U, Mux(asks, size, Mux(looks.valid, 0.U, index)))
  ram.io.readAddress :=
    Mux(ranks, 1.U(1.W) ## port ## 0.U(PlaceBits.W), 0.U(1.W) ## readOf ## readPlace)

  private val seenPlace = RegNext(late(readPlace))
  private val isFree    = isReady && !sees && !take
  private val named     = Mux(names(0).valid, names(0).bits, names(1).bits)
  taken(0)     := isFree && names(0).valid
  taken(1)     := isFree && names(1).valid && !names(0).valid
  ram.io.write := Mux(sees, shifts, !isFree || names(0).valid || names(1).valid)
  ram.io.writeAddress := Mux(
    isFree,
    1.U(1.W) ## !names(0).valid ## 0.U(PlaceBits.W),
    Mux(
      sees,
      0.U(1.W) ## of ## seenPlace,
      Mux(take, 0.U(1.W) ## outThen ## (firsts(outThen) ^ Most.U), writing(PlaceBits, 0))
    )
  )
  ram.io.writeData := Mux(sees, held.slot, Mux(take, leavings(outThen), writing(SlotBits - 1, 0))) ##
    Mux(sees, held.key, inTransit(named.order))
}

object TransitLists {

  /** Frames that may wait at an output. */
  val Most      = 8
  val SlotBits  = 4
  val CountBits = 4
  val KeyBits   = 32

  /** The transit order: all of the second half are equal; an own one that is late is before them (RB-28). */
  def inTransit(order: UInt, isLate: Bool = false.B): UInt =
    Mux(order(KeyBits - 1), !isLate ## Fill(KeyBits - 1, isLate), order)

  private val PlaceBits = 4
  private val Words     = 64
}

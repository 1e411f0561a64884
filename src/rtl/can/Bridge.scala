package flyframe.can

import chisel3._
import chisel3.util._
import flyframe.params.CanParams
import flyframe.registers.CanRegisters

/** A port as the one from which frames are bridged; from its side.
  *
  * @param waits
  *   it may have the next frame soon, and waits with that; on a bus there is time enough
  */
class BridgeFrom(p: CanParams, waits: Boolean) extends Bundle {
  private val placeBits = ReceiveFifo.placeBits(p.rxFrames)

  /** A frame for the bridge is complete at this place of the FIFO, whether the FIFO had room or not. */
  val taken = Output(Valid(UInt(placeBits.W)))

  /** Reads a word of the FIFO. If `ready`, it is there in the next cycle. */
  val read  = Input(Valid(UInt((placeBits + 2).W)))
  val ready = Output(Bool())
  val data  = Output(UInt(32.W))

  /** The bridge reads a frame, or has another one to read: no other may be stored. */
  val busy = Option.when(waits)(Input(Bool()))
}

/** A port as the one to which frames are bridged; from its side. */
class BridgeInto(p: CanParams) extends Bundle {
  private val slots = CanParams.BridgeSlots.size

  /** Of the slots of the bridge: which wait, and which are on the wire or on their way. */
  val pending = Output(UInt(slots.W))
  val held    = Output(UInt(slots.W))

  /** Takes a slot back that waits and is not held: two cycles later it is seen whether it was. */
  val evict = Input(UInt(slots.W))

  /** To [[PortMemory]], and the word that was read, as a key of [[CanOrder]]. */
  val job  = Input(Valid(new MemoryJob))
  val done = Output(Bool())
  val key  = Output(UInt(32.W))

  /** This slot is to become pending, until it is `appended`. */
  val append   = Input(Valid(UInt(log2Ceil(p.slots).W)))
  val appended = Output(Bool())
}

/** Puts frames that one CAN port has accepted into slots of the other (BR-01 to BR-03). Where all of these
  * slots are taken, the frame last in CAN order is dropped, and counted: the new one, or one that waits.
  *
  * @param waits
  *   see [[BridgeFrom]]
  */
class Bridge(p: CanParams, waits: Boolean = false) extends Module {
  private val first   = CanParams.BridgeSlots.start
  private val ownBits = log2Ceil(CanParams.BridgeSlots.size)

  val from = IO(Flipped(new BridgeFrom(p, waits)))
  val into = IO(Flipped(new BridgeInto(p)))

  private object Step extends ChiselEnum {
    val idle, reads, comes, chooses, searches, looks, compares, evicts, leaves, evicted, copies, asks,
        counts = Value
  }
  private val step  = RegInit(Step.idle) // reset: nothing is to be done
  private val place = Reg(UInt(ReceiveFifo.placeBits(p.rxFrames).W))
  private val part  = Reg(UInt(2.W))     // the word of the frame
  private val word  = Reg(UInt(32.W))
  private val slot  = Reg(UInt(ownBits.W))
  private val drops = Reg(Bool())        // a frame is to be counted
  private val more  = RegInit(false.B)   // another one has been taken meanwhile; reset: none

  // The search for the one that is last in CAN order.
  private val at      = Reg(UInt(ownBits.W))
  private val found   = Reg(Bool())
  private val lastKey = Reg(UInt(32.W))
  private val isLast  = at.andR
  private val skips   = into.held(at)
  private val isFree  = !into.pending(at)
  private val isGone  = !into.pending(slot)

  private def address(slot: UInt, part: UInt) = PortMemory.Slots.U(2.W) ## (first / 8).U(1.W) ## slot ## part

  // That a slot is appended may take as long as other frames need to come.
  private val isRead = step === Step.idle || step === Step.asks || step === Step.counts
  from.busy.foreach(_ := !isRead || more)
  from.read.valid := step === Step.reads
  from.read.bits  := place ## part

  private val counter = PortMemory.register(CanRegisters.BridgeDropped)
  private val counts  = step === Step.counts
  private val looks   = step === Step.looks
  private val target  = Mux(counts, counter, address(Mux(looks, at, slot), Mux(looks, 0.U, part)))
  into.job.valid       := step === Step.copies || counts || looks
  into.job.bits.source := target
  into.job.bits.target := target
  into.job.bits.write  := !looks
  into.job.bits.counts := counts
  into.job.bits.wide   := false.B
  // Beside the DLC there is the time stamp.
  into.job.bits.bytes := Mux(counts || part === 1.U, 1.U, Fill(4, !looks))
  into.job.bits.data  := Mux(part === 1.U, word(3, 0), word)
  into.append.valid   := step === Step.asks
  into.append.bits    := (first / 8).U(1.W) ## slot
  // The new frame is in front of the one that was found.
  private val isBetter = RegNext(found && CanOrder(word) < lastKey)
  into.evict := Mux(step === Step.evicts && isBetter, UIntToOH(slot), 0.U)

  /** The word of the frame that is there goes to `slot`, then the others do. */
  private def copy(to: UInt): Unit = {
    slot := to
    step := Step.copies
  }
  private def search(): Unit = {
    at    := 0.U
    found := false.B
    step  := Step.searches
  }
  private def goOn(): Unit = {
    at   := at + 1.U
    step := Mux(isLast, Step.compares, Step.searches)
  }

  private val goesOn = more || from.taken.valid
  when(isRead && from.taken.valid) {
    place := from.taken.bits
    more  := true.B
  }
  private def next(): Unit = {
    part  := 0.U
    drops := false.B
    more  := false.B
    step  := Mux(goesOn, Step.reads, Step.idle)
  }

  switch(step) {
    is(Step.idle) { next() }
    is(Step.reads) { when(from.ready) { step := Step.comes } }
    is(Step.comes) {
      word := from.data
      step := Mux(part === 0.U, Step.chooses, Step.copies)
    }
    is(Step.chooses) {
      when(!into.pending.andR) { copy(PriorityEncoder(~into.pending)) }.otherwise { search() }
    }
    is(Step.searches) {
      when(isFree) { copy(at) }.elsewhen(skips) { goOn() }.otherwise { step := Step.looks }
    }
    is(Step.looks) {
      when(into.done) { // meanwhile it may have begun, and even have been sent
        when(!skips && (!found || into.key >= lastKey)) {
          found   := true.B
          lastKey := into.key
          slot    := at
        }
        when(isFree) { copy(at) }.otherwise { goOn() }
      }
    }
    is(Step.compares) { step := Step.evicts }
    // If it has gone by itself, which may be since it was found, nothing is dropped.
    is(Step.evicts) {
      when(isGone) { copy(slot) }.otherwise { step := Mux(isBetter, Step.leaves, Step.counts) }
    }
    is(Step.leaves) {
      at := slot
      when(isGone) { copy(slot) }.otherwise { step := Step.evicted }
    }
    is(Step.evicted) {
      // Else it was begun in the last cycle, or slots are held for a few cycles at the same moment of each
      // bit.
      when(isGone) {
        drops := true.B
        copy(slot)
      }.elsewhen(skips) { search() }.otherwise { step := Step.evicts }
    }
    is(Step.copies) {
      when(into.done) {
        part := part + 1.U
        step := Mux(part === 3.U, Step.asks, Step.reads)
      }
    }
    is(Step.asks) { when(into.appended) { when(drops) { step := Step.counts }.otherwise { next() } } }
    is(Step.counts) { when(into.done) { next() } }
  }
}

package flyframe.can

import chisel3._
import chisel3.util._
import flyframe.params.CanParams

/** Finds the lowest filter that a frame matches (CAN-43), an entry at a time while the frame comes in. */
class AcceptanceFilter(p: CanParams) extends Module {
  private val entryBits = log2Ceil(p.filters)

  /** The search begins anew in the next cycle, for the identifier word, which must stay until it is done. */
  val start      = IO(Input(Bool()))
  val identifier = IO(Input(UInt(32.W)))

  /** Entries change: the one at hand must be read anew. */
  val hold = IO(Input(Bool()))

  /** Reads a word: the value of an entry, then its mask. If `ready`, it is there in the next cycle. */
  val read  = IO(Output(Valid(UInt((entryBits + 1).W))))
  val ready = IO(Input(Bool()))
  val data  = IO(Input(UInt(32.W)))

  val done    = IO(Output(Bool()))
  val matches = IO(Output(Bool()))
  val entry   = IO(Output(UInt(entryBits.W)))

  // Reset: no search.
  private object Step extends ChiselEnum { val idle, value, takesValue, mask, takesMask, judges = Value }
  private val step   = RegInit(Step.idle)
  private val at     = Reg(UInt(entryBits.W))
  private val found  = Reg(Bool())
  private val diff   = Reg(UInt(32.W)) // bits that differ, then those of them that count
  private val isUsed = Reg(Bool())     // the entry
  private val hits   = isUsed && !diff.orR

  read.valid := !hold && (step === Step.value || step === Step.mask)
  read.bits  := at ## (step === Step.mask)
  private val reads = read.valid && ready
  switch(step) {
    is(Step.value) { when(reads) { step := Step.takesValue } }
    is(Step.takesValue) {
      diff := data ^ identifier
      step := Step.mask
    }
    is(Step.mask) { when(reads) { step := Step.takesMask } }
    is(Step.takesMask) {
      isUsed := diff(29)
      diff   := diff & data // bit 29 of a mask is 0
      step   := Step.judges
    }
    is(Step.judges) {
      found := hits
      at    := Mux(hits, at, at + 1.U)
      step  := Mux(hits || at === (p.filters - 1).U, Step.idle, Step.value)
    }
  }
  when(hold && (step === Step.takesValue || step === Step.mask)) { step := Step.value }
  when(start) {
    step  := Step.value
    at    := 0.U
    found := false.B
  }
  done    := step === Step.idle
  matches := found
  entry   := at
}

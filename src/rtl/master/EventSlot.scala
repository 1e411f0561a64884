package flyframe.master

import chisel3._
import chisel3.util._
import flyframe.protocol.{EventKind, MasterEvent}
import flyframe.ram.DualPortRam

/** Holds an event that is on its way to the reporter, so that nobody else waits for that (LM-09). */
class EventSlot extends Module {

  /** There is none: its words may be written, in any order. A word has its number `place` of
    * [[flyframe.protocol.MasterEvent]]; the first one is kind and position, the others come as they are in an
    * answer (kind `Detector`), in the table (`Slave`), or of the master (`Line`).
    */
  val free     = IO(Output(Bool()))
  val write    = IO(Input(Bool()))
  val place    = IO(Input(UInt(3.W)))
  val kind     = IO(Input(UInt(2.W)))
  val position = IO(Input(UInt(8.W)))
  val answer   = IO(Input(UInt(16.W)))
  val data     = IO(Input(UInt(16.W)))
  val own      = IO(Input(UInt(16.W)))

  /** All words are there; it is not to be sent, if it is not on its way yet. */
  val offer  = IO(Input(Bool()))
  val cancel = IO(Input(Bool()))

  /** Its first word is being taken: it gets its number. */
  val begins = IO(Output(Bool()))
  val event  = IO(Decoupled(UInt(16.W)))

  private val full    = RegInit(false.B)                              // reset: none
  private val settled = Reg(Bool())                                   // the memory shows the word
  private val at      = Reg(UInt(3.W))
  private val ram     = DualPortRam(2 * MasterEvent.Words, 16)(clock) // less would be no block
  private def isKind(k: Int): Bool = kind === k.U
  private def on(n: Int): Bool     = place === n.U
  private val isLast               = on(MasterEvent.Words - 1)
  private val word = Mux(isKind(EventKind.Detector), answer, Mux(place(2) && !isLast, 0.U, data))
  // Where a word has two fields of a slave, the first one is in its low half.
  private val turned  = on(MasterEvent.State) || isLast && isKind(EventKind.Slave)
  private val ofSlave = Mux(turned, Cat(word(7, 0), word(15, 8)), word)
  ram.io.write        := write
  ram.io.writeAddress := place
  ram.io.writeData := Mux(
    on(MasterEvent.Kind),
    Cat(kind, position),
    Mux(isKind(EventKind.Line), own, ofSlave)
  )
  ram.io.readAddress := at

  free        := !full
  event.valid := full && settled
  event.bits  := ram.io.readData
  begins      := event.fire && at === 0.U

  settled := full && !event.fire
  when(event.fire) {
    at := at + 1.U
    when(at.andR) { full := false.B }
  }
  when(cancel && at === 0.U && !event.fire) { full := false.B }
  when(offer) {
    full := true.B
    at   := 0.U
  }
}

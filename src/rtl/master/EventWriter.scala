package flyframe.master

import chisel3._
import chisel3.util._
import flyframe.protocol.{EventKind, MasterEvent, SlaveStateLayout}

/** Goes round the table, and tells the server of slaves and of the master itself what has changed since it
  * was told last (LM-12). While there is no room changes run together.
  *
  * @param maxSlaves
  *   places in the table
  */
class EventWriter(maxSlaves: Int) extends Module {
  private val bits = log2Ceil(maxSlaves)

  /** Nobody else uses the table. It may end at any time: what is not told then is told later. */
  val run = IO(Input(Bool()))

  /** Slaves in the table; the server knows nothing. */
  val known  = IO(Input(UInt(8.W)))
  val forget = IO(Input(Bool()))

  /** The table, see [[SlaveTable]]. */
  val readAt  = IO(Output(new TableAddress(bits)))
  val isWrong = IO(Input(Bool())) // of a status word that was read
  val untold  = IO(Input(Bool()))
  val tells   = IO(Output(Bool()))

  /** Of the master: its status word, slaves that answer, the cut, frames sent in vain. */
  val status     = IO(Input(UInt(19.W)))
  val present    = IO(Input(UInt(8.W)))
  val cut        = IO(Input(UInt(8.W)))
  val framesLost = IO(Input(UInt(16.W)))

  /** There is room for such events; see [[EventSlot]]. */
  val room  = IO(Input(Bool()))
  val free  = IO(Input(Bool()))
  val fills = IO(Output(Bool()))
  val place = IO(Output(UInt(3.W)))
  val kind  = IO(Output(UInt(2.W)))
  val owner = IO(Output(UInt(8.W)))
  val own   = IO(Output(UInt(16.W)))
  val offer = IO(Output(Bool()))

  /** In the last round somebody was missing, or another one than expected was there. */
  val wrong = IO(Output(Bool()))

  private object State extends ChiselEnum { val look, master, fill = Value }
  import State._
  private val state = RegInit(look)        // reset: the first slave
  private val turn  = RegInit(0.U(bits.W)) // slave at hand; reset: the first one
  private val at    = RegInit(0.U(4.W))    // step; what the one before it has read has come; reset: the first
  private val ofOwn = RegInit(false.B)     // the event is of the master; reset: no
  private val told  = RegInit(0.U(19.W))   // status of the master; reset: nothing to tell
  private val now   = RegInit(false.B)     // somebody is wrong so far in this round; reset: nobody
  private val last  = RegInit(false.B)     // in the last one
  wrong := last

  readAt.position := turn
  readAt.word := MuxLookup(at, SlaveStateLayout.Node.word.U(2.W))(
    Seq(
      MasterEvent.Sequence.U    -> SlaveStateLayout.Status.word.U,
      MasterEvent.State.U       -> SlaveStateLayout.SelfTest.word.U,
      (MasterEvent.Words - 1).U -> SlaveStateLayout.Dropped.word.U
    )
  )
  tells := false.B
  offer := false.B

  // Words of an event.
  private def on(n: Int): Bool = place === n.U
  own := Mux1H(
    Seq(
      on(MasterEvent.Node)      -> cut,
      on(MasterEvent.Sequence)  -> status(15, 0),
      on(MasterEvent.State)     -> status(18, 16),
      on(MasterEvent.Words - 1) -> framesLost
    )
  )
  fills := false.B
  place := at - 1.U
  kind  := Mux(ofOwn, EventKind.Line.U, EventKind.Slave.U)
  owner := Mux(ofOwn, present, turn)

  private val may = room && free
  private def advance(): Unit = {
    at    := 0.U
    state := look
    turn  := turn + 1.U
    when(turn +& 1.U >= known) { state := master }
  }
  when(!run) {
    at    := 0.U
    state := Mux(state === master, master, look)
  }.otherwise {
    at := at + 1.U
    switch(state) {
      is(look) {
        readAt.word := SlaveStateLayout.Status.word.U
        when(at(0)) {
          when(isWrong) { now := true.B }
          at    := 0.U
          ofOwn := false.B
          state := fill
          when(!untold || !may) { advance() }
        }
      }
      is(master) {
        turn  := 0.U
        at    := 0.U
        last  := now
        now   := false.B
        ofOwn := true.B
        state := Mux(status =/= told && may, fill, look)
      }
      is(fill) {
        fills := at =/= 0.U
        when(at === MasterEvent.Words.U) {
          offer := true.B
          tells := !ofOwn
          at    := 0.U
          state := look
          when(ofOwn) { told := status }.otherwise { advance() }
        }
      }
    }
  }
  when(forget) {
    told  := 0.U
    now   := false.B
    turn  := 0.U
    state := look
  }
}

package flyframe.master

import chisel3._
import chisel3.util._
import flyframe.protocol.{EventKind, MasterEvent}
import flyframe.protocol.HostEventLayout.{Node, Position, Sequence, State}

/** An event of the master's host, read as it stands at its registers (HOST-06): position, state, node ID and
  * sequence, low bytes first.
  */
class HostEvent extends Module {

  /** Reports it; nothing is to be changed while `busy`. */
  val go   = IO(Input(Bool()))
  val busy = IO(Output(Bool()))

  /** The byte comes a cycle after its address, while this unit has the memory. */
  val granted     = IO(Input(Bool()))
  val readAddress = IO(Output(UInt(3.W)))
  val readData    = IO(Input(UInt(8.W)))

  /** Words of [[MasterEvent]]. */
  val event = IO(Decoupled(UInt(16.W)))

  private val waits = RegInit(false.B)  // reset: none
  private val word  = RegInit(0.U(3.W)) // reset: the first is next
  private val half = Reg(
    UInt(2.W)
  ) // 0: address of a low byte; 1: it comes; 2: the high one; 3: both are there
  private val low = Reg(UInt(8.W))
  busy        := waits
  event.valid := waits && half === 3.U && granted

  /** Where the bytes of words 0 to 3 are; those behind are 0. */
  private val lows = VecInit(Seq(Position, Node, Sequence, State).map(_.offset.U(3.W)))
  readAddress := lows(word(1, 0)) | half(1)
  private val both = Cat(readData, low)
  event.bits := MuxLookup(word, 0.U(16.W))(
    Seq(
      MasterEvent.Kind.U     -> Cat(EventKind.Command.U(8.W), low),
      MasterEvent.Node.U     -> both,
      MasterEvent.Sequence.U -> both,
      MasterEvent.State.U    -> Cat(low, 0.U(8.W))
    )
  )
  half := Mux(!waits || event.fire || !granted, 0.U, Mux(half === 3.U, half, half + 1.U))
  when(half === 1.U) { low := readData }
  when(event.fire) {
    word := word + 1.U
    when(word === (MasterEvent.Words - 1).U) {
      word  := 0.U
      waits := false.B
    }
  }
  when(go) { waits := true.B }
}

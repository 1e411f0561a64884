package flyframe.dc

import chisel3._

/** One edge of a LATCH signal (DC-37 to DC-39): waits until the engine has taken its time.
  */
class LatchEdge extends Module {

  /** The edge. */
  val edge = IO(Input(Bool()))

  /** Only the first one counts, until its `event` ends. */
  val single = IO(Input(Bool()))
  val event  = IO(Input(Bool()))

  /** Its time is wanted, and has been taken; `age` is how many cycles ago it was when `taken`. */
  val asks  = IO(Output(Bool()))
  val taken = IO(Input(Bool()))
  val age   = IO(Output(UInt(ClockEngine.AgeBits.W)))

  /** The time is there. */
  val caught = IO(Input(Bool()))

  private val waits  = RegInit(false.B) // reset: no edge
  private val comes  = RegInit(false.B) // taken, but not there; reset: no edge
  private val since  = Reg(UInt(ClockEngine.AgeBits.W))
  private val stamps = edge && !(single && (event || waits || comes))
  since := Mux(stamps, 4.U, since + 1.U) // two cycles are those of the crossing
  when(taken) {
    waits := false.B
    comes := true.B
  }
  when(caught) { comes := false.B }
  when(stamps) { waits := true.B }
  asks := waits
  age  := since
}

package flyframe.dc

import chisel3._

/** One edge of a LATCH signal (DC-37 to DC-39): waits until the engine has taken its time, and remembers the
  * event until its owner has read that.
  *
  * @param byWrite
  *   the host acknowledges by writing the first byte of the time, not by reading (PDI-09)
  */
class LatchEdge(byWrite: Boolean) extends Module {

  /** The unit is there; else there is no event. */
  val on = IO(Input(Bool()))

  /** The edge, and now and then: its time may be asked for again. */
  val edge = IO(Input(Bool()))
  val may  = IO(Input(Bool()))

  /** Only the first one counts, until its time is read by the owner: the host, or frames. */
  val single = IO(Input(Bool()))
  val byHost = IO(Input(Bool()))

  /** Its time is wanted, and has been taken; `age` is how many cycles ago it was when `taken`. */
  val asks  = IO(Output(Bool()))
  val taken = IO(Input(Bool()))
  val age   = IO(Output(UInt(ClockEngine.AgeBits.W)))

  /** The time is there. */
  val caught = IO(Input(Bool()))

  /** The host gets a copy of the time with the first byte that it reads, and acknowledges: reads a byte, or
    * writes the first one.
    */
  val copied       = IO(Input(Bool()))
  val acknowledges = IO(Input(Bool()))

  /** A frame begins, reads a byte of the time, and ends well or in error. */
  val begins = IO(Input(Bool()))
  val reads  = IO(Input(Bool()))
  val good   = IO(Input(Bool()))
  val bad    = IO(Input(Bool()))

  /** The owner sees that there was one. */
  val event = IO(Output(Bool()))

  private val waits    = RegInit(false.B) // reset: no edge
  private val isCaught = RegInit(false.B) // reset: no event
  private val comes    = RegInit(false.B) // taken, but not there; reset: no edge
  private val mayAsk = RegInit(true.B) // a pin that never rests leaves the engine to others; reset: it rests
  private val since  = Reg(UInt(ClockEngine.AgeBits.W))
  private val stamps = edge && !(single && (isCaught || waits || comes))
  since := Mux(stamps, 4.U, since + 1.U) // two cycles are those of the crossing
  when(may) { mayAsk := true.B }
  when(taken) {
    waits  := false.B
    comes  := true.B
    mayAsk := false.B
  }
  when(caught) { comes := false.B }
  when(stamps) { waits := true.B }
  asks := waits && mayAsk
  age  := since

  // A frame sees what was there when it began, as its time is that of then; and only that has been read.
  private val hostHas = RegInit(false.B) // the copy is of this event; reset: no event
  private val seen    = RegInit(false.B) // by the frame at hand; reset: no frame
  private val isRead  = RegInit(false.B) // by the frame at hand; reset: no frame
  when(copied) { hostHas := isCaught }
  when(acknowledges) { hostHas := false.B }
  when(begins) { seen := isCaught }
  when(reads) { isRead := true.B }
  when(good || bad) { isRead := false.B }
  private val ends = Mux(byHost, acknowledges && (hostHas || byWrite.B), good && isRead && seen)
  when(ends) {
    isCaught := false.B
    seen     := false.B
  }
  when(caught && single) {
    isCaught := true.B
    hostHas  := false.B
  }
  when(!on) {
    isCaught := false.B
    seen     := false.B
  }
  event := isCaught && single && (byHost || seen)
}

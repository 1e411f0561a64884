package flyframe.master

import chisel3._
import chisel3.util._

/** The slaves that each end of a line reaches (LM-04). A plain line has one end. The second end of a ring
  * that is cut reaches the last slaves, so the position of its first one follows from how many there were.
  *
  * @param maxSlaves
  *   places in the table
  * @param linePorts
  *   1, or 2: a ring
  */
class LineEnds(maxSlaves: Int, linePorts: Int) extends Module {
  import LineEnds._

  /** The frame is that of the second end. */
  val atSecond = IO(Input(Bool()))

  /** An exchange is over: so many slaves have answered, over the whole ring if it came in `across`; or, with
    * `silent`, nobody.
    */
  val counted = IO(Flipped(Valid(UInt(16.W))))
  val across  = IO(Input(Bool()))
  val silent  = IO(Input(Bool()))

  /** The cycle is over, and the next one may begin. */
  val over = IO(Input(Bool()))

  /** The line does not run. */
  val forget = IO(Input(Bool()))

  /** Slaves that are expected; 0 if the list is not set. */
  val expected = IO(Input(UInt(8.W)))

  /** Frames come round the ring, since the last answer at the first end. */
  val closed = IO(Output(Bool()))

  /** Position of the first slave that this frame reaches. */
  val base = IO(Output(UInt(8.W)))

  /** A position: this frame reaches it, or no frame does. */
  val position = IO(Input(UInt(8.W)))
  val mine     = IO(Output(Bool()))
  val gone     = IO(Output(Bool()))

  /** This end has answered before: a frame is worth sending again. */
  val inUse = IO(Output(Bool()))

  /** Another number of slaves has answered than before: positions may be those of others. */
  val changed = IO(Output(Bool()))

  /** When a cycle is over: every end in use has answered in it. */
  val whole = IO(Output(Bool()))

  /** Slaves that answer; the places that they would take in a table; the first one behind the cut. */
  val present = IO(Output(UInt(8.W)))
  val places  = IO(Output(UInt(8.W)))
  val cut     = IO(Output(UInt(8.W)))

  private val counts = RegInit(VecInit.fill(linePorts)(0.U(8.W)))            // reset: nobody
  private val failed = RegInit(VecInit.fill(linePorts)(0.U(PatienceBits.W))) // cycles; reset: none
  private val missed = RegInit(false.B) // an end in this cycle; reset: none
  private val round  = RegInit(false.B) // reset: nobody knows
  private val end    = if (linePorts == 2) atSecond.asUInt else 0.U
  private val most   = mostCounted(maxSlaves, linePorts)
  private val some   = Mux(counted.bits > most.U, most.U, counted.bits(7, 0))
  private val comes  = if (linePorts == 2) across && !atSecond else false.B
  closed  := round
  inUse   := counts(end) =/= 0.U
  whole   := !missed
  changed := false.B

  when(over) { missed := false.B }
  when(counted.valid) {
    changed     := some =/= counts(end) || comes =/= round
    failed(end) := 0.U
    counts(end) := some
    if (linePorts == 2) {
      when(!atSecond) {
        round := comes
        when(comes) {
          counts(1) := 0.U
          failed(1) := 0.U
        }
      }.elsewhen(round) { // it is cut before the first slave: a closed ring gives no answer here
        round     := false.B
        counts(0) := 0.U
        missed    := false.B
        changed   := true.B
      }
    }
  }
  when(silent) {
    when(inUse) { missed := true.B }
    failed(end) := failed(end) + 1.U
    when(failed(end).andR) {
      failed(end) := failed(end)
      changed     := inUse
      counts(end) := 0.U
      if (linePorts == 2) { when(!atSecond) { round := false.B } }
    }
  }
  when(forget) {
    counts.foreach(_ := 0.U)
    round := false.B
  }

  if (linePorts == 1) {
    present := counts(0)
    places  := counts(0)
    cut     := counts(0)
    base    := 0.U
    mine    := position < counts(0)
    gone    := !mine
  } else {
    // The slaves of the ring when it was whole, but never fewer than there are.
    val before  = RegInit(0.U(8.W)) // reset: none
    val total   = counts(0) + counts(1)
    val most    = Mux(before =/= 0.U, before, expected)
    val end     = Mux(most > total, most, total)
    val second  = end - counts(1)
    val isUsed  = counts(1) =/= 0.U
    val ofFirst = position < counts(0)
    val behind  = position >= second
    when(over && round) { before := counts(0) }
    present := total
    places  := Mux(isUsed, end, counts(0))
    cut     := counts(0)
    base    := Mux(atSecond, second, 0.U)
    mine    := Mux(atSecond, isUsed && behind, ofFirst)
    // A ring that has just been cut: nobody knows yet whom the second end reaches.
    val isUnheard = !round && !isUsed && !failed(1).andR
    gone := !ofFirst && !(isUsed && behind) && !isUnheard
  }
}

object LineEnds {

  /** Cycles without an answer of an end, but one, before its slaves are gone: three in a row. */
  private val PatienceBits = 2

  /** The highest number of slaves that is told of one end. */
  private def mostCounted(maxSlaves: Int, linePorts: Int): Int =
    if (linePorts == 2 && maxSlaves < 128) 127 else 255
}

package flyframe.fibre

import chisel3._

/** Finds a level that has been dominant for too long, until it has been recessive for long enough (FR-37,
  * FB-08).
  *
  * @param longest
  *   units that it may be dominant, at most 6
  */
class StuckGuard(longest: Int) extends Module {

  /** 1 is recessive. */
  val level = IO(Input(Bool()))

  /** Units of a level that is dominant end, and of one that is recessive, of which 3 are enough. */
  val dominant  = IO(Input(Bool()))
  val recessive = IO(Input(Bool()))

  /** In this cycle, and in the next one. */
  val stuck = IO(Output(Bool()))
  val next  = IO(Output(Bool()))

  private val count   = Reg(UInt(3.W))         // no reset: of recessive any count will do
  private val before  = RegNext(level, true.B) // reset: recessive
  private val isStuck = RegInit(false.B)       // reset: not
  private val ticks   = Mux(level, recessive, dominant)
  private val isLast  = count === Mux(level, 3.U, longest.U)
  private val isEqual = level === before
  when(!isEqual) { count := 0.U }.elsewhen(ticks) { count := ShortCounter.up(count) }
  next    := Mux(isEqual && ticks && isLast, !level, isStuck)
  isStuck := next
  stuck   := isStuck
}

/** Tells when a condition has held for more than 1.5 T, or 0.75 T, in one go (FR-32, FB-08, FB-17). */
class HoldTimer extends Module {
  val holds = IO(Input(Bool()))

  /** 0.75 T are enough. */
  val isShort = IO(Input(Bool()))

  /** An eighth of T ends. */
  val eighth = IO(Input(Bool()))

  /** It has, with the end of this cycle. */
  val over = IO(Output(Bool()))

  private val count = Reg(UInt(4.W)) // eighths and 3; no reset: nothing holds then
  when(!holds || over) { count := 3.U }.elsewhen(eighth) { count := ShortCounter.up(count) }
  over := holds && eighth && count(3) && count(0) && (isShort || count(2, 1).andR)
}

package flyframe.fibre

import chisel3._
import chisel3.util.log2Ceil

/** Finds a level that has been dominant for too long, until it has been recessive for 11 T (FR-37, FB-08).
  *
  * @param longest
  *   ticks that it may be dominant, 12 to 31
  */
class StuckGuard(longest: Int) extends Module {
  private val width = log2Ceil(longest + 2) max log2Ceil(12)

  /** 1 is recessive. */
  val level = IO(Input(Bool()))

  /** A tick of those that count dominance; a T. */
  val tick = IO(Input(Bool()))
  val bit  = IO(Input(Bool()))

  val stuck = IO(Output(Bool()))

  // Up to all ones, from what the level at hand still has to last. No reset: of recessive any count will do.
  private val count   = Reg(UInt(width.W))
  private val before  = RegNext(level, true.B) // reset: recessive
  private val isStuck = RegInit(false.B)       // reset: not
  private val counts  = Mux(level, bit, tick)

  private def start(ticks: Int) = ((1 << width) - 1 - ticks).U(width.W)
  private val present           = Mux(level === before, count, Mux(level, start(11), start(longest)))
  count := present + counts
  when(counts && present.andR) { isStuck := !level }
  stuck := isStuck
}

/** Tells when a condition has held for more than 1.5 T in one go (FR-32, FB-08). */
class HoldTimer extends Module {
  val holds = IO(Input(Bool()))

  /** An eighth of T ends. */
  val eighth = IO(Input(Bool()))

  /** It has, with the end of this cycle. */
  val over = IO(Output(Bool()))

  private val count = Reg(UInt(4.W)) // eighths and 3; no reset: nothing holds then
  when(!holds || over) { count := 3.U }.elsewhen(eighth) { count := count + 1.U }
  over := holds && eighth && count.andR
}

package flyframe.dc

import chisel3._
import chisel3.util._

/** The local time (DC-03): it runs from reset on, and nobody sets it.
  *
  * It is counted byte by byte: what a byte carries reaches the next one a cycle later. So the time of one
  * cycle can be read a byte per cycle, lowest first, which is how it is given: in rounds of `round` cycles,
  * each with the time of its first cycle.
  *
  * @param periodNs
  *   what a core cycle adds, in ns: 8 to 40 (DC-02)
  * @param bytes
  *   of the time, 4 or 8 (DC-01)
  * @param round
  *   cycles of a round, 8, or 4 with four bytes; places without a byte are 0
  */
class LocalClock(periodNs: Int, bytes: Int, round: Int) extends Module {

  /** ns that this cycle adds beside its period, -3 to 3 (DC-18). */
  val more = IO(Input(SInt(3.W)))

  /** Byte `place` of the time at the beginning of this round. */
  val timeByte = IO(Output(UInt(8.W)))
  val place    = IO(Output(UInt(log2Ceil(round).W)))

  /** The last cycle of a round. */
  val last = IO(Output(Bool()))

  private val phase = RegInit(0.U(log2Ceil(round).W)) // reset: a round begins
  phase := phase + 1.U
  place := phase
  last  := phase.andR

  private val time = Seq.tabulate(bytes)(i => RegInit(0.U(8.W)).suggestName(s"time_$i")) // reset: time 0
  time.foldLeft((periodNs.S(8.W) + more).asUInt) { (added, part) =>
    val sum = part +& added
    part := sum
    RegNext(sum(8), false.B).asUInt // reset: nothing is carried
  }
  timeByte := VecInit(time.padTo(round, 0.U))(phase)
}

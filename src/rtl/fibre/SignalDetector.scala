package flyframe.fibre

import chisel3._
import chisel3.util.log2Ceil
import flyframe.params.FibreParams

/** Whether an input hears a signal, noise, or search, by the distances of rising edges (FR-10, FR-11, FB-02,
  * FB-03).
  */
class SignalDetector(p: FibreParams) extends Module {

  /** Samples of this cycle, the first one in bit 0, behind the crossing. */
  val samples = IO(Input(UInt(p.samplesPerCycle.W)))

  /** A window of noise ends with this cycle. */
  val windowEnds = IO(Input(Bool()))

  /** Edges come, and not too many. */
  val signal = IO(Output(Bool()))

  val search = IO(Output(Bool()))

  /** Noise begins. */
  val noise = IO(Output(Bool()))

  private val each    = p.samplesPerCycle
  private val silence = p.samplesIn(2500) + 1

  // Samples since the last rising edge, up to a silence. There is one edge in a cycle at most.
  private val distance = RegInit(silence.U(log2Ceil(silence + 1).W)) // reset: silence
  private val before   = RegNext(samples(each - 1), false.B)
  private val edges    = samples & ~(samples ## before)(each - 1, 0)
  private val rises    = edges.orR
  private val isFirst = if (each == 1) false.B else edges(0) // the edge is not that of the last sample
  private val passed  = Mux(distance > (silence - each).U, silence.U, distance + each.U)
  private val between = if (each == 1) passed else passed - isFirst
  distance := Mux(rises, isFirst, passed)

  private val isFar    = between > p.samplesIn(220).U
  private val isSearch = between >= p.samplesIn(180).U && !isFar
  private val inSearch = RegInit(0.U(5.W)) // distances of search in a row, up to 16; reset: none
  search := inSearch(4)
  when(rises && isSearch) {
    when(!search) { inSearch := inSearch + 1.U }
  }.elsewhen(rises || isFar) { inSearch := 0.U }

  // Distances in this window that are too short, up to one more than may be. Reset: none, and no noise.
  private val most    = 8
  private val shorts  = RegInit(0.U(4.W))
  private val isNoisy = RegInit(false.B)
  private val isShort = rises && between <= p.samplesIn(24).U
  private val isFull  = shorts === (most + 1).U
  private val fills   = isShort && shorts === most.U
  noise   := fills && !isNoisy
  isNoisy := Mux(windowEnds, fills || isFull, fills || isNoisy)
  when(windowEnds) { shorts := 0.U }
    .elsewhen(isShort && !isFull) { shorts := shorts + 1.U }

  signal := distance =/= silence.U && !isNoisy
}

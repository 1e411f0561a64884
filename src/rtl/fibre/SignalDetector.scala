package flyframe.fibre

import chisel3._
import chisel3.util.log2Ceil
import flyframe.params.FibreParams

/** Whether an input hears a signal, noise, or search, by the distances of rising edges (FR-10, FR-11, FB-02,
  * FB-03, FB-12).
  */
class SignalDetector(p: FibreParams) extends Module {

  /** Samples of this cycle, the first one in bit 0, behind the crossing. */
  val samples = IO(Input(UInt(p.samplesPerCycle.W)))

  /** A window of noise ends with this cycle. */
  val windowEnds = IO(Input(Bool()))

  /** 16 samples end with this cycle. */
  val slow = IO(Input(Bool()))

  /** Edges come, and not too many. */
  val signal = IO(Output(Bool()))

  val search = IO(Output(Bool()))

  /** Noise begins. */
  val noise = IO(Output(Bool()))

  /** Of few bits, without a carry chain. */
  private def isIn(number: UInt, range: Range) = range.map(number === _.U).reduce(_ || _)

  private val each     = p.samplesPerCycle
  private val farthest = p.searchSamples.last

  private val before  = RegNext(samples(each - 1), false.B)
  private val edges   = samples & ~(samples ## before)(each - 1, 0)
  private val rises   = edges.orR                            // there is one edge in a cycle at most
  private val isFirst = if (each == 1) false.B else edges(0) // it is not that of the last sample

  // Samples since the last rising edge; behind the farthest one, so many times 16 of them, up to a silence of
  // 16, so that more than 16 means samples. Reset: silence.
  private val isFar  = RegInit(true.B)
  private val count  = RegInit(16.U((log2Ceil(farthest + 1) max 5).W))
  private val passed = if (each == 1) ShortCounter.up(count) else count + Mux(isFar, 1.U, each.U)
  private val leaves = isIn(count, farthest - each + 1 to farthest)
  private val silent = isFar && count(4)
  private val begins = rises || leaves // to count anew
  when(begins) {
    isFar := !rises
    count := rises && isFirst
  }.elsewhen(!isFar || (slow && !count(4))) { count := passed }

  // The distance of an edge that comes now, if it is not far.
  private val distance = if (each == 1) passed else passed - isFirst
  private val isSearch = isIn(distance, p.searchSamples)
  private val inSearch = RegInit(0.U(5.W)) // distances of search in a row, up to 16; reset: none
  search := inSearch(4)
  when(begins && !(isSearch && search)) { inSearch := Mux(isSearch, ShortCounter.up(inSearch), 0.U) }

  // Distances in this window that are too short, up to 9, one more than may be. Reset: none, and no noise.
  private val shorts  = RegInit(0.U(4.W))
  private val isNoisy = RegInit(false.B)
  private val isShort = rises && !isFar && isIn(distance, 1 to p.samplesIn(24))
  private val isFull  = shorts(3) && shorts(0)
  private val fills   = isShort && shorts(3) && !shorts(0)
  noise   := fills && !isNoisy
  isNoisy := Mux(windowEnds, fills || isFull, fills || isNoisy)
  when(windowEnds) { shorts := 0.U }
    .elsewhen(isShort && !isFull) { shorts := ShortCounter.up(shorts) }

  signal := !silent && !isNoisy
}

package flyframe.dc

import chisel3._
import chisel3.util._

/** How long frames are away behind each port, on the mean (B-100). Each slave that a frame passes sends it
  * with the next edge of a transmit clock of its own, so that no two frames take the same time; masters
  * measure delays with one.
  *
  * @param ports
  *   2 to 4
  * @param ageBits
  *   width of an age, below that of a way
  */
class MeanWays(ports: Int, ageBits: Int) extends Module {
  import MeanWays._

  /** A frame begins at port 0, and how many cycles ago it could be seen. */
  val first  = IO(Input(Bool()))
  val waited = IO(Input(UInt(4.W)))

  /** The times of a source are taken up, `port` if that is one: `age` cycles ago a frame has begun there. In
    * the cycle of `comes`, behind that, it counts.
    */
  val takes = IO(Input(Bool()))
  val port  = IO(Input(UInt(log2Ceil(ports + 1).W)))
  val age   = IO(Input(UInt(ageBits.W)))
  val comes = IO(Input(Bool()))

  /** No frame comes to these ports; port 0 counts for all. */
  val absent = IO(Input(Vec(ports, Bool())))

  /** A cycle behind `comes`: by how much that is more than the mean, in cycles and 2^-[[LatePartBits]] of
    * one; 0 at port 0, if it is not known, or if it is another way than before.
    */
  val late = IO(Output(SInt(LateBits.W)))

  // Cycles since a frame has begun at port 0, or more.
  private val sinceFirst = RegInit(((1 << WayBits) - 1).U(WayBits.W)) // reset: none has
  sinceFirst := Mux(first, 2.U +& waited, sinceFirst + !sinceFirst.andR)

  // Only the first frame at a port behind one at port 0 may be that one on its way back.
  private val way    = Reg(UInt(WayBits.W))
  private val isWay  = Reg(Bool())
  private val index  = Reg(UInt(2.W))
  private val isBack = port =/= 0.U && port =/= ports.U && sinceFirst >= age && !sinceFirst.andR
  private val taken  = Reg(Vec(ports - 1, Bool())) // no reset: no frame has begun at port 0
  when(takes) {
    way   := sinceFirst - age
    isWay := isBack
    index := port - 1.U
    for (i <- 0 until ports - 1) when(isBack && port === (i + 1).U) {
      isWay    := !taken(i)
      taken(i) := true.B
    }
  }
  when(first) { taken.foreach(_ := false.B) }

  // How many frames have taken about that way lately: few that have not do not matter. Reset: none has come.
  private val trusts = RegInit(VecInit(Seq.fill(ports - 1)(0.U(TrustBits.W))))
  private val means  = Reg(Vec(ports - 1, UInt((WayBits + PartBits).W))) // no reset: nothing is known

  private def of[T <: Data](all: Vec[T]): T =
    if (ports == 2) all.head else all(index(log2Ceil(ports - 1) - 1, 0))
  private val mean    = of(means)
  private val trust   = of(trusts)
  private val isNew   = trust <= 1.U
  private val whole   = way ## 0.U(PartBits.W)
  private val more    = whole.zext - mean.zext
  private val nearest = more >> (PartBits - LatePartBits)
  private val upper   = nearest.head(nearest.getWidth - LateBits + 1) // with the sign of what is left
  private val isNear  = trust.orR && (upper.andR || !upper.orR)

  // Frames in succession that are off, all of them early or all late: the way has changed. Reset: none was.
  private val rows     = RegInit(VecInit(Seq.fill(ports - 1)(0.U(RowBits.W))))
  private val earlies  = Reg(Vec(ports - 1, Bool())) // no reset: no row
  private val row      = of(rows)
  private val farthest = (nearest >> (LatePartBits + OffBits)).asUInt
  private val isOff    = isNear && !farthest.andR && farthest.orR
  private val isEarly  = more < 0.S
  private val goesOn   = row.orR && of(earlies) === isEarly
  private val changes  = isOff && goesOn && row.andR
  private val restarts = Mux(isNear, changes, isNew)
  private val follow   = (mean.zext + Mux(trust.andR, more >> Smoothing, more >> FirstSmoothing)).asUInt
  for (i <- 0 until ports - 1) {
    when(comes && isWay && index === i.U) {
      rows(i)    := Mux(isOff, Mux(goesOn, row + 1.U, 1.U), 0.U)
      earlies(i) := isEarly
      trusts(i)  := Mux(restarts, 1.U, Mux(isNear, trust + !trust.andR, trust >> 1))
      when(restarts) { means(i) := whole }.elsewhen(isNear) { means(i) := follow }
    }
    when(absent(0) || absent(i + 1)) { trusts(i) := 0.U }
  }
  private val counts = isWay && isNear && !changes && (trust >> EnoughBits).orR
  late := RegEnable(Mux(counts, nearest(LateBits - 1, 0).asSInt, 0.S), comes)
}

object MeanWays {

  /** Bits of a way: up to 655 us at 100 MHz. */
  val WayBits = 16

  /** Bits of a part of a cycle, of a mean and of what is given out. */
  val PartBits     = 12
  val LatePartBits = 6

  /** With a sign: a frame is late or early by less than 64 cycles, or it has gone another way. */
  val LateBits = 1 + 6 + LatePartBits

  /** The mean follows by so many powers of two less than the difference, and so many as long as it is new. */
  val Smoothing      = 8
  val FirstSmoothing = 4

  /** The mean is not new behind about so many powers of two of frames, and counts from so many on. */
  val TrustBits  = 6
  val EnoughBits = 2

  /** Powers of two of cycles by which a frame is off, and of such frames in succession behind which the way
    * has changed.
    */
  val OffBits = 3
  val RowBits = 4
}

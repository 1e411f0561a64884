package flyframe.clocks

import chisel3._
import chiseltest._
import chiseltest.formal._
import chiseltest.formal.backends.Engines
import org.scalatest.flatspec.AnyFlatSpec
import flyframe.Tier

/** The two sides of the receive crossing with an adversary for a receive clock.
  *
  * Time runs in core cycles. Receive edges fall into core cycles; a 25 MHz edge comes every `perNibble`
  * cycles, give or take a slip that grows up to what 100 ppm do over the longest frame (12.2 ns), at any
  * moment and in the direction the solver likes. Which side of a core edge a receive edge falls on is all the
  * synchroniser can see, so this covers metastability too: an edge that coincides counts for the earlier or
  * the later cycle.
  *
  * @param slip
  *   largest slip in core cycles, rounded up; `late`: the receive clock is slow (true) or fast
  */
class CrossingUnderProof(coreClockMhz: Int, late: Boolean, shortMargin: Boolean, slip: Int) extends Module {
  private val perNibble = coreClockMhz / 25
  private val depth     = MiiRxCrossing.depth(coreClockMhz)
  private val writeSide = Module(new MiiRxWriteSide(depth))
  private val readSide  = Module(new MiiRxReadSide(depth, MiiRxCrossing.margin(coreClockMhz)))
  readSide.slots       := writeSide.slots
  readSide.writeGray   := writeSide.writeGray
  readSide.shortMargin := shortMargin.B

  // Which cycles hold a receive edge.
  val slipNow = IO(Input(Bool()))
  val phase   = IO(Input(UInt(3.W))) // of the first edge

  private val started = RegInit(0.U(3.W))
  private val settled = started === 7.U
  private val count   = RegInit(0.U(4.W)) // cycles to the next receive edge
  private val slipped = RegInit(0.U(3.W))
  private val edge    = settled && count === 0.U
  private val maySlip = slipNow && slipped < slip.U
  private val period  = perNibble.U(4.W) - 1.U
  when(!settled) {
    started := started + 1.U
    count   := phase
    assume(phase < perNibble.U)
  }.elsewhen(edge) {
    if (late) {
      count := period + maySlip.asUInt
      when(maySlip) { slipped := slipped + 1.U }
    } else {
      // A fast clock: the next edge comes a cycle early. At one cycle per nibble that would be two edges in
      // one cycle.
      count := period - (if (perNibble > 1) maySlip.asUInt else 0.U)
      when(maySlip) { slipped := slipped + 1.U }
    }
  }.otherwise {
    count := count - 1.U
  }
  writeSide.valid := edge

  // A frame without end: its first symbol comes with the first edge; where that falls in a slot is the
  // solver's choice (`phase`). The write pointer starts anywhere; by symmetry zero stands for all.
  private val dv = settled
  when(started === 0.U) { assume(writeSide.writeGray === 0.U) }
  // Each symbol carries a number, to see that none is lost, doubled or swapped.
  private val number = RegInit(0.U(4.W))
  when(edge && dv) { number := number + 1.U }
  writeSide.pins.dv   := dv
  writeSide.pins.er   := false.B
  writeSide.pins.data := number

  // The read side is in reset until the write pointer has come over, as it is in hardware.
  private val tickCount = RegInit(0.U(3.W))
  tickCount := Mux(tickCount === (perNibble - 1).U, 0.U, tickCount + 1.U)
  private val tick    = settled && tickCount === 0.U
  private val reading = RegInit(false.B)
  private val wanted  = RegInit(0.U(4.W))
  private val symbol  = readSide.read.symbol
  private val start   = tick && !reading && readSide.read.available && symbol.dv && readSide.read.settled
  private val go      = tick && reading && readSide.read.available
  readSide.reset     := !settled
  readSide.read.take := start || go
  when(start) { reading := true.B }
  when(start || go) {
    wanted := wanted + 1.U
    assert(symbol.data === wanted, "a symbol was lost, doubled or swapped")
  }
  when(tick && reading) { assert(readSide.read.available, "underflow") }
  when(settled) { assert(!readSide.read.overflow, "overflow") }
}

class MiiRxCrossingFormal extends AnyFlatSpec with ChiselScalatestTester with Formal {
  private def prove(coreClockMhz: Int, late: Boolean, shortMargin: Boolean): Unit = {
    assume(Engines.present, Engines.missing)
    // 100 ppm over 122 us are 12.2 ns; with the short margin 25 ppm on both sides, 6.1 ns (LP-12).
    val ns     = if (shortMargin) 6.1 else 12.2
    val slip   = math.ceil(ns * coreClockMhz / 1000).toInt
    val cycles = 8 + (coreClockMhz / 25) * 10
    verify(
      new CrossingUnderProof(coreClockMhz, late, shortMargin, slip),
      Seq(BoundedCheck(cycles), Engines.boolector)
    )
  }

  private val all = for {
    mhz         <- Seq(25, 50, 100, 125)
    late        <- Seq(false, true)
    shortMargin <- Seq(false, true)
  } yield (mhz, late, shortMargin)

  // Only a slow receive clock at 100 and 125 MHz needs the whole margin, so no sample leaves those out.
  private val sample = all.filter { case (mhz, late, _) => late || mhz <= 50 }
  private val tier   = Tier("proof of the receive crossing", "settings", sample.size, all.size)

  for ((mhz, late, shortMargin) <- if (Tier.isSoak) all else sample) {
    val clock = if (late) "slow" else "fast"
    val size  = if (shortMargin) "least" else "default"
    val name  = s"$mhz MHz, receive clock $clock, $size RX FIFO size"
    s"LP-12: $name" should "neither under- nor overflow" in
      tier.run(name, 1)(prove(mhz, late, shortMargin))
  }
}

package flyframe.mi

import chisel3._
import chisel3.util._

/** The pins of the management bus to all PHYs (MI-01). The data line has a pull-up. */
class MiPins extends Bundle {
  val mdc         = Output(Bool())
  val mdio_in     = Input(Bool())
  val mdio_out    = Output(Bool())
  val mdio_enable = Output(Bool()) // drive the line
}

/** One access on the management bus (MI-06): a frame of 64 bits and an idle clock, most significant bit
  * first.
  *
  * One counter says where in the frame and where in a clock period of the bus it is: MDC is one of its bits,
  * so that a period is a power of two of core cycles. The data line changes where MDC falls, and is sampled
  * where it rises; a PHY changes it behind that.
  *
  * @param coreClockMhz
  *   sets the period: at least 400 ns
  */
class Mdio(coreClockMhz: Int) extends Module {

  /** Carry out an access, up to `done`; it begins when nothing `delays` it. `isWrite`, `phy` and
    * `phyRegister` hold from then on.
    */
  val run         = IO(Input(Bool()))
  val delays      = IO(Input(Bool()))
  val isWrite     = IO(Input(Bool()))
  val phy         = IO(Input(UInt(5.W)))
  val phyRegister = IO(Input(UInt(5.W)))

  /** High for a cycle; then `data` is what was read, and `silent` says that no PHY answered a read. */
  val done   = IO(Output(Bool()))
  val silent = IO(Output(Bool()))

  /** The 16 bits that are shifted out or in; bytes to load between accesses, the low one first. */
  val data = IO(Output(UInt(16.W)))
  val load = IO(Input(Vec(2, Valid(UInt(8.W)))))

  /** The pins; `mdioIn` is already in the core clock. */
  val mdc        = IO(Output(Bool()))
  val mdioIn     = IO(Input(Bool()))
  val mdioOut    = IO(Output(Bool()))
  val mdioEnable = IO(Output(Bool()))

  private val period = log2Ceil((coreClockMhz * 1000 + Mdio.FastestKhz - 1) / Mdio.FastestKhz)
  private val count  = RegInit(0.U((7 + period).W)) // reset: no access
  private val bit    = count >> period              // of the frame: preamble, from 32 header, from 48 data
  private val rises  = count(period - 1, 0) === ((1 << (period - 1)) - 1).U
  private val ends   = count(period - 1, 0).andR
  mdc  := count(period - 1)
  done := bit(6) && bit(0) // behind one clock that nobody drives
  when(run && !(delays && count === 0.U)) { count := count + 1.U }
  when(done) { count := 0.U }

  private val sampled  = RegEnable(mdioIn, rises)
  private val noAnswer = RegEnable(sampled, ends && !bit(6) && !bit(4)) // last: second bit of the turnaround
  private val shift  = RegInit(VecInit.fill(2)(0.U(8.W))) // reset: as the data register shows it
  private val inData = bit(5) && bit(4)
  for (i <- 0 to 1) when(load(i).valid) { shift(i) := load(i).bits }
  data   := shift.asUInt
  silent := noAnswer && !isWrite
  when(ends && inData) {
    // What was written is in its place again behind the access.
    shift := Cat(data(14, 0), Mux(isWrite, data(15), sampled)).asTypeOf(shift)
  }

  private val header   = Cat(1.U(2.W), !isWrite, isWrite, phy, phyRegister, 2.U(2.W)) // start to turnaround
  private val level    = Mux(inData, data(15), !bit(5) || VecInit(header.asBools.reverse)(bit(3, 0)))
  private val isTheirs = !isWrite && bit(5) && (bit(4) || bit(3, 1).andR)
  mdioOut    := RegNext(level)
  mdioEnable := RegNext(run && !bit(6) && !isTheirs, false.B) // reset: let the line go
}

object Mdio {

  /** What every PHY can do, kHz. */
  val FastestKhz = 2500
}

package flyframe

import chisel3._
import chisel3.util._
import flyframe.clocks.MiiSymbol
import flyframe.mii.RmiiPins

/** A PHY with RMII, in a controller's core clock: what a test gives and takes are symbols of MII.
  *
  * As real ones do, it knows of the carrier before it has data, and has data when the carrier has gone.
  *
  * @param cycles
  *   core cycles per nibble, 2 or 4
  */
class RmiiPhy(cycles: Int) extends Module {

  /** Taken when `rxClock` is high, once per nibble. */
  val rxClock = IO(Input(Bool()))
  val rx      = IO(Input(new MiiSymbol))
  val linkUp  = IO(Input(Bool()))

  /** The controller's; with it, `tx` has the last nibble that has left wholly. */
  val txTick = IO(Input(Bool()))
  val tx     = IO(Valid(UInt(4.W)))
  val rmii   = IO(Flipped(new RmiiPins))

  // The place within a nibble; RXD changes while the reference clock falls.
  private val place = RegInit(0.U(log2Ceil(cycles).W))
  place := Mux(rxClock, 0.U, place + 1.U)
  private val second = place >= (cycles / 2).U
  rmii.ref_clk := (if (cycles == 2) !clock.asBool else place(0)).asClock

  private val none    = 0.U.asTypeOf(new MiiSymbol)
  private val stages  = Seq.iterate(RegEnable(rx, none, rxClock), 4)(RegEnable(_, none, rxClock))
  private val carrier = stages.head.dv
  private val now     = stages.last
  rmii.crs_dv := carrier || (now.dv && second)
  rmii.rx_er  := now.er
  rmii.rxd    := Mux(now.dv, Mux(second, now.data(3, 2), now.data(1, 0)), 0.U)
  rmii.link   := linkUp

  private val first = RegNext(txTick, false.B)
  private val last  = ShiftRegister(first, cycles / 2, false.B, true.B)
  private val low   = RegEnable(rmii.txd, first)
  tx.valid := RegEnable(rmii.tx_en, false.B, last)
  tx.bits  := RegEnable(Cat(rmii.txd, low), last)
}

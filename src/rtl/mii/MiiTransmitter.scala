package flyframe.mii

import chisel3._
import chisel3.util._

/** Drives TXD and TX_EN from a [[NibbleStream]] and adds the mark behind a frame that ended bad (ERR-06,
  * ERR-07, B-04): as many nibbles as make an odd number behind an FCS that is wrong.
  *
  * Runs on the core clock; there is no TX FIFO (PHY-02). Delay: one core cycle.
  */
class MiiTransmitter extends Module {

  /** Once per nibble slot. */
  val tick = IO(Input(Bool()))
  val in   = IO(Input(new NibbleStream))
  val txEn = IO(Output(Bool()))
  val txd  = IO(Output(UInt(4.W)))

  private val enable = RegInit(false.B)  // reset: no nibble may leave before the first frame
  private val data   = Reg(UInt(4.W))
  private val left   = RegInit(0.U(2.W)) // nibbles of the mark that are still to be added; reset: none
  txEn := enable
  txd  := data

  // Without an SFD the mark begins with it: a fragment that the next ESC recognises.
  private val all  = Mux(in.payload, Cat(in.crcGood, !in.odd), 2.U)
  private val mark = Mux(in.end && in.bad, all, left)
  private val adds = mark =/= 0.U

  when(tick) {
    enable := in.valid || adds
    data   := Mux(in.valid, in.data, Mux(in.end && !in.payload, 0xd.U, 0.U))
    left   := mark - adds
  }
}

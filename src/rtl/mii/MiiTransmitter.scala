package flyframe.mii

import chisel3._

/** Drives TXD and TX_EN from a [[NibbleStream]] and finishes frames that ended bad (ERR-06, ERR-07, B-04):
  * spoils the last nibble where the FCS would be right, and appends the extra nibble that marks the error as
  * counted.
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
  private val extra  = RegInit(0.U(2.W)) // nibbles still to be appended
  txEn := enable
  txd  := data

  private val dribble = in.last && !in.bad && in.odd
  private val spoil   = in.last && in.bad

  when(tick) {
    when(extra =/= 0.U) {
      enable := true.B
      data   := 0.U
      extra  := extra - 1.U
    }.otherwise {
      enable := in.valid && !dribble
      data   := in.data
      when(in.valid && spoil) {
        when(!in.payload) { // no payload yet: an SFD and the mark make a fragment the next ESC recognises
          data  := 0xd.U
          extra := 1.U
        }.elsewhen(!in.odd) {
          data  := in.data ^ VecInit.fill(4)(in.crcGood).asUInt
          extra := 1.U
        }.elsewhen(in.crcGood) {
          extra := 2.U
        }
      }
    }
  }
}

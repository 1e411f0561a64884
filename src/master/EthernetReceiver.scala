package flyframe.master

import chisel3._
import chisel3.util._
import flyframe.mii.NibbleStream

/** The bytes of frames behind a receiver, from the destination address on and without FCS: each comes when
  * four more have come.
  *
  * `end` follows the last byte of every frame and tells whether it was good: what came of a bad one is void.
  */
class EthernetReceiver extends Module {

  /** Once per nibble slot: `in` is to be taken. */
  val step = IO(Input(Bool()))
  val in   = IO(Input(new NibbleStream))

  /** One pulse per byte; `first`: the frame begins with it. */
  val byte  = IO(Output(Valid(UInt(8.W))))
  val first = IO(Output(Bool()))

  /** The frame is over; true: it was good. */
  val end = IO(Output(Valid(Bool())))

  private val low    = Reg(UInt(4.W))
  private val high   = RegInit(false.B)  // the next nibble is a high one; reset: no frame
  private val behind = Reg(Vec(4, UInt(8.W)))
  private val held   = RegInit(0.U(3.W)) // bytes in `behind`; reset: none
  private val begun  = RegInit(false.B)  // a byte of the frame has been given; reset: no

  private val whole = step && in.valid && in.payload && high
  byte.valid := whole && held === 4.U
  byte.bits  := behind(3)
  first      := !begun
  end.valid  := RegNext(step && in.valid && in.last, false.B)
  end.bits   := RegNext(!in.bad)

  when(step && in.valid) {
    when(in.payload) {
      high := !high
      when(!high) { low := in.data }
    }
    when(whole) {
      behind(0) := Cat(in.data, low)
      for (i <- 1 until 4) behind(i) := behind(i - 1)
      when(held =/= 4.U) { held := held + 1.U }.otherwise { begun := true.B }
    }
    when(!in.payload || in.last) {
      high  := false.B
      held  := 0.U
      begun := false.B
    }
  }
}

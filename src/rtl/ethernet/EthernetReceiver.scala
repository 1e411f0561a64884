package flyframe.ethernet

import chisel3._
import chisel3.util._
import flyframe.mii.NibbleStream

/** The bytes of frames behind a receiver, from the destination address to the FCS (MST-13).
  *
  * Nobody knows which are the last four before the frame is over: who takes the bytes must not take what may
  * be FCS for content. `end` follows the last byte of every frame, at least a cycle later, and tells whether
  * it was good: what came of a bad one is void.
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

  private val low   = Reg(UInt(4.W))
  private val high  = RegInit(false.B) // the next nibble is a high one; reset: no frame
  private val begun = RegInit(false.B) // a byte of the frame has been given; reset: no

  byte.valid := step && in.valid && in.payload && high
  byte.bits  := Cat(in.data, low)
  first      := !begun
  end.valid  := RegNext(step && in.end, false.B)
  end.bits   := RegNext(!in.bad)

  when(step && in.valid) {
    low  := in.data
    high := in.payload && !high
    when(high) { begun := true.B }
    when(!in.payload) { begun := false.B }
  }
}

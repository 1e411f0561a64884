package flyframe.master

import chisel3._
import chisel3.util._

/** Frames of two sources on their way to one sender: whole frames, those of the first source first. */
class FrameArbiter extends Module {
  val in  = IO(Vec(2, Flipped(Decoupled(new FrameByte))))
  val out = IO(Decoupled(new FrameByte))

  private val inside = RegInit(false.B) // within a frame; reset: between two
  private val chosen = Reg(Bool())
  private val second = Mux(inside, chosen, !in(0).valid)
  out.valid   := Mux(second, in(1).valid, in(0).valid)
  out.bits    := Mux(second, in(1).bits, in(0).bits)
  in(0).ready := out.ready && !second
  in(1).ready := out.ready && second
  when(out.fire) {
    inside := !out.bits.last
    chosen := second
  }
}

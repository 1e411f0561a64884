package flyframe.memory

import chisel3._
import chisel3.util._

/** A queue in block RAM: what goes in comes out two cycles later at the earliest.
  *
  * @param depth
  *   entries, a power of two
  */
class RamQueue[T <: Data](gen: T, depth: Int) extends Module {
  val in  = IO(Flipped(Decoupled(gen)))
  val out = IO(Decoupled(gen))

  private val ram   = DualPortRam(depth, gen.getWidth)(clock)
  private val first = RegInit(0.U(log2Ceil(depth).W)) // reset: empty
  private val count = RegInit(0.U(log2Ceil(depth + 1).W))

  // The RAM answers a cycle after the head has changed.
  private val valid = RegNext(count =/= 0.U && !out.fire, false.B)
  in.ready            := count =/= depth.U
  ram.io.write        := in.fire
  ram.io.writeAddress := first + count
  ram.io.writeData    := in.bits.asUInt
  ram.io.readAddress  := first
  out.valid           := valid
  out.bits            := ram.io.readData.asTypeOf(gen)
  when(out.fire) { first := first + 1.U }
  count := count + in.fire - out.fire
}

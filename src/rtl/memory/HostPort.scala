package flyframe.memory

import chisel3._

/** A plain synchronous host port: hold `req` with address, direction and data until `ack`; `rdata` is valid
  * with it. Then `req` must be low for a cycle. Words are `lanes` bytes, the address bits within a word are
  * ignored, `be` enables bytes of a write.
  */
class HostPort(lanes: Int) extends Bundle {
  val req   = Input(Bool())
  val write = Input(Bool())
  val addr  = Input(UInt(16.W))
  val wdata = Input(UInt((8 * lanes).W))
  val be    = Input(UInt(lanes.W))
  val ack   = Output(Bool())
  val rdata = Output(UInt((8 * lanes).W))
}

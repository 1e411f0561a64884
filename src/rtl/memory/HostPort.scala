package flyframe.memory

import chisel3._

/** A plain synchronous host port. The host holds `req` with address, direction and data until `ack` comes;
  * `rdata` is valid in that cycle. Then `req` must be low for a cycle. Words have `lanes` bytes; the address
  * bits within a word are ignored, and `be` says which bytes of a word are accessed.
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

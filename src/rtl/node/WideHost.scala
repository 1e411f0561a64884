package flyframe.node

import chisel3._
import chisel3.util._
import flyframe.lanes.Lanes
import flyframe.memory.HostPort

/** Makes accesses of 32 bits of those of a narrower host: byte enables say which part of a word is meant.
  *
  * @param lanes
  *   bytes of the host's words: 1, 2 or 4
  */
class WideHost(lanes: Int) extends Module {
  val narrow = IO(new HostPort(lanes))
  val wide   = IO(Flipped(new HostPort(4)))

  // The first byte of the part, of 4.
  private val first = if (lanes == 4) 0.U(2.W) else (narrow.addr(1, 0) >> log2Ceil(lanes)) << log2Ceil(lanes)
  wide.req   := narrow.req
  wide.write := narrow.write
  wide.addr  := narrow.addr
  wide.wdata := Fill(4 / lanes, narrow.wdata)
  wide.be    := (narrow.be << first)(3, 0)
  narrow.ack := wide.ack
  narrow.rdata := Mux1H((0 until 4 by lanes).map { i =>
    (first === i.U) -> Cat((0 until lanes).reverse.map(n => Lanes.byte(wide.rdata, i + n)))
  })
}

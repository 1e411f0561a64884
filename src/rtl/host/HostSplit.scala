package flyframe.host

import chisel3._
import flyframe.memory.HostPort

/** Two address spaces at one host port (GW-01): bit 15 of the address says which. Each sees the accesses to
  * it only, from its address 0 on. Without registers: the host holds an access until it is done.
  *
  * @param lanes
  *   bytes of a word: 1, 2 or 4
  */
class HostSplit(lanes: Int) extends RawModule {
  val host  = IO(new HostPort(lanes))
  val lower = IO(Flipped(new HostPort(lanes)))
  val upper = IO(Flipped(new HostPort(lanes)))

  private val isUpper = host.addr(15)
  for ((port, isMeant) <- Seq(lower -> !isUpper, upper -> isUpper)) {
    port.req   := host.req && isMeant
    port.write := host.write
    port.addr  := host.addr(14, 0)
    port.wdata := host.wdata
    port.be    := host.be
  }
  host.ack   := Mux(isUpper, upper.ack, lower.ack)
  host.rdata := Mux(isUpper, upper.rdata, lower.rdata)
}

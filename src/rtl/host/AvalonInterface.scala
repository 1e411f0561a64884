package flyframe.host

import chisel3._
import chisel3.util._
import flyframe.params.EscParams

/** An agent of Avalon-MM (Avalon Interface Specifications, "typical read and write transfers"): addresses are
  * those of words, an access takes as long as `waitrequest` is high, and data of a read are there in the last
  * cycle.
  */
class AvalonPins(lanes: Int) extends Bundle {
  val address     = Input(UInt((16 - log2Ceil(lanes)).W))
  val read        = Input(Bool())
  val write       = Input(Bool())
  val byteenable  = Input(UInt(lanes.W))
  val writedata   = Input(UInt((8 * lanes).W))
  val readdata    = Output(UInt((8 * lanes).W))
  val waitrequest = Output(Bool())
}

/** Avalon-MM (`hostInterface` 1). */
class AvalonInterface(p: EscParams) extends HostInterface(p) {
  val avalon = IO(new AvalonPins(p.lanes))
  def pins   = avalon
  def prefix = "avalon"

  private val access = hold(avalon.read, avalon.write) { _ =>
    val asked = Wire(new HostRequest(p.lanes))
    asked.addr  := avalon.address << log2Ceil(p.lanes)
    asked.wdata := avalon.writedata
    asked.be    := avalon.byteenable
    asked
  }
  avalon.readdata    := port.rdata
  avalon.waitrequest := !access.done

  private val both = avalon.read && avalon.write
  side.error.valid := access.withdrawn || (both && !RegNext(both, false.B)) // reset: there was no access
  side.error.bits  := Cat(access.withdrawn, both)
}

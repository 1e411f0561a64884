package flyframe.host

import chisel3._
import chisel3.util._
import flyframe.params.EscParams

/** A slave of Wishbone B4: classic cycles, and single ones of a pipelined master, which `stall` holds.
  * Addresses are those of words, `sel` says which bytes of one.
  */
class WishbonePins(lanes: Int) extends Bundle {
  val cyc   = Input(Bool())
  val stb   = Input(Bool())
  val we    = Input(Bool())
  val adr   = Input(UInt((16 - log2Ceil(lanes)).W))
  val sel   = Input(UInt(lanes.W))
  val dat_w = Input(UInt((8 * lanes).W))
  val dat_r = Output(UInt((8 * lanes).W))
  val ack   = Output(Bool())
  val stall = Output(Bool())
}

/** Wishbone B4 (`hostInterface` 3). */
class WishboneInterface(p: EscParams) extends HostInterface(p) {
  val wb     = IO(new WishbonePins(p.lanes))
  def pins   = wb
  def prefix = "wb"

  private val asks = wb.cyc && wb.stb
  private val access = hold(asks && !wb.we, asks && wb.we) { _ =>
    val asked = Wire(new HostRequest(p.lanes))
    asked.addr  := wb.adr << log2Ceil(p.lanes)
    asked.wdata := wb.dat_w
    asked.be    := wb.sel
    asked
  }
  wb.dat_r := port.rdata
  wb.ack   := access.done
  wb.stall := !access.done

  side.error.valid := access.withdrawn
  side.error.bits  := 2.U // as with Avalon-MM
}

package flyframe.host

import chisel3._
import chisel3.util._
import flyframe.params.EscParams

/** A subordinate of AXI4-Lite with 32 bits of data; addresses are those of bytes. */
class AxiLitePins extends Bundle {
  val awaddr  = Input(UInt(16.W))
  val awprot  = Input(UInt(3.W))
  val awvalid = Input(Bool())
  val awready = Output(Bool())
  val wdata   = Input(UInt(32.W))
  val wstrb   = Input(UInt(4.W))
  val wvalid  = Input(Bool())
  val wready  = Output(Bool())
  val bresp   = Output(UInt(2.W))
  val bvalid  = Output(Bool())
  val bready  = Input(Bool())
  val araddr  = Input(UInt(16.W))
  val arprot  = Input(UInt(3.W))
  val arvalid = Input(Bool())
  val arready = Output(Bool())
  val rdata   = Output(UInt(32.W))
  val rresp   = Output(UInt(2.W))
  val rvalid  = Output(Bool())
  val rready  = Input(Bool())
}

/** AXI4-Lite (`hostInterface` 2). One access at a time; if read and write wait for each other, they take
  * turns. Every access is answered with OKAY: what may not be accessed reads 0 and ignores writes, as on
  * every other host interface. A read takes all four bytes of the word, so that nothing is acknowledged by
  * reading (`acknowledgeByWrite`).
  */
class AxiLiteInterface(p: EscParams) extends HostInterface(p) {
  val axi    = IO(new AxiLitePins)
  def pins   = axi
  def prefix = "axi"

  // reset: no answer is due
  private val bValid   = RegInit(false.B)
  private val rValid   = RegInit(false.B)
  private val lastRead = RegInit(false.B) // reset: whoever comes first
  private val data     = RegEnable(port.rdata, port.ack && !port.write)

  // What a word is answered to must have been taken before the next one is asked for.
  private val writes = axi.awvalid && axi.wvalid && !bValid
  private val reads  = axi.arvalid && !rValid
  private val access = hold(reads, writes, writeFirst = lastRead) { write =>
    val asked = Wire(new HostRequest(p.lanes))
    asked.addr  := Mux(write, axi.awaddr, axi.araddr)
    asked.wdata := axi.wdata
    asked.be    := Mux(write, axi.wstrb, 0xf.U)
    asked
  }
  when(port.ack) { lastRead := !port.write }

  // No way leads from a valid to a ready, as AXI demands.
  axi.awready := access.writeReady
  axi.wready  := access.writeReady
  axi.arready := access.readReady
  when(axi.bready) { bValid := false.B }
  when(axi.rready) { rValid := false.B }
  when(access.done) {
    when(port.write) { bValid := true.B }.otherwise { rValid := true.B }
  }
  axi.bvalid := bValid
  axi.bresp  := 0.U
  axi.rvalid := rValid
  axi.rdata  := data
  axi.rresp  := 0.U

  private def withdrawn(valid: Bool, ready: Bool) = RegNext(valid && !ready, false.B) && !valid // reset: none
  side.error.bits := Cat(
    withdrawn(axi.arvalid, axi.arready),
    withdrawn(axi.wvalid, axi.wready),
    withdrawn(axi.awvalid, axi.awready)
  )
  side.error.valid := side.error.bits.orR
}

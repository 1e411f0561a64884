package flyframe.ram

import chisel3._
import chisel3.util._

/** The pins of a [[DualPortRam]]. */
class DualPortRamIO(depth: Int, width: Int) extends Bundle {
  private val addressBits = log2Ceil(depth) max 1
  val clock               = Input(Clock())
  val write               = Input(Bool())
  val writeAddress        = Input(UInt(addressBits.W))
  val writeData           = Input(UInt(width.W))
  val readAddress         = Input(UInt(addressBits.W))
  val readData            = Output(UInt(width.W))
}

/** The pins of a [[DualPortRam]] that somebody else has, from the side of who uses it. */
class RamUse(depth: Int, width: Int) extends Bundle {
  private val addressBits = log2Ceil(depth) max 1
  val write               = Output(Bool())
  val writeAddress        = Output(UInt(addressBits.W))
  val writeData           = Output(UInt(width.W))
  val readAddress         = Output(UInt(addressBits.W))
  val readData            = Input(UInt(width.W))
}

/** A memory with one write and one read port on one clock, in the form every FPGA tool maps to block RAM (M9K
  * on Cyclone IV).
  *
  * The read answers one cycle later; reading a word while it is written gives the old word. Contents are
  * undefined after power-on.
  *
  * @param depth
  *   number of words
  * @param width
  *   bits per word
  */
class DualPortRam(depth: Int, width: Int)
    extends BlackBox(Map("DEPTH" -> depth, "ADDRESS_BITS" -> (log2Ceil(depth) max 1), "WIDTH" -> width))
    with HasBlackBoxInline {
  override def desiredName = "DualPortRam"
  val io                   = IO(new DualPortRamIO(depth, width))

  /** It belongs to somebody else alone. */
  def serves(use: RamUse): Unit = {
    io.write        := use.write
    io.writeAddress := use.writeAddress
    io.writeData    := use.writeData
    io.readAddress  := use.readAddress
    use.readData    := io.readData
  }

  // Hand-written, because the memory model of the Verilog emitter reads with a registered address, for which
  // Quartus adds bypass logic around the block RAM.
  setInline(
    "DualPortRam.v",
    """// One write and one read port, one clock; infers block RAM.
      |module DualPortRam #(
      |  parameter DEPTH = 1024,
      |  parameter ADDRESS_BITS = 10,
      |  parameter WIDTH = 8
      |) (
      |  input                         clock,
      |  input                         write,
      |  input      [ADDRESS_BITS-1:0] writeAddress,
      |  input      [WIDTH-1:0]        writeData,
      |  input      [ADDRESS_BITS-1:0] readAddress,
      |  output reg [WIDTH-1:0]        readData
      |);
      |  reg [WIDTH-1:0] words [0:DEPTH-1];
      |  always @(posedge clock) begin
      |    if (write) words[writeAddress] <= writeData;
      |    readData <= words[readAddress];
      |  end
      |endmodule
      |""".stripMargin
  )
}

object DualPortRam {

  /** An instance on the implicit clock of the module under construction. */
  def apply(depth: Int, width: Int)(implicit clock: Clock): DualPortRam = {
    val ram = Module(new DualPortRam(depth, width))
    ram.io.clock := clock
    ram
  }
}

package flyframe.ram

import chisel3._
import chisel3.util._

/** The pins of a [[ConstantRom]]. */
class ConstantRomIO(depth: Int, width: Int) extends Bundle {
  val clock   = Input(Clock())
  val address = Input(UInt((log2Ceil(depth) max 1).W))
  val data    = Output(UInt(width.W))
}

/** A table of constants, in the form every FPGA tool maps to block RAM with contents (M9K on Cyclone IV). It
  * answers one cycle later.
  *
  * @param name
  *   of the Verilog module, unlike that of other tables
  * @param words
  *   the constants; behind them it is 0
  * @param width
  *   bits per word, at most 36 for one M9K
  */
class ConstantRom(name: String, words: Seq[BigInt], width: Int) extends BlackBox with HasBlackBoxInline {
  for (word <- words)
    require(word >= 0 && word.bitLength <= width, s"word is $word but must have at most $width bits.")
  override def desiredName = name
  val io                   = IO(new ConstantRomIO(words.size, width))

  private val addressBits = io.address.getWidth
  private val cases = words.zipWithIndex.map { case (word, i) =>
    s"      $addressBits'd$i: data <= $width'h${word.toString(16)};"
  }
  setInline(
    s"$name.v",
    s"""// A table of constants; infers block RAM.
       |module $name (
       |  input                 clock,
       |  input      [${addressBits - 1}:0] address,
       |  (* romstyle = "M9K" *) output reg [${width - 1}:0] data
       |);
       |  always @(posedge clock)
       |    case (address)
       |${cases.mkString("\n")}
       |      default: data <= $width'h0;
       |    endcase
       |endmodule
       |""".stripMargin
  )
}

object ConstantRom {

  /** One on this clock. */
  def apply(name: String, words: Seq[BigInt], width: Int)(clock: Clock): ConstantRomIO = {
    val rom = Module(new ConstantRom(name, words, width))
    rom.io.clock := clock
    rom.io
  }
}

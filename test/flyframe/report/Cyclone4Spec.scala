package flyframe.report

import java.nio.file.Files
import org.scalatest.flatspec.AnyFlatSpec
import flyframe.Directory
import flyframe.board.Shell

/** What yosys and the count make of designs small enough to count by hand. */
class Cyclone4Spec extends AnyFlatSpec {

  /** The area of a module `top` of this text, after the commands for it. */
  private def area(commands: String => String, verilog: String): Area = {
    var area = Area()
    Directory { d =>
      val source = Files.writeString(d.resolve("top.v"), verilog)
      val result = d.resolve("top.json")
      Shell.output("yosys", "-q", "-p", s"read_verilog $source; ${commands("top")}; write_json $result")
      area = Netlist.own(Netlist.read(result)("modules")("top"))
    }
    area
  }

  private val flows = Seq[(String, String => String)](
    "as one module"     -> Cyclone4.flat,
    "module by module"  -> Cyclone4.byModule,
    "with carry chains" -> Cyclone4.withCarry
  )

  /** A memory; each bit it is given is made of two pins, which takes one LUT. */
  private def memory(words: Int, width: Int): String = {
    val bits               = Integer.numberOfTrailingZeros(Integer.highestOneBit(words * 2 - 1))
    def pins(pins: String) = s"input [${bits - 1}:0] $pins"
    s"""module top (input clock, w, v, r, s, ${pins("a, b")}, ${pins("c, d")},
       |  input [${width - 1}:0] x, y, output reg [${width - 1}:0] q);
       |  reg [${width - 1}:0] words [0:${words - 1}];
       |  always @(posedge clock) begin
       |    if (w ^ v) words[a ^ b] <= x ^ y;
       |    if (r ^ s) q <= words[c ^ d];
       |  end
       |endmodule""".stripMargin
  }

  for ((name, commands) <- flows)
    s"What makes a memory's addresses, data and enables, $name," should "be counted" in {
      // 1,024 words of 8 bits: two addresses of 10 bits, the data, write and read enable.
      assert(area(commands, memory(1024, 8)) == Area(luts = 2 * 10 + 8 + 2, m9k = 1, ramBits = 8192))
      assert(area(commands, memory(256, 36)) == Area(luts = 2 * 8 + 36 + 2, m9k = 1, ramBits = 9216))
    }

  "Memories" should "take as many blocks as their words and widths need" in {
    val shapes = Seq((8192, 1) -> 1, (512, 18) -> 1, (1024, 9) -> 1, (512, 36) -> 2, (1024, 16) -> 2)
    for (((words, width), blocks) <- shapes)
      assert(area(Cyclone4.flat, memory(words, width)).m9k == blocks, s"$words words of $width bits")
  }

  they should "be registers where a block would be almost empty" in {
    val small = area(Cyclone4.flat, memory(8, 4))
    assert(small.m9k == 0 && small.ffs >= 8 * 4)
  }

  /** Names of numbers, and what Verilog calls them. */
  private val kinds = Seq("unsigned" -> "", "signed" -> "signed")

  /** A function of two numbers of `width` bits and one bit c. */
  private def function(width: Int, result: String, value: String, kind: String = "") =
    s"""module top (input $kind [${width - 1}:0] a, b, input c, output $result y);
       |  assign y = $value;
       |endmodule""".stripMargin

  for ((value, more) <- Seq("a + b" -> 0, "a - b" -> 0, "a + 1" -> 0, "a + b + c" -> 1))
    s"$value with carry chains" should "take a logic element per bit" in {
      for (width <- Seq(4, 16, 32))
        assert(
          area(Cyclone4.withCarry, function(width, s"[${width - 1}:0]", value)).logicElements == width + more
        )
      assert(area(Cyclone4.flat, function(32, "[31:0]", value)).logicElements > 32 + more)
    }

  for (value <- Seq("a < b", "b < a", "a <= b", "a > b", "a >= b"); (name, kind) <- kinds)
    s"$value, $name, with carry chains" should "take an element per bit and sign, one if inverted" in {
      val size = area(Cyclone4.withCarry, function(16, "", value, kind)).logicElements
      assert(size == 17 || size == 18)
    }

  "A comparison with a constant" should "take no chain" in {
    val verilog = function(16, "", "a < 1500")
    assert(area(Cyclone4.withCarry, verilog) == area(Cyclone4.flat, verilog))
  }

  "A counter with carry chains" should "be cleared in its own logic elements" in {
    val verilog = """module top (input clock, clear, enable, output reg [15:0] y);
      |  always @(posedge clock) if (clear) y <= 0; else if (enable) y <= y + 1;
      |endmodule""".stripMargin
    // One makes the enable, which is given while it is cleared, too.
    assert(area(Cyclone4.withCarry, verilog) == Area(luts = 16 + 1, ffs = 16, paired = 16))
  }

  for ((name, commands) <- flows)
    s"Registers with one enable and one reset, $name," should "share what makes them" in {
      val verilog = """module top (input clock, reset, e, f, input [7:0] d, output reg [7:0] q);
        |  always @(posedge clock or posedge reset) if (reset) q <= 0; else if (e ^ f) q <= d;
        |endmodule""".stripMargin
      assert(area(commands, verilog) == Area(luts = 2, ffs = 8))
    }

  private val functions = Seq("a + b", "a - b", "b - a", "a + 1", "a + b + c", "c ? a - b : a + b") ++
    (for (operation <- Seq("<", "<=", ">", ">="); other <- Seq("b", "5", "-3"))
      yield s"a $operation $other")

  /** What a logic element does: of its mask, the half for datad = 0 is also that of the carry. */
  private val logicElement =
    """module cycloneive_lcell_comb (input dataa, datab, datac, datad, cin, output combout, cout);
      |  parameter [15:0] lut_mask = 0;
      |  parameter sum_lutc_input = "datac";
      |  parameter dont_touch = "off", lpm_type = "";
      |  wire third = sum_lutc_input == "cin" ? cin : datac;
      |  assign combout = lut_mask[{datad, third, datab, dataa}];
      |  assign cout = lut_mask[{1'b0, cin, datab, dataa}];
      |endmodule""".stripMargin

  for ((name, kind) <- kinds)
    s"Carry chains, $name," should "compute what was written" in Directory { d =>
      val results = functions.zipWithIndex
      val ports   = results.map { case (_, i) => s"output $kind [6:0] y$i" }.mkString(", ")
      val values  = results.map { case (value, i) => s"  assign y$i = $value;\n" }.mkString
      val verilog = s"module top (input $kind [5:0] a, b, input c, $ports);\n${values}endmodule\n"
      val source  = Files.writeString(d.resolve("top.v"), verilog)
      val cell    = Files.writeString(d.resolve("cell.v"), logicElement)
      val script = Seq(
        s"read_verilog $source",
        "prep -top top",
        "design -save written",
        Cyclone4.withCarry("top"),
        // One chain makes differences and their signs.
        "select -assert-min 30 t:cycloneive_lcell_comb r:sum_lutc_input=cin %i",
        s"techmap -map $cell",
        "design -stash mapped",
        "design -copy-from written -as written top",
        "design -copy-from mapped -as mapped top",
        "miter -equiv -flatten -make_assert written mapped both",
        "sat -verify -prove-asserts both"
      )
      Shell.output("yosys", "-q", "-p", script.mkString("; "))
    }
}

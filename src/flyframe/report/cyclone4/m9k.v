// Block RAM as a Cyclone IV has it, for yosys `techmap`, from the cells that `memory_bram` leaves: a write
// port a and a read port b. The map of yosys 0.23 itself leaves the read address open, so that the logic that
// makes the address would be swept away.
module \$__M9K_ALTSYNCRAM_SINGLEPORT_FULL (
  input                  CLK2,
  input                  CLK3,
  input  [CFG_ABITS-1:0] A1ADDR,
  output [CFG_DBITS-1:0] A1DATA,
  input                  A1EN,
  input  [CFG_ABITS-1:0] B1ADDR,
  input  [CFG_DBITS-1:0] B1DATA,
  input                  B1EN
);
  parameter CFG_ABITS = 8;
  parameter CFG_DBITS = 36;
  parameter CLKPOL2 = 1;
  parameter CLKPOL3 = 1;
  parameter [(1 << CFG_ABITS) * CFG_DBITS - 1:0] INIT = 0; // of a table of constants; not counted

  altsyncram #(
    .operation_mode("DUAL_PORT"),
    .numwords_a(1 << CFG_ABITS),
    .widthad_a(CFG_ABITS),
    .width_a(CFG_DBITS),
    .numwords_b(1 << CFG_ABITS),
    .widthad_b(CFG_ABITS),
    .width_b(CFG_DBITS)
  ) _TECHMAP_REPLACE_ (
    .clock0(CLK3),
    .wren_a(B1EN),
    .address_a(B1ADDR),
    .data_a(B1DATA),
    .clock1(CLK2),
    .rden_b(A1EN),
    .address_b(A1ADDR),
    .q_b(A1DATA)
  );
endmodule

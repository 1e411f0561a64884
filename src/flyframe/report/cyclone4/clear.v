// A register with the synchronous clear that a logic element of a Cyclone IV has, for yosys `techmap`.
module \$_SDFFCE_PP0P_ (input D, C, R, E, output Q);
  dffeas _TECHMAP_REPLACE_ (.d(D), .q(Q), .clk(C), .clrn(1'b1), .prn(1'b1), .ena(E), .sclr(R));
  wire _TECHMAP_REMOVEINIT_Q_ = 1;
endmodule

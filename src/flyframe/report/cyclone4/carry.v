// Adders and comparators on the carry chain of a Cyclone IV, for yosys `techmap`: yosys 0.23 itself builds
// them of look-up tables. Used twice: before `alumacc`, when comparisons are cells of their own, and behind
// it, when all that adds is `$alu`.

// A comparison is the sign of a difference, and so one logic element per bit, in whatever order the operands
// stand. Against a constant it is no chain: a look-up table compares several bits at once with it.
(* techmap_celltype = "$lt $le $gt $ge" *)
module comparison (A, B, Y);
  parameter A_SIGNED = 0;
  parameter B_SIGNED = 0;
  parameter A_WIDTH = 1;
  parameter B_WIDTH = 1;
  parameter Y_WIDTH = 1;
  parameter _TECHMAP_CELLTYPE_ = "";
  parameter [A_WIDTH-1:0] _TECHMAP_CONSTMSK_A_ = 0;
  parameter [B_WIDTH-1:0] _TECHMAP_CONSTMSK_B_ = 0;
  localparam SWAPPED = _TECHMAP_CELLTYPE_ == "$gt" || _TECHMAP_CELLTYPE_ == "$le";
  localparam INVERTED = _TECHMAP_CELLTYPE_ == "$ge" || _TECHMAP_CELLTYPE_ == "$le";
  localparam SIGN = A_WIDTH > B_WIDTH ? A_WIDTH : B_WIDTH;
  input [A_WIDTH-1:0] A;
  input [B_WIDTH-1:0] B;
  output [Y_WIDTH-1:0] Y;
  wire [SIGN:0] a, b;
  \$pos #(.A_SIGNED(A_SIGNED), .A_WIDTH(A_WIDTH), .Y_WIDTH(SIGN + 1)) extended_a (.A(A), .Y(a));
  \$pos #(.A_SIGNED(B_SIGNED), .A_WIDTH(B_WIDTH), .Y_WIDTH(SIGN + 1)) extended_b (.A(B), .Y(b));
  wire [SIGN:0] left = SWAPPED ? b : a;
  wire [SIGN:0] right = SWAPPED ? a : b;
  wire [SIGN:0] less; // [i]: left is less than right, up to bit i
  genvar i;
  generate
    if (&_TECHMAP_CONSTMSK_A_ || &_TECHMAP_CONSTMSK_B_)
      for (i = 0; i <= SIGN; i = i + 1) begin : step
        wire below = i == 0 ? 1'b0 : less[i-1];
        assign less[i] = left[i] == right[i] ? below : i == SIGN ? left[i] : right[i];
      end
    else assign less = left - right;
  endgenerate
  assign Y = less[SIGN] ^ INVERTED;
endmodule

// One logic element per bit: in arithmetic mode its `combout` is the sum of dataa, datab and cin, its `cout`
// their carry; each has half of the mask. For A - B the mask inverts B. A carry that comes from elsewhere
// takes an element more. Under four bits look-up tables do as well.
(* techmap_celltype = "$alu" *)
module chain (A, B, CI, BI, X, Y, CO);
  parameter A_SIGNED = 0;
  parameter B_SIGNED = 0;
  parameter A_WIDTH = 1;
  parameter B_WIDTH = 1;
  parameter Y_WIDTH = 1;
  parameter _TECHMAP_CONSTMSK_BI_ = 0;
  parameter _TECHMAP_CONSTVAL_BI_ = 0;
  parameter _TECHMAP_CONSTMSK_CI_ = 0;
  localparam SUBTRACTS = _TECHMAP_CONSTMSK_BI_ == 1 && _TECHMAP_CONSTVAL_BI_ == 1;
  input [A_WIDTH-1:0] A;
  input [B_WIDTH-1:0] B;
  input CI, BI;
  output [Y_WIDTH-1:0] X, Y, CO;
  wire _TECHMAP_FAIL_ = Y_WIDTH < 4;
  wire [Y_WIDTH-1:0] a, b;
  \$pos #(.A_SIGNED(A_SIGNED), .A_WIDTH(A_WIDTH), .Y_WIDTH(Y_WIDTH)) extended_a (.A(A), .Y(a));
  \$pos #(.A_SIGNED(B_SIGNED), .A_WIDTH(B_WIDTH), .Y_WIDTH(Y_WIDTH)) extended_b (.A(B), .Y(b));
  wire [Y_WIDTH-1:0] inverted = b ^ {Y_WIDTH{BI}};
  assign X = a ^ inverted;
  assign CO = (a & inverted) | (X & ~Y);
  wire [Y_WIDTH:0] carry;
  genvar i;
  generate
    if (_TECHMAP_CONSTMSK_CI_ == 1) assign carry[0] = CI;
    else
      cycloneive_lcell_comb #(.lut_mask(16'h00aa), .sum_lutc_input("cin")) carry_in (
        .dataa(CI),
        .datab(1'b1),
        .cin(1'b0),
        .cout(carry[0])
      );
    for (i = 0; i < Y_WIDTH; i = i + 1) begin : slice
      cycloneive_lcell_comb #(.lut_mask(SUBTRACTS ? 16'h69b2 : 16'h96e8), .sum_lutc_input("cin")) sum (
        .dataa(a[i]),
        .datab(SUBTRACTS ? b[i] : inverted[i]),
        .datad(1'b1),
        .cin(carry[i]),
        .combout(Y[i]),
        .cout(carry[i+1])
      );
    end
  endgenerate
endmodule

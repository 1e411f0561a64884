// Stands in for the vendor's PLL in checks: a black box for Yosys. In simulation the pin clk_50 runs at the
// core clock, as nothing here can multiply; the PHYs' clock is a quarter of it (100 MHz, twice the pin's) or
// a half (50 MHz).
(* blackbox *)
module altpll #(
  parameter intended_device_family = "", lpm_type = "", operation_mode = "", compensate_clock = "",
  parameter inclk0_input_frequency = 0,
  parameter clk0_multiply_by = 1, clk0_divide_by = 1, clk0_duty_cycle = 50, clk0_phase_shift = "0",
  parameter clk1_multiply_by = 1, clk1_divide_by = 1, clk1_duty_cycle = 50, clk1_phase_shift = "0",
  parameter clk2_multiply_by = 1, clk2_divide_by = 1, clk2_duty_cycle = 50, clk2_phase_shift = "0",
  parameter clk3_multiply_by = 1, clk3_divide_by = 1, clk3_duty_cycle = 50, clk3_phase_shift = "0",
  parameter width_clock = 5
) (
  input  [1:0] inclk,
  input        areset,
  output [4:0] clk,
  output       locked
);
`ifdef VERILATOR
  /* verilator lint_off UNUSED */
  reg [7:0] count = 0;
  always @(posedge inclk[0]) count <= areset ? 8'd0 : count[7] ? {6'h20, count[1:0] + 2'd1} : count + 8'd1;
  assign clk    = {3'b0, ~count[clk0_multiply_by - 1], inclk[0]};
  assign locked = count[7];
`endif
endmodule

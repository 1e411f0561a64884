// The repeater as a slave with a 100 MHz core clock and an 8-bit host port.
`include "repeater_core.vh"

module repeater (
    input  wire clock, reset, phy_clk_ref, pdi_operational,
    input  wire mii_0_rx_clk, mii_0_rx_dv, mii_0_rx_er, mii_0_link,
    input  wire [3:0] mii_0_rxd,
    output wire mii_0_tx_en, output wire [3:0] mii_0_txd,
    input  wire mii_1_rx_clk, mii_1_rx_dv, mii_1_rx_er, mii_1_link,
    input  wire [3:0] mii_1_rxd,
    output wire mii_1_tx_en, output wire [3:0] mii_1_txd,
    output wire mii_tx_tick,
    input  wire host_req, host_write,
    input  wire [15:0] host_addr,
    input  wire [7:0] host_wdata,
    input  wire [0:0] host_be,
    output wire host_ack,
    output wire [7:0] host_rdata
);
  repeater_core #(.CYCLES(4), .WIDTH(8)) core (.*);
endmodule

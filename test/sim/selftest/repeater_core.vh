// A two-port nibble repeater with the pins of a flyframe slave: what the simulator proves itself with,
// without any flyframe RTL. Port 0 goes to port 1 and back; the host port reaches a plain memory. Shared by
// repeater.v and repeater-wide.v.
`default_nettype none

// Received symbols, each {RX_DV ended, data}, from the receive clock into the core clock, played out one per
// nibble slot.
module repeater_path (
    input  wire       clock, reset, tick_next,
    input  wire       rx_clk, rx_dv, rx_er, link,
    input  wire [3:0] rxd,
    output reg        tx_en,
    output reg  [3:0] txd
);
  reg [4:0] ring [0:15];
  reg [3:0] wr = 0, gray = 0;
  reg       dv_q = 0;
  wire      put = (rx_dv || dv_q) && link;
  always @(posedge rx_clk) begin
    dv_q <= rx_dv && link;
    if (put) begin
      ring[wr] <= {!rx_dv, rxd ^ {3'b0, rx_er}};
      wr       <= wr + 4'd1;
    end
    gray <= wr ^ (wr >> 1);
  end

  reg [3:0] gray_a, gray_b, rd;
  wire [3:0] wr_core = {gray_b[3], ^gray_b[3:2], ^gray_b[3:1], ^gray_b[3:0]};
  wire [3:0] fill = wr_core - rd;
  always @(posedge clock) begin
    gray_a <= gray;
    gray_b <= gray_a;
    if (reset) begin
      rd <= 0; tx_en <= 0; txd <= 0;
    end else if (tick_next) begin
      // A margin of two symbols at the start absorbs the slip between the clocks.
      if (tx_en ? rd != wr_core : fill >= 4'd2) begin
        tx_en <= !ring[rd][4];
        txd   <= ring[rd][4] ? 4'd0 : ring[rd][3:0];
        rd    <= rd + 4'd1;
      end
    end
  end
endmodule

module repeater_core #(parameter CYCLES = 4, parameter WIDTH = 8) (
    input  wire clock, reset,
    input  wire mii_0_rx_clk, mii_0_rx_dv, mii_0_rx_er, mii_0_link,
    input  wire [3:0] mii_0_rxd,
    output wire mii_0_tx_en, output wire [3:0] mii_0_txd,
    input  wire mii_1_rx_clk, mii_1_rx_dv, mii_1_rx_er, mii_1_link,
    input  wire [3:0] mii_1_rxd,
    output wire mii_1_tx_en, output wire [3:0] mii_1_txd,
    output reg  mii_tx_tick,
    input  wire host_req, host_write,
    input  wire [15:0] host_addr,
    input  wire [WIDTH-1:0] host_wdata,
    input  wire [WIDTH/8-1:0] host_be,
    output reg  host_ack,
    output reg  [WIDTH-1:0] host_rdata
);
  reg [2:0] slot;
  wire tick_next = slot == 0;
  always @(posedge clock) begin
    slot        <= reset || slot == CYCLES - 1 ? 3'd0 : slot + 3'd1;
    mii_tx_tick <= tick_next && !reset;
  end

  wire       down_en, back_en;
  wire [3:0] down_d, back_d;
  repeater_path up   (clock, reset, tick_next, mii_0_rx_clk, mii_0_rx_dv, mii_0_rx_er, mii_0_link,
                      mii_0_rxd, mii_1_tx_en, mii_1_txd);
  repeater_path down (clock, reset, tick_next, mii_1_rx_clk, mii_1_rx_dv, mii_1_rx_er, mii_1_link,
                      mii_1_rxd, down_en, down_d);
  // With nothing behind port 1, frames turn round here, as in the last slave of a line.
  repeater_path back (clock, reset, tick_next, mii_0_rx_clk, mii_0_rx_dv, mii_0_rx_er, mii_0_link,
                      mii_0_rxd, back_en, back_d);
  assign mii_0_tx_en = mii_1_link ? down_en : back_en;
  assign mii_0_txd   = mii_1_link ? down_d : back_d;

  reg [7:0] memory [0:8191];
  integer i;
  always @(posedge clock) begin
    host_ack <= host_req && !host_ack && !reset;
    for (i = 0; i < WIDTH / 8; i = i + 1) begin
      host_rdata[8*i +: 8] <= memory[host_addr[12:0] + i];
      if (host_req && host_write && host_be[i]) memory[host_addr[12:0] + i] <= host_wdata[8*i +: 8];
    end
  end
endmodule

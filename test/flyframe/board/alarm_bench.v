// The board on a bench: no cables at the PHYs, the host's side of the data bus taken apart for C++.
module alarm_bench #(
  parameter ROLE = 0, CORE_MHZ = 100, DATA_BUS_WIDTH = 16, ADDRESS_BITS = 13 - DATA_BUS_WIDTH / 16
) (
  input                         clk_50,
  output                        phy_clk, phy_reset_n,
  input                         bus_ne, bus_noe, bus_nwe,
  input  [DATA_BUS_WIDTH/8-1:0] bus_nbl,
  input  [ADDRESS_BITS-1:0]     bus_a,
  input                         host_drives,
  input  [DATA_BUS_WIDTH-1:0]   host_d,
  output [DATA_BUS_WIDTH-1:0]   seen_d, // 0 if nobody drives
  output                        bus_nwait, irq, alarm_supply, alarm_buzzer, alarm_lamp, alarm_disabled
);
  wire [DATA_BUS_WIDTH-1:0] bus_d = host_drives ? host_d : {DATA_BUS_WIDTH{1'bz}};
  assign seen_d = bus_d;
`ifdef WIDE_BUS
  assign alarm_disabled = 1'b0;
`endif
  board #(.ROLE(ROLE), .CORE_MHZ(CORE_MHZ), .DATA_BUS_WIDTH(DATA_BUS_WIDTH)) board (
    .clk_50(clk_50), .phy_clk(phy_clk), .phy_reset_n(phy_reset_n),
    .mii_0_rx_clk(1'b0), .mii_0_rx_dv(1'b0), .mii_0_rx_er(1'b0), .mii_0_rxd(4'b0),
    .mii_0_link(1'b1), .mii_0_tx_en(), .mii_0_txd(),
    .mii_1_rx_clk(1'b0), .mii_1_rx_dv(1'b0), .mii_1_rx_er(1'b0), .mii_1_rxd(4'b0),
    .mii_1_link(1'b1), .mii_1_tx_en(), .mii_1_txd(),
    .bus_ne(bus_ne), .bus_noe(bus_noe), .bus_nwe(bus_nwe), .bus_nbl(bus_nbl), .bus_a(bus_a),
    .bus_d(bus_d), .bus_nwait(bus_nwait),
`ifdef RING
    .mii_2_rx_clk(1'b0), .mii_2_rx_dv(1'b0), .mii_2_rx_er(1'b0), .mii_2_rxd(4'b0),
    .mii_2_link(1'b1), .mii_2_tx_en(), .mii_2_txd(),
`endif
`ifndef WIDE_BUS
    .config_error(1'b0), .alarm_disabled(alarm_disabled),
`endif
    .irq(irq), .host_ready(1'b1), .alarm_current(3'b001),
    .alarm_supply(alarm_supply), .alarm_buzzer(alarm_buzzer), .alarm_lamp(alarm_lamp)
  );
endmodule

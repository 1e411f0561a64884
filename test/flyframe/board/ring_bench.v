// The ring board on a bench: no cables at the PHYs, no EEPROM, the host's side of the data bus taken apart
// for C++.
module ring_bench #(parameter CORE_MHZ = 100, DATA_BUS_WIDTH = 16) (
  input                         clk_50,
  input                         optical_1_rx, optical_1_signal, optical_2_rx, optical_2_signal,
  output                        optical_1_tx, optical_2_tx,
  input                         can_rx,
  output                        can_tx,  // 1 without a second CAN port
  output                        ring_irq, // of a node its only one
  input                         bus_ne, bus_noe, bus_nwe,
  input  [DATA_BUS_WIDTH/8-1:0] bus_nbl,
  input  [15:0]                 bus_a,  // of words
  input                         host_drives,
  input  [DATA_BUS_WIDTH-1:0]   host_d,
  output [DATA_BUS_WIDTH-1:0]   seen_d, // 0 if nobody drives
  output                        bus_nwait
);
  wire [DATA_BUS_WIDTH-1:0] bus_d = host_drives ? host_d : {DATA_BUS_WIDTH{1'bz}};
  assign seen_d = bus_d;
`ifndef TWISTED_PAIR
  assign can_tx = 1'b1;
`endif
  board #(.CORE_MHZ(CORE_MHZ), .DATA_BUS_WIDTH(DATA_BUS_WIDTH)) board (
    .clk_50(clk_50),
    .optical_1_rx(optical_1_rx), .optical_1_signal(optical_1_signal), .optical_1_tx(optical_1_tx),
    .optical_2_rx(optical_2_rx), .optical_2_signal(optical_2_signal), .optical_2_tx(optical_2_tx),
`ifdef TWISTED_PAIR
    .can_rx(can_rx), .can_tx(can_tx),
`endif
`ifdef PHYS
    .phy_clk(), .phy_reset_n(),
    .mii_0_rx_clk(1'b0), .mii_0_rx_dv(1'b0), .mii_0_rx_er(1'b0), .mii_0_rxd(4'b0),
    .mii_0_link(1'b1), .mii_0_tx_en(), .mii_0_txd(),
`endif
`ifdef GATEWAY
    .mii_1_rx_clk(1'b0), .mii_1_rx_dv(1'b0), .mii_1_rx_er(1'b0), .mii_1_rxd(4'b0),
    .mii_1_link(1'b1), .mii_1_tx_en(), .mii_1_txd(),
    .sii_scl(), .sii_sda(), .led_run(), .led_err(), .led_linkact(), .eeprom_loaded(),
    .irq(), .ring_irq(ring_irq), .bus_a({bus_a[15], bus_a[13:0]}),
`else
    .irq(ring_irq), .bus_a(bus_a[12-DATA_BUS_WIDTH/16:0]),
`endif
    .bus_ne(bus_ne), .bus_noe(bus_noe), .bus_nwe(bus_nwe), .bus_nbl(bus_nbl),
    .bus_d(bus_d), .bus_nwait(bus_nwait)
  );
endmodule

// Board of a node of the fibre ring: an EP4CE6, EP4CE10 or EP4CE15 in package E144 between two optical
// modules and a microcontroller; with one PHY for the plant network as the ring's server, with two as a
// gateway under an EtherCAT master.
//
// Registers and clock crossings are not here but in what flyframe generates with --board: board_support.v
// (resets, host bus) and ring-ROLE.v. This file holds the vendor's PLL, the data pins' direction, and levels.
//
// Macros, set by ring.tcl: CORE is the node's module; TWISTED_PAIR gives it a second CAN port; PHYS is for
// one PHY or two; GATEWAY for the slave over the ring.
`default_nettype none

module board #(
  parameter DATA_BUS_WIDTH    = 8,   // bits, as generated: 8, 16
  parameter CORE_MHZ          = 100, // coreClockMhz, as generated: 50, 100
  parameter SIGNAL_ACTIVE_LOW = 0,   // the optical modules' pin is low for light
`ifdef PHYS
  parameter LINK_ACTIVE_LOW   = 1,   // the PHYs' link pin is low for link
`endif
`ifdef GATEWAY
  parameter SII_TWO_BYTE      = 0,   // 1: an EEPROM of 32 Kbit or more
  // Word address of twice 16 KiB: the host's A15 chooses between slave and ring, whose registers begin at
  // 0x8000, and its A14 has no pin. Follows from the width.
  parameter ADDRESS_BITS      = 15 - DATA_BUS_WIDTH / 16
`else
  // Word address of 8 KiB; follows from the width.
  parameter ADDRESS_BITS      = 13 - DATA_BUS_WIDTH / 16
`endif
) (
  input  wire                        clk_50,           // oscillator, 50 MHz, 25 ppm

  // Optical ports. Port 2 goes to port 1 of the next node, with a fibre for each direction.
  input  wire                        optical_1_rx,
  input  wire                        optical_1_signal,
  output wire                        optical_1_tx,
  input  wire                        optical_2_rx,
  input  wire                        optical_2_signal,
  output wire                        optical_2_tx,

`ifdef TWISTED_PAIR
  // Transceiver of the second CAN port; 0 is dominant.
  input  wire                        can_rx,
  output wire                        can_tx,
`endif

`ifdef PHYS
  // Port 0. Server: the plant network. Gateway: towards the master.
  output wire                        phy_clk,          // for all PHYs: 25 MHz
  output wire                        phy_reset_n,
  input  wire                        mii_0_rx_clk,
  input  wire                        mii_0_rx_dv,
  input  wire                        mii_0_rx_er,
  input  wire [3:0]                  mii_0_rxd,
  input  wire                        mii_0_link,
  output wire                        mii_0_tx_en,
  output wire [3:0]                  mii_0_txd,
`endif

`ifdef GATEWAY
  // Port 1: away from the master.
  input  wire                        mii_1_rx_clk,
  input  wire                        mii_1_rx_dv,
  input  wire                        mii_1_rx_er,
  input  wire [3:0]                  mii_1_rxd,
  input  wire                        mii_1_link,
  output wire                        mii_1_tx_en,
  output wire [3:0]                  mii_1_txd,

  // EEPROM with the device's description, pull-ups of 4.7 kilo-ohm at both lines; LEDs, high active.
  inout  wire                        sii_scl,
  inout  wire                        sii_sda,
  output wire                        led_run,
  output wire                        led_err,
  output wire [1:0]                  led_linkact,
  output wire                        eeprom_loaded,    // high active
  output wire                        ring_irq,         // events of the ring, high active
`endif

  // Asynchronous memory bus of the microcontroller, all but address and data low active.
  input  wire                        bus_ne,
  input  wire                        bus_noe,
  input  wire                        bus_nwe,
  input  wire [DATA_BUS_WIDTH/8-1:0] bus_nbl,
  input  wire [ADDRESS_BITS-1:0]     bus_a,            // in words of the data bus
  inout  wire [DATA_BUS_WIDTH-1:0]   bus_d,
  output wire                        bus_nwait,
  output wire                        irq               // high active
);

  // ---- Clocks: VCO 50 MHz * M 12 / N 1 = 600 MHz; C0 = 600 / CORE_MHZ: core clock, C1 = 24: 25 MHz --------
  wire       core_clk, phy_clk_ref, pll_locked, pll_reset;
  wire [2:0] unused_clk;

  altpll #(
    .intended_device_family("Cyclone IV E"),
    .lpm_type("altpll"),
    .operation_mode("NORMAL"),
    .compensate_clock("CLK0"),
    .inclk0_input_frequency(20000),  // ps
    .clk0_multiply_by(CORE_MHZ / 50),
    .clk0_divide_by(1),
    .clk0_duty_cycle(50),
    .clk0_phase_shift("0"),
    .clk1_multiply_by(1),
    .clk1_divide_by(2),
    .clk1_duty_cycle(50),
    .clk1_phase_shift("0"),
    .width_clock(5)
  ) pll (
    .inclk({1'b0, clk_50}),
    .areset(pll_reset),
    .clk({unused_clk, phy_clk_ref, core_clk}),
    .locked(pll_locked)
  );

  // ---- Reset and host bus ---------------------------------------------------------------------------------
  wire                        reset;
  wire                        host_req, host_write, host_ack;
  wire [15:0]                 host_addr;
  wire [DATA_BUS_WIDTH-1:0]   host_wdata, host_rdata;
  wire [DATA_BUS_WIDTH/8-1:0] host_be;
  wire [DATA_BUS_WIDTH-1:0]   bus_d_out;
  wire                        bus_d_drive;
  wire                        unused_busy_drive; // NWAIT is always driven

`ifdef GATEWAY
  wire [ADDRESS_BITS:0]       bus_address = {bus_a[ADDRESS_BITS-1], 1'b0, bus_a[ADDRESS_BITS-2:0]};
`else
  wire [ADDRESS_BITS+2:0]     bus_address = {3'b000, bus_a};
`endif

  board_support support (
    .clock(core_clk), .pll_locked(pll_locked), .reset(reset), .oscillator(clk_50), .pll_reset(pll_reset),
    .bus_cs_n(bus_ne), .bus_rd(bus_noe), .bus_wr_n(bus_nwe), .bus_be(bus_nbl), .bus_a(bus_address),
    .bus_d_in(bus_d), .bus_d_out(bus_d_out), .bus_d_drive(bus_d_drive),
    .bus_busy(bus_nwait), .bus_busy_drive(unused_busy_drive),
    .host_req(host_req), .host_write(host_write), .host_addr(host_addr),
    .host_wdata(host_wdata), .host_be(host_be), .host_ack(host_ack), .host_rdata(host_rdata)
  );
  assign bus_d = bus_d_drive ? bus_d_out : {DATA_BUS_WIDTH{1'bz}};

  // ---- The node -------------------------------------------------------------------------------------------
`ifdef PHYS
  wire unused_tx_tick;
  assign phy_clk = phy_clk_ref;
`else
  wire unused_phy_clk = phy_clk_ref;
`endif
`ifdef GATEWAY
  wire sii_scl_low, sii_sda_low;
  assign sii_scl = sii_scl_low ? 1'b0 : 1'bz;
  assign sii_sda = sii_sda_low ? 1'b0 : 1'bz;
`endif

  `CORE core (
    .clock(core_clk), .reset(reset),
    .optical_1_rx(optical_1_rx), .optical_1_signal(optical_1_signal ^ (SIGNAL_ACTIVE_LOW != 0)),
    .optical_1_tx(optical_1_tx),
    .optical_2_rx(optical_2_rx), .optical_2_signal(optical_2_signal ^ (SIGNAL_ACTIVE_LOW != 0)),
    .optical_2_tx(optical_2_tx),
`ifdef TWISTED_PAIR
    .can_rx(can_rx), .can_tx(can_tx),
`endif
`ifdef PHYS
    .phy_clk_ref(phy_clk_ref), .phy_reset_n(phy_reset_n), .mii_tx_tick(unused_tx_tick),
    .mii_0_rx_clk(mii_0_rx_clk), .mii_0_rx_dv(mii_0_rx_dv), .mii_0_rx_er(mii_0_rx_er),
    .mii_0_rxd(mii_0_rxd), .mii_0_link(mii_0_link ^ (LINK_ACTIVE_LOW != 0)),
    .mii_0_tx_en(mii_0_tx_en), .mii_0_txd(mii_0_txd),
`endif
`ifdef GATEWAY
    .mii_1_rx_clk(mii_1_rx_clk), .mii_1_rx_dv(mii_1_rx_dv), .mii_1_rx_er(mii_1_rx_er),
    .mii_1_rxd(mii_1_rxd), .mii_1_link(mii_1_link ^ (LINK_ACTIVE_LOW != 0)),
    .mii_1_tx_en(mii_1_tx_en), .mii_1_txd(mii_1_txd),
    .sii_scl_low(sii_scl_low), .sii_sda_low(sii_sda_low), .sii_sda(sii_sda),
    .sii_two_byte(SII_TWO_BYTE != 0), .eeprom_loaded(eeprom_loaded),
    .led_run(led_run), .led_err(led_err), .led_linkact_0(led_linkact[0]), .led_linkact_1(led_linkact[1]),
    .ring_irq(ring_irq),
`endif
    .host_req(host_req), .host_write(host_write), .host_addr(host_addr),
    .host_wdata(host_wdata), .host_be(host_be), .host_ack(host_ack), .host_rdata(host_rdata), .irq(irq)
  );
endmodule

`default_nettype wire

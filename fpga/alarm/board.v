// Board of the smoke-alarm system: an EP4CE6E22C8N between two PHYs and a microcontroller. One design for
// both roles.
//
// Registers and clock crossings are not here but in what flyframe generates with --board: board_support.v
// (resets, host bus) and alarm-slave.v or alarm-master.v. This file holds the vendor's PLL, the data pins'
// direction and the choice of the role.
//
// Macros: RMII is for PHYs with RMII; RING gives a master a second port to its slaves; WIDE_BUS is for a host
// bus of 32 bits, which leaves no pins for config_error and alarm_disabled.
`default_nettype none

// The pins of a port of the controller.
`ifdef RMII
`define PORT_0 \
  .rmii_0_ref_clk(rmii_clk), .rmii_0_crs_dv(rmii_0_crs_dv), .rmii_0_rx_er(rmii_0_rx_er), \
  .rmii_0_rxd(rmii_0_rxd), .rmii_0_link(rmii_0_link ^ (LINK_ACTIVE_LOW != 0)), \
  .rmii_0_tx_en(rmii_0_tx_en), .rmii_0_txd(rmii_0_txd)
`define PORT_1 \
  .rmii_1_ref_clk(rmii_clk), .rmii_1_crs_dv(rmii_1_crs_dv), .rmii_1_rx_er(rmii_1_rx_er), \
  .rmii_1_rxd(rmii_1_rxd), .rmii_1_link(rmii_1_link ^ (LINK_ACTIVE_LOW != 0)), \
  .rmii_1_tx_en(rmii_1_tx_en), .rmii_1_txd(rmii_1_txd)
`define PORT_2 \
  .rmii_2_ref_clk(rmii_clk), .rmii_2_crs_dv(rmii_2_crs_dv), .rmii_2_rx_er(rmii_2_rx_er), \
  .rmii_2_rxd(rmii_2_rxd), .rmii_2_link(rmii_2_link ^ (LINK_ACTIVE_LOW != 0)), \
  .rmii_2_tx_en(rmii_2_tx_en), .rmii_2_txd(rmii_2_txd)
`else
`define PORT_0 \
  .mii_0_rx_clk(mii_0_rx_clk), .mii_0_rx_dv(mii_0_rx_dv), .mii_0_rx_er(mii_0_rx_er), \
  .mii_0_rxd(mii_0_rxd), .mii_0_link(mii_0_link ^ (LINK_ACTIVE_LOW != 0)), \
  .mii_0_tx_en(mii_0_tx_en), .mii_0_txd(mii_0_txd)
`define PORT_1 \
  .mii_1_rx_clk(mii_1_rx_clk), .mii_1_rx_dv(mii_1_rx_dv), .mii_1_rx_er(mii_1_rx_er), \
  .mii_1_rxd(mii_1_rxd), .mii_1_link(mii_1_link ^ (LINK_ACTIVE_LOW != 0)), \
  .mii_1_tx_en(mii_1_tx_en), .mii_1_txd(mii_1_txd)
`define PORT_2 \
  .mii_2_rx_clk(mii_2_rx_clk), .mii_2_rx_dv(mii_2_rx_dv), .mii_2_rx_er(mii_2_rx_er), \
  .mii_2_rxd(mii_2_rxd), .mii_2_link(mii_2_link ^ (LINK_ACTIVE_LOW != 0)), \
  .mii_2_tx_en(mii_2_tx_en), .mii_2_txd(mii_2_txd)
`endif

module board #(
  parameter ROLE            = 0,   // 0 slave, 1 master
  parameter DATA_BUS_WIDTH  = 8,   // bits, as generated: 8, 16, 32
  parameter CORE_MHZ        = 100, // coreClockMhz, as generated: 50, 100
  parameter LINK_ACTIVE_LOW = 1,   // the PHYs' link pin is low for link
  // Word address of 8 KiB; follows from the width.
  parameter ADDRESS_BITS    = 13 - DATA_BUS_WIDTH / 16
) (
  input  wire                        clk_50,           // oscillator, 50 MHz, 25 ppm
  output wire                        phy_clk,          // for all PHYs: 25 MHz, or 50 MHz with RMII
  output wire                        phy_reset_n,

  // Port 0. Slave: towards the master. Master: the alarm line.
`ifdef RMII
  input  wire                        rmii_0_crs_dv,
  input  wire                        rmii_0_rx_er,
  input  wire [1:0]                  rmii_0_rxd,
  input  wire                        rmii_0_link,
  output wire                        rmii_0_tx_en,
  output wire [1:0]                  rmii_0_txd,
`else
  input  wire                        mii_0_rx_clk,
  input  wire                        mii_0_rx_dv,
  input  wire                        mii_0_rx_er,
  input  wire [3:0]                  mii_0_rxd,
  input  wire                        mii_0_link,
  output wire                        mii_0_tx_en,
  output wire [3:0]                  mii_0_txd,
`endif

  // Port 1. Slave: away from the master. Master: the plant network.
`ifdef RMII
  input  wire                        rmii_1_crs_dv,
  input  wire                        rmii_1_rx_er,
  input  wire [1:0]                  rmii_1_rxd,
  input  wire                        rmii_1_link,
  output wire                        rmii_1_tx_en,
  output wire [1:0]                  rmii_1_txd,
`else
  input  wire                        mii_1_rx_clk,
  input  wire                        mii_1_rx_dv,
  input  wire                        mii_1_rx_er,
  input  wire [3:0]                  mii_1_rxd,
  input  wire                        mii_1_link,
  output wire                        mii_1_tx_en,
  output wire [3:0]                  mii_1_txd,
`endif

`ifdef RING
  // Port 2. Master: the far end of the ring.
`ifdef RMII
  input  wire                        rmii_2_crs_dv,
  input  wire                        rmii_2_rx_er,
  input  wire [1:0]                  rmii_2_rxd,
  input  wire                        rmii_2_link,
  output wire                        rmii_2_tx_en,
  output wire [1:0]                  rmii_2_txd,
`else
  input  wire                        mii_2_rx_clk,
  input  wire                        mii_2_rx_dv,
  input  wire                        mii_2_rx_er,
  input  wire [3:0]                  mii_2_rxd,
  input  wire                        mii_2_link,
  output wire                        mii_2_tx_en,
  output wire [3:0]                  mii_2_txd,
`endif
`endif

  // Asynchronous memory bus of the microcontroller, all but address and data low active.
  input  wire                        bus_ne,
  input  wire                        bus_noe,
  input  wire                        bus_nwe,
  input  wire [DATA_BUS_WIDTH/8-1:0] bus_nbl,
  input  wire [ADDRESS_BITS-1:0]     bus_a,            // in words of the data bus
  inout  wire [DATA_BUS_WIDTH-1:0]   bus_d,
  output wire                        bus_nwait,
  output wire                        irq,              // high active
  input  wire                        host_ready,       // the microcontroller has loaded the configuration

`ifndef WIDE_BUS
  // A wire from pin CRC_ERROR of the FPGA: its configuration is damaged.
  input  wire                        config_error,
  // Master: a detector is disabled or tested.
  output wire                        alarm_disabled,
`endif

  // Detector, slave only.
  input  wire [2:0]                  alarm_current,
  // Slave: supply of the detector. Master: no fault (a relay that drops out is a fault).
  output wire                        alarm_supply,
  // Both: sounder; lamp of an alarm, in a master the fire output.
  output wire                        alarm_buzzer,
  output wire                        alarm_lamp
);

  // ---- Clocks: VCO 50 MHz * M 12 / N 1 = 600 MHz; C0 = 600 / CORE_MHZ: core clock, C1 = 24: 25 MHz --------
  // With RMII C2 = C3 = 12: 50 MHz for the PHYs, half a period behind the change of TXD, and for their RXD.
  wire       core_clk, phy_clk_ref, pll_locked, pll_reset;
  wire       unused_clk;
`ifdef RMII
  wire       rmii_clk;
`else
  wire [1:0] unused_rmii_clk;
`endif

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
`ifdef RMII
    .clk2_multiply_by(1),
    .clk2_divide_by(1),
    .clk2_duty_cycle(50),
    .clk2_phase_shift("10000"),      // ps; ref_clk_ns in board.sdc follows it
    .clk3_multiply_by(1),
    .clk3_divide_by(1),
    .clk3_duty_cycle(50),
    .clk3_phase_shift("15000"),      // capture_ns there
`endif
    .width_clock(5)
  ) pll (
    .inclk({1'b0, clk_50}),
    .areset(pll_reset),
`ifdef RMII
    .clk({unused_clk, rmii_clk, phy_clk, phy_clk_ref, core_clk}),
`else
    .clk({unused_clk, unused_rmii_clk, phy_clk_ref, core_clk}),
`endif
    .locked(pll_locked)
  );
`ifndef RMII
  assign phy_clk = phy_clk_ref;
`endif

  // ---- Reset and host bus ---------------------------------------------------------------------------------
  wire                        reset;
  wire                        host_req, host_write, host_ack;
  wire [15:0]                 host_addr;
  wire [DATA_BUS_WIDTH-1:0]   host_wdata, host_rdata;
  wire [DATA_BUS_WIDTH/8-1:0] host_be;
  wire [DATA_BUS_WIDTH-1:0]   bus_d_out;
  wire                        bus_d_drive;
  wire                        unused_busy_drive; // NWAIT is always driven

  board_support support (
    .clock(core_clk), .pll_locked(pll_locked), .reset(reset), .oscillator(clk_50), .pll_reset(pll_reset),
    .bus_cs_n(bus_ne), .bus_rd(bus_noe), .bus_wr_n(bus_nwe), .bus_be(bus_nbl), .bus_a({3'b000, bus_a}),
    .bus_d_in(bus_d), .bus_d_out(bus_d_out), .bus_d_drive(bus_d_drive),
    .bus_busy(bus_nwait), .bus_busy_drive(unused_busy_drive),
    .host_req(host_req), .host_write(host_write), .host_addr(host_addr),
    .host_wdata(host_wdata), .host_be(host_be), .host_ack(host_ack), .host_rdata(host_rdata)
  );
  assign bus_d = bus_d_drive ? bus_d_out : {DATA_BUS_WIDTH{1'bz}};

  // ---- The controller -------------------------------------------------------------------------------------
  wire unused_tx_tick;
  wire disabled;
`ifdef WIDE_BUS
  wire config_error = 1'b0;
  wire unused_disabled = disabled;
`else
  assign alarm_disabled = disabled;
`endif

  generate
    if (ROLE == 0) begin : slave
      alarm_slave core (
        .clock(core_clk), .reset(reset), .phy_clk_ref(phy_clk_ref), .phy_reset_n(phy_reset_n),
        .mii_tx_tick(unused_tx_tick), .pdi_operational(host_ready),
        `PORT_0, `PORT_1,
        .host_req(host_req), .host_write(host_write), .host_addr(host_addr),
        .host_wdata(host_wdata), .host_be(host_be), .host_ack(host_ack), .host_rdata(host_rdata), .irq(irq),
        .alarm_current(alarm_current), .alarm_supply(alarm_supply), .alarm_buzzer(alarm_buzzer),
        .alarm_lamp(alarm_lamp), .alarm_config_fault(config_error)
      );
      assign disabled = 1'b0;
    end else begin : master
      alarm_master core (
        .clock(core_clk), .reset(reset), .phy_clk_ref(phy_clk_ref), .phy_reset_n(phy_reset_n),
        .mii_tx_tick(unused_tx_tick),
        `PORT_0, `PORT_1,
        .host_req(host_req), .host_write(host_write), .host_addr(host_addr),
        .host_wdata(host_wdata), .host_be(host_be), .host_ack(host_ack), .host_rdata(host_rdata), .irq(irq),
`ifdef RING
        `PORT_2,
`endif
        .alarm_sounder(alarm_buzzer), .alarm_fire(alarm_lamp), .alarm_fault_n(alarm_supply),
        .alarm_disabled(disabled), .alarm_config_fault(config_error)
      );
      // A master has no detector, and its line runs without a host.
      wire unused_inputs = &{1'b0, alarm_current, host_ready};
    end
  endgenerate
endmodule

`default_nettype wire

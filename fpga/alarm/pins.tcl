# Pins of the alarm board, EP4CE6E22C8N (package E144). Bit i of a port is on the i-th pin of its list; a
# narrower host bus leaves the last ones of bus_d and bus_nbl out.
#
#   fixed   needs what this pin has: a clock input, or the output of a PLL
#   free    any user I/O pin will do: route the board as you like, then exchange pins here
#   slow    beside DCLK, where at 3.3 V only a signal may be that hardly ever changes
#
# Pins 23, 24, 25 and 88 to 91 are inputs only. Pins 6, 8, 12, 13 belong to the configuration memory and stay
# free.

# ---- Clocks ------------------------------------------------------------------------------------------------
fixed clk_50        23                       ;# clock input of PLL 1: 23, 24 or 25
fixed phy_clk       43                       ;# PLL1_CLKOUTp; a series resistor for each PHY
if {!$rmii} {
  fixed mii_0_rx_clk  24                     ;# any clock input
  fixed mii_1_rx_clk  88                     ;# any clock input
}

# ---- PHYs --------------------------------------------------------------------------------------------------
# With RMII a port has half of the data pins, and no clock.
slow  phy_reset_n   11
if {$rmii} {
  free  rmii_0_rxd     {34 33}
  free  rmii_0_crs_dv  30
  free  rmii_0_rx_er   28
  free  rmii_0_tx_en   38
  free  rmii_0_txd     {10 7}
  free  rmii_0_link    1
  free  rmii_1_rxd     {87 86}
  free  rmii_1_crs_dv  83
  free  rmii_1_rx_er   80
  free  rmii_1_tx_en   77
  free  rmii_1_txd     {76 75}
  free  rmii_1_link    98
} else {
  free  mii_0_rxd     {34 33 32 31}
  free  mii_0_rx_dv   30
  free  mii_0_rx_er   28
  free  mii_0_tx_en   38
  free  mii_0_txd     {10 7 3 2}
  free  mii_0_link    1
  free  mii_1_rxd     {87 86 85 84}
  free  mii_1_rx_dv   83
  free  mii_1_rx_er   80
  free  mii_1_tx_en   77
  free  mii_1_txd     {76 75 74 73}
  free  mii_1_link    98
}
if {$ring && $rmii} {
  free rmii_2_rxd    {42 44}
  free rmii_2_crs_dv 50
  free rmii_2_rx_er  51
  free rmii_2_tx_en  52
  free rmii_2_txd    {53 54}
  free rmii_2_link   59
} elseif {$ring} {
  free mii_2_rx_clk 25                       ;# a clock input, too
  free mii_2_rxd    {42 44 46 49}
  free mii_2_rx_dv  50
  free mii_2_rx_er  51
  free mii_2_tx_en  52
  free mii_2_txd    {53 54 55 58}
  free mii_2_link   59
}

# ---- Host --------------------------------------------------------------------------------------------------
# Two pins are shared: with 16 and 8 bits of data bus_a[11] and [12] take those of bus_d[31] and [30].
free  host_ready    [expr {$ring ? 101 : 25}]
free  irq           104
free  bus_nwait     105
free  bus_nwe       106
free  bus_noe       110
free  bus_ne        111
free  bus_nbl       {112 113 39 101}
free  bus_d         {114 115 119 120 121 124 125 126 127 128 129 132 133 135 136 137
                     42 44 46 49 50 51 52 53 54 55 58 59 60 64 65 66}
free  bus_a         {138 141 142 143 144 72 71 70 69 68 67 66 65}

# ---- Detector and signals ----------------------------------------------------------------------------------
# A pull-down of 1 kilo-ohm at each output: until the FPGA is configured, its pins pull up.
free  alarm_current {89 90 91}
free  alarm_supply  [expr {$wide ? 99 : 39}]
free  alarm_buzzer  100
free  alarm_lamp    103
if {!$wide} {
  # Pin 99 is CRC_ERROR: wire it to config_error.
  free alarm_disabled 60
  free config_error   64
}

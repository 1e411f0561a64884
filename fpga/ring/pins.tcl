# Pins of the ring board, package E144. Bit i of a port is on the i-th pin of its list; a narrower host bus
# leaves the last ones of bus_d and bus_nbl out.
#
#   fixed   needs what this pin has: a clock input, or the output of a PLL
#   free    any user I/O pin will do: route the board as you like, then exchange pins here
#   slow    beside DCLK, where at 3.3 V only a signal may be that hardly ever changes
#
# One layout does for EP4CE6, EP4CE10 and EP4CE15: only pins that all three have are used. Pins 23 to 25 and
# 88 to 91 are inputs only, in an EP4CE15 also 52 to 55 and 126 to 129. Pins 6, 8, 12, 13 belong to the
# configuration memory, 99 is CRC_ERROR: they stay free.

# ---- Clock -------------------------------------------------------------------------------------------------
fixed clk_50        23                       ;# clock input of PLL 1: 23, 24 or 25

# ---- Optical ports: towards the neighbours' port 2 and port 1 ----------------------------------------------
free  optical_1_rx      52
free  optical_1_signal  53
free  optical_1_tx      49
free  optical_2_rx      54
free  optical_2_signal  55
free  optical_2_tx      50

# ---- Host --------------------------------------------------------------------------------------------------
# Pins are shared: with 8 bits of data bus_a[12] to [14] take those of bus_d[15] to [13].
free  irq           104
free  bus_nwait     105
free  bus_nwe       106
free  bus_noe       110
free  bus_ne        111
free  bus_nbl       {112 113}
free  bus_d         {114 115 119 120 121 125 132 133 135 136 137 141 142 143 144 51}
free  bus_a         {126 127 128 129 68 67 66 65 64 60 59 58 51 144 143}

# ---- Twisted pair: transceiver of the second CAN port ------------------------------------------------------
if {$role eq "node-tp"} {
  free can_rx       91
  free can_tx       98
}

# ---- PHYs: of a server the plant network, of a gateway towards the master and away from it -----------------
if {$phys > 0} {
  fixed phy_clk       43                     ;# PLL1_CLKOUTp of EP4CE6 and EP4CE10; a resistor for each PHY
  slow  phy_reset_n   11
  fixed mii_0_rx_clk  24                     ;# any clock input
  free  mii_0_rxd     {33 32 31 30}
  free  mii_0_rx_dv   28
  free  mii_0_rx_er   25
  free  mii_0_tx_en   39
  free  mii_0_txd     {10 7 42 44}
  free  mii_0_link    46
}
if {$phys > 1} {
  fixed mii_1_rx_clk  88                     ;# any clock input
  free  mii_1_rxd     {87 86 85 83}
  free  mii_1_rx_dv   80
  free  mii_1_rx_er   89
  free  mii_1_tx_en   77
  free  mii_1_txd     {76 72 71 69}
  free  mii_1_link    90
}

# ---- The slave of a gateway: EEPROM with the device's description, LEDs, the ring's interrupt --------------
if {$role eq "gateway"} {
  free  ring_irq      103
  free  sii_scl       101
  free  sii_sda       100
  free  led_run       135
  free  led_err       136
  free  led_linkact   {137 141}
  free  eeprom_loaded 142
}

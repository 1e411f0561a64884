package flyframe

import flyframe.params.EscParams

/** Which way a signal goes, as Verilog writes it. */
sealed abstract class Direction(val verilog: String, val short: String)
object Direction {
  case object In  extends Direction("input", "in")
  case object Out extends Direction("output", "out")
}

/** A port of a top module.
  *
  * @param name
  *   in Verilog; with `y` in place of a number it stands once per port
  * @param bits
  *   its width with given parameters
  * @param width
  *   the same in words
  * @param built
  *   parameter sets that have it
  * @param condition
  *   the same in words; empty: all
  * @param onPort
  *   ports that have it, if it stands once per port
  */
final case class PortInfo(
    name: String,
    direction: Direction,
    bits: EscParams => Int,
    width: String,
    built: EscParams => Boolean,
    condition: String,
    meaning: String,
    onPort: (EscParams, Int) => Boolean = (_, _) => true
) {

  /** The names it has with parameters `p`: none if it is not built. */
  def names(p: EscParams): Seq[String] =
    if (!built(p)) Nil
    else if (name.contains("_y"))
      (0 until p.portCount).filter(onPort(p, _)).map(y => name.replace("_y", s"_$y"))
    else Seq(name)
}

/** The ports of all top modules in the order they are emitted: the only place that says in words what they
  * are. That the Verilog has exactly these is tested for every preset.
  */
object PortTable {
  import Direction._

  private def port(name: String, direction: Direction, bits: Int, meaning: String) =
    PortInfo(name, direction, _ => bits, bits.toString, _ => true, "", meaning)

  /** Only there if `built`; `condition` says so in words. */
  private def optional(condition: String, built: EscParams => Boolean)(ports: PortInfo*): Seq[PortInfo] =
    ports.map(_.copy(condition = condition, built = built))

  // format: off
  private val clocks = Seq(
    port("clock",       In, 1, "core clock, `coreClockMhz`, from a PLL"),
    port("reset",       In, 1,
      "active high; clears without a clock (B-119): begins at any time, comes from a register, ends in " +
        "step with `clock`. Hold it until the PLL has locked, and 10 ms more where there are PHYs"),
    port("phy_clk_ref", In, 1,
      "the 25 MHz that PHYs with MII get, from the same PLL; it aligns the nibble slots. Tied low: any " +
        "phase, which PHYs with RMII do not allow")
  )

  private val mii = optional("MII at port `y`", _ => true)(
    port("mii_y_rx_clk", In,  1, "RX_CLK of the PHY"),
    port("mii_y_rx_dv",  In,  1, "RX_DV, in `mii_y_rx_clk`"),
    port("mii_y_rx_er",  In,  1, "RX_ER, in `mii_y_rx_clk`"),
    port("mii_y_rxd",    In,  4, "RXD, in `mii_y_rx_clk`"),
    port("mii_y_link",   In,  1,
      "high while the PHY reports a link; of a slave also low, as `linkLowPorts` says. Any clock"),
    port("mii_y_tx_en",  Out, 1, "TX_EN, in `clock`, a new value every 40 ns. Tie TX_ER of the PHY low"),
    port("mii_y_txd",    Out, 4, "TXD, likewise")
  ).map(_.copy(onPort = !_.isRmii(_)))

  private val rmii = optional("`rmiiPorts` has bit `y`", _.rmiiPorts != 0)(
    port("rmii_y_ref_clk", In, 1, "the PHY's 50 MHz, from the same PLL as `clock`"),
    port("rmii_y_crs_dv",  In, 1, "CRS_DV, in `rmii_y_ref_clk`"),
    port("rmii_y_rx_er",   In, 1, "RX_ER, likewise; tie it low if the PHY has none"),
    port("rmii_y_rxd",     In, 2, "RXD, likewise"),
    port("rmii_y_link",    In, 1, "as `mii_y_link`"),
    port("rmii_y_tx_en",  Out, 1, "TX_EN, in `clock`, a new value every 20 ns"),
    port("rmii_y_txd",    Out, 2, "TXD, likewise")
  ).map(_.copy(onPort = _.isRmii(_)))

  private val phys = mii ++ rmii ++ Seq(
    port("mii_tx_tick",  Out, 1,
      "high in the first core cycle of each new TXD; to check the phase, else leave open"),
    port("phy_reset_n",  Out, 1, "low while `reset` is high; to the PHYs' reset")
  )

  private def ofLanes(name: String, direction: Direction, meaning: String) =
    port(name, direction, 0, meaning).copy(bits = _.lanes, width = "`dataBusWidth` / 8")
  private def ofWord(name: String, direction: Direction, meaning: String) =
    port(name, direction, 0, meaning).copy(bits = _.dataBusWidth, width = "`dataBusWidth`")
  private def ofWords(name: String, direction: Direction, meaning: String) =
    port(name, direction, 0, meaning)
      .copy(bits = p => 16 - Integer.numberOfTrailingZeros(p.lanes), width = "16, 15 or 14")

  private val plainHost = optional("`hostInterface` 0", _.hostInterface == 0)(
    port("host_req",   In,   1,
      "asks for an access; hold it and the next four until `host_ack`, then low for a cycle"),
    port("host_write", In,   1, "1 write, 0 read"),
    port("host_addr",  In,  16, "byte address; bits within a word are ignored"),
    ofWord("host_wdata", In, "data of a write, byte 0 in the low bits"),
    ofLanes("host_be",   In, "bytes of the word that are read (some reads acknowledge events) or written"),
    port("host_ack",   Out,  1, "the access is done"),
    ofWord("host_rdata", Out, "data of a read, valid with `host_ack`")
  )
  private val avalon = optional("`hostInterface` 1", _.hostInterface == 1)(
    ofWords("avalon_address",     In, "Avalon-MM agent in `clock`: address of a word of `dataBusWidth` bits"),
    port("avalon_read",           In,  1, "asks for a read; hold it until `avalon_waitrequest` is low"),
    port("avalon_write",          In,  1, "asks for a write, likewise"),
    ofLanes("avalon_byteenable",  In, "bytes that are read (some reads acknowledge events) or written"),
    ofWord("avalon_writedata",    In, "data of a write, byte 0 in the low bits"),
    ofWord("avalon_readdata",    Out,
      "data of a read, valid in the cycle in which `avalon_waitrequest` is low"),
    port("avalon_waitrequest",   Out, 1, "low: the access is done")
  )
  private val axi = optional("`hostInterface` 2", _.hostInterface == 2)(
    port("axi_awaddr",  In,  16,
      "AXI4-Lite subordinate in `clock`: byte address of a write, of which bits 1:0 are ignored"),
    port("axi_awprot",  In,   3, "ignored"),
    port("axi_awvalid", In,   1, "the address of a write is there"),
    port("axi_awready", Out,  1, "it is taken, together with the data"),
    port("axi_wdata",   In,  32, "data of a write, byte 0 in the low bits"),
    port("axi_wstrb",   In,   4, "bytes that are written"),
    port("axi_wvalid",  In,   1, "the data of a write are there"),
    port("axi_wready",  Out,  1, "they are taken"),
    port("axi_bresp",   Out,  2, "0, OKAY: the write is done"),
    port("axi_bvalid",  Out,  1, "its response is there"),
    port("axi_bready",  In,   1, "the response is taken"),
    port("axi_araddr",  In,  16, "byte address of a read, of which bits 1:0 are ignored"),
    port("axi_arprot",  In,   3, "ignored"),
    port("axi_arvalid", In,   1, "the address of a read is there"),
    port("axi_arready", Out,  1, "it is taken"),
    port("axi_rdata",   Out, 32, "data of a read, of all four bytes"),
    port("axi_rresp",   Out,  2, "0, OKAY"),
    port("axi_rvalid",  Out,  1, "the data are there"),
    port("axi_rready",  In,   1, "they are taken")
  )
  private val wishbone = optional("`hostInterface` 3", _.hostInterface == 3)(
    port("wb_cyc",    In,   1, "Wishbone B4 slave in `clock`: a cycle"),
    port("wb_stb",    In,   1, "asks for an access; hold it until `wb_ack`"),
    port("wb_we",     In,   1, "1 write, 0 read"),
    ofWords("wb_adr", In, "address of a word of `dataBusWidth` bits"),
    ofLanes("wb_sel", In, "bytes that are read (some reads acknowledge events) or written"),
    ofWord("wb_dat_w", In, "data of a write, byte 0 in the low bits"),
    ofWord("wb_dat_r", Out, "data of a read, valid with `wb_ack`"),
    port("wb_ack",    Out,  1, "the access is done"),
    port("wb_stall",  Out,  1, "for pipelined masters: low with `wb_ack` only")
  )
  private val spi = optional("`hostInterface` 4", _.hostInterface == 4)(
    port("spi_sel",         In, 1, "SPI slave: select, active as `spiSelHigh` says"),
    port("spi_clk",         In, 1,
      "clock of the host, at most a quarter of `clock`, less with many SyncManagers (B-115); it may stop"),
    port("spi_mosi",        In, 1, "data from the host, in `spi_clk`"),
    port("spi_miso",       Out, 1, "data to the host, in `spi_clk`"),
    port("spi_miso_drive", Out, 1, "drive them; high while the slave is selected")
  )
  private val bus = optional("`hostInterface` 5", _.hostInterface == 5)(
    port("bus_cs_n",       In, 1,
      "asynchronous microcontroller bus: chip select, low active. Any clock, as all of it"),
    port("bus_rd",         In, 1, "read, active as `busReadHigh` says"),
    port("bus_wr_n",       In, 1, "write, low active"),
    ofLanes("bus_be",      In,
      "byte enables, active as `busByteEnableHigh` says; with 16 bits, low active, these may be A0 and BHE"),
    ofWords("bus_a",       In, "address of a word of `dataBusWidth` bits"),
    ofWord("bus_d_in",     In, "level of the data pins"),
    ofWord("bus_d_out",   Out, "level to drive them with"),
    port("bus_d_drive",   Out, 1, "drive them; follows the pins without a clock"),
    port("bus_busy",      Out, 1, "level of BUSY, active as `busBusyDriver` says; begins without a clock"),
    port("bus_busy_drive", Out, 1, "drive it; high unless it is an open drain or source")
  )
  private val host = plainHost ++ avalon ++ axi ++ wishbone ++ spi ++ bus

  private val optical = Seq(1, 2).flatMap(y => Seq(
    port(s"optical_${y}_rx",     In,  1, s"from the receiver of optical port $y, 1 is light. Any clock"),
    port(s"optical_${y}_signal", In,  1,
      s"high while the receiver of port $y tells of light; tie it high if it tells nothing. Any clock"),
    port(s"optical_${y}_tx",     Out, 1, s"to the transmitter of optical port $y, 1 is light")
  ))
  private val pair = optional("`canPorts` 2", _.canPorts == 2)(
    port("can_rx", In,  1, "RXD of the transceiver on the twisted pair, low is dominant. Any clock"),
    port("can_tx", Out, 1, "its TXD, likewise")
  )

  /** Ports of a slave controller. */
  val slave: Seq[PortInfo] = clocks ++
    optional("`sii` 0", !_.hasSii)(
      port("pdi_operational", In, 1,
        "high when the local configuration is loaded; opens the process data RAM. Any clock")
    ) ++
    optional("`sii` 1 or 2", _.hasSii)(
      port("eeprom_loaded", Out, 1, "the configuration has come from the EEPROM")
    ) ++ phys ++ host ++
    optional(
      "`applicationLayer` or `alarm`, and a host",
      p => !p.isDigitalIo && (p.hasApplicationLayer || p.hasAlarm)
    )(
      port("irq", Out, 1, "interrupt to the host, a level")
    ) ++
    optional("`sii` 1", _.hasI2c)(
      port("sii_scl_low",  Out, 1, "1 pulls the clock line of the EEPROM low, 0 lets it go (pull-up 4.7 kΩ)"),
      port("sii_sda_low",  Out, 1, "the same for its data line"),
      port("sii_sda",      In,  1, "level of the data line"),
      port("sii_two_byte", In,  1, "strap: high for EEPROMs of 32 Kbit and more")
    ) ++
    optional("`mi` 1 or 2", _.hasMi)(
      port("mi_mdc",         Out, 1, "MDC of the management bus to the PHYs, at most 2.5 MHz"),
      port("mi_mdio_in",     In,  1, "level of its data line, which has a pull-up (1.5 kΩ)"),
      port("mi_mdio_out",    Out, 1, "level to drive it with"),
      port("mi_mdio_enable", Out, 1, "drive it")
    ) ++
    optional("`enhancedLinkDetection` and `fxPorts`", _.resetsPhys)(
      port("phy_port_reset_n_y", Out, 1,
        "to the reset of the PHY at port `y`, in place of `phy_reset_n`: low also when it must begin anew")
    ) ++
    optional("`resetRegisters`", _.hasResetRegisters)(
      port("reset_request", Out, 1,
        "high until there is a reset: bus or host ask for one of the whole chip, PHYs and host included")
    ) ++
    optional("`syncSignals` 1 or 2", _.syncSignals > 0)(
      port("clock_signals_sync_0", Out, 1, "SYNC0 of distributed clocks, high in its pulse")
    ) ++
    optional("`syncSignals` 2", _.syncSignals > 1)(
      port("clock_signals_sync_1", Out, 1, "SYNC1, likewise")
    ) ++
    optional("`latchSignals` 1 or 2", _.latchSignals > 0)(
      port("clock_signals_latch_0", In, 1,
        "LATCH0 of distributed clocks: the time of its edges is kept. Any clock")
    ) ++
    optional("`latchSignals` 2", _.latchSignals > 1)(
      port("clock_signals_latch_1", In, 1, "LATCH1, likewise")
    ) ++
    optional("`leds`", _.hasLeds)(
      port("led_run",       Out, 1, "RUN, high = lit"),
      port("led_err",       Out, 1, "ERR, high = lit"),
      port("led_linkact_y", Out, 1, "link and activity of a port, high = lit")
    ) ++
    optional("`digitalOutputs`", _.digitalOutputs > 0)(
      port("digital_output",        Out, 0, "levels of the digital outputs")
        .copy(bits = 8 * _.digitalOutputs, width = "8 × `digitalOutputs`"),
      port("digital_output_driven", Out, 1, "low: let the outputs go; without a host they are 0, too")
    ) ++
    optional("`hostInterface` 6 and `digitalOutputs`", p => p.isDigitalIo && p.digitalOutputs > 0)(
      port("digital_output_valid",  Out, 1,
        "high for 80 ns, from a core cycle behind the outputs on, when an event has brought them"),
      port("digital_output_enable", In,  1, "low: the outputs are not driven. Any clock")
    ) ++
    optional("`digitalInputs`", _.digitalInputs > 0)(
      port("digital_input",         In,  0, "levels of the digital inputs. Any clock")
        .copy(bits = 8 * _.digitalInputs, width = "8 × `digitalInputs`")
    ) ++
    optional("`digitalInputEvent` 1", _.digitalInputEvent == 1)(
      port("digital_latch",         In,  1, "when it rises the inputs are taken. Any clock")
    ) ++
    optional("`hostInterface` 6", _.isDigitalIo)(
      port("digital_frame_begins",  Out, 1, "high for 80 ns when a frame has begun")
    ) ++
    optional("`generalOutputs`", _.generalOutputs > 0)(
      port("general_output",        Out, 0, "levels of the general purpose outputs")
        .copy(bits = 8 * _.generalOutputs, width = "8 × `generalOutputs`")
    ) ++
    optional("`generalInputs`", _.generalInputs > 0)(
      port("general_input",         In,  0, "levels of the general purpose inputs. Any clock")
        .copy(bits = 8 * _.generalInputs, width = "8 × `generalInputs`")
    ) ++
    optional("`alarm`", _.hasAlarm)(
      port("alarm_current", In,  3,
        "comparators; the line's current is above that of [0] a whole line, [1] an alarm, " +
          "[2] a short circuit"),
      port("alarm_supply",  Out, 1, "switches the supply of the detector's line"),
      port("alarm_buzzer",  Out, 1, "sounds from an alarm on until it is silenced"),
      port("alarm_lamp",    Out, 1, "lit from an alarm on until the detector is reset"),
      port("alarm_config_fault", In, 1,
        "high: the device has found its configuration damaged. Any clock")
    ) ++
    optional("`ring`", _.hasRing)(optical: _*) ++ pair ++
    optional("`ring`", _.hasRing)(
      port("ring_irq", Out, 1, "interrupt to the host: an event of the ring; a level")
    )

  /** Ports of an alarm master. Its port 0 leads to the line, port 1 to the plant network; port 2 is the
    * other end of a ring.
    */
  val master: Seq[PortInfo] = clocks ++ phys ++ host ++ Seq(
    port("irq",                Out, 1,
      "interrupt to the host: an order of the server waits, or a datagram is back; a level"),
    port("alarm_fire",         Out, 1, "fire: from an alarm on until it is reset"),
    port("alarm_sounder",      Out, 1, "sounds from an alarm on until it is silenced"),
    port("alarm_fault_n",      Out, 1, "low: there is a fault"),
    port("alarm_disabled",     Out, 1, "a detector is disabled or tested"),
    port("alarm_config_fault", In,  1, "high: the device has found its configuration damaged. Any clock")
  )

  /** Ports of a ring node. */
  val ring: Seq[PortInfo] = clocks.take(2) ++ optical ++ pair ++ (clocks.drop(2) ++ phys).map(pin =>
    pin.copy(
      condition = if (pin.condition.contains("rmii")) pin.condition else "`plant` 1",
      built = p => p.hasPlant && pin.built(p)
    )
  ) ++ host.filterNot(spi.contains) ++ Seq(
    port("irq",    Out, 1, "interrupt to the host: an event that the mask lets pass; a level")
  )
  // format: on

  /** Ports of the top module of parameters `p`. */
  def apply(p: EscParams): Seq[PortInfo] = Seq(slave, master, ring)(p.role)
}
